"""Every query parameter of every route at the ends of what it may be, and beyond: never an error of ours."""

from __future__ import annotations

import base64
import json
from typing import Any

import httpx
import pytest
from service_helpers import is_problem

DATES = (
    "0001-01-01T00:00:00Z", "0001-01-01T00:00:00+23:59", "9999-12-31T23:59:59.999999Z",
    "9999-12-31T23:59:59-23:59", "9999-12-31", "-271821-04-20T00:00:00Z", "1970-01-01T00:00:00+00:00",
    "99999999999", "-99999999999", "1e308", "253402300800", "nan", "24:00",
)  # fmt: skip
NUMBERS = (
    "0", "-0", "1e308", "-1e308", "5e-324", "1e999", "nan", "inf", "9223372036854775807",
    "9223372036854775808",
    "-9223372036854775809", "18446744073709551616", "1" * 400, "2147483648", "0x10", "1_000", "",
)  # fmt: skip


def cursors() -> list[str]:
    """Places in a list that nobody was told."""
    places: list[Any] = [
        [value, text]
        for value in (1e308, -1e308, 1e18, 10**400, None, "x", [], True)
        for text in ("", "x", 1, None)
    ]
    texts = [json.dumps(one) for one in [*places, {}, [], "x", 1, None]] + ['[NaN, "x"]', '[Infinity, "x"]']
    return [base64.urlsafe_b64encode(text.encode()).decode().rstrip("=") for text in texts]


@pytest.mark.parametrize("step", [6, pytest.param(1, marks=pytest.mark.long)])
def test_the_ends_of_every_query_parameter(shipped: httpx.Client, step: int) -> None:
    """Each parameter at every `step`-th value, those of one parameter not those of the next."""
    described = shipped.get("/openapi.json").json()["paths"]
    failed, asked, first = [], 0, 0
    for path, operations in described.items():
        for one in operations.get("get", {}).get("parameters", ()):
            if one["in"] != "query" or path.endswith("/events"):
                continue
            address = path.replace("{job_id}", "none").replace("{", "").replace("}", "")
            values = cursors() if one["name"] == "cursor" else DATES + NUMBERS
            first += 1
            for value in values[first % step :: step]:
                answer = shipped.get(address, params={one["name"]: value})
                asked += 1
                if answer.status_code >= 500:
                    failed.append((path, one["name"], value, answer.status_code))
    assert asked > 1000 / step
    assert failed == []


@pytest.mark.parametrize("name", ["created_after", "created_before"])
def test_a_time_beyond_the_calendar_is_refused_with_its_field(shipped: httpx.Client, name: str) -> None:
    for value in ("0001-01-01T00:00:00+23:59", "9999-12-31T23:59:59-23:59"):
        refused = is_problem(shipped.get("/v1/runs", params={name: value}), 422)
        assert refused["errors"][0]["pointer"] == f"/{name}"
        assert "0001-01-01" in refused["detail"]
