"""Every number of every kind at its ends and beyond: refused by its field, or computed without a fault."""

from __future__ import annotations

import copy
import time
from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from optim.problem.checks import DataError
from service.errors import InvalidRequestError
from service.jobs.job_parts import PartStoppedError
from service.jobs.kind_registry import ABOUT_THE_JOB
from service.jobs.kinds import SHIPPED
from service.jobs.outputs import Silent
from service.jobs.strict_json import dumps, validated

SMALL = [5e-324, 1e-300, 1e-160, 1e-30, 1e-16, 1e-9]
VALUES: list[float] = [
    0, -0.0, 1, -1, 3, *SMALL, *(-one for one in SMALL), 1e9, 1e15, -1e15, 1e100, 1e308, -1e308,
    2**31, 2**53, 2**63, 2**64, -(2**63) - 1, 10**400,
]  # fmt: skip
SECONDS = 0.1
"""After so long what is computed is told to stop: what goes wrong for a number does so at once."""
PATH = ("damper.N0", 100.0)
MEASURED = {"frequency": [1.0, 1.2], "amplitude": [1.93, 1.77]}
BASE: dict[str, dict[str, Any]] = {
    "sweep": {"from": 0.9, "to": 1.3},
    "map": {"parameter": PATH[0], "from": 50, "to": 100, "steps": 2, "frequencies": 3, "ridge": False},
    "peaks": {"parameter": PATH[0], "from": 80, "to": 100, "checks": 0},
    "design": {"variables": {PATH[0]: [50, 100]}, "limit": 2.0},
    "pareto": {"variables": {PATH[0]: [50, 100]}, "points": 3, "limit": 2.0},
    "margin": {"from": 90, "to": 110, "points": 2, "limit": 2.0, "dampers": {"light": {PATH[0]: 50}}},
    "solve": {"frequency_hz": 1.2, "accuracy": 0.1},
    "march": {"frequency_hz": 1.2, "max_periods": 3, "tolerance": 1e-2},
    "transient": {"begin_hz": 1.0, "end_hz": 1.2, "rate_hz_per_s": 1.0, "from_rest": True, "tolerance": 0.1},
    "quasi-periodic": {"frequency_hz": 1.05, "second_hz": 1.4, "amplitude": 60, "turns": 12, "harmonics": 1},
    "wear": {
        "hours": 1, "coefficient": {"damper": 1e-14}, "area": {"damper": 1e-4}, "frequency_hz": 1.2,
        "load_loss_per_depth": {"damper": 1e6}, "points": 2, "tolerance": 0.1,
    },
    "accuracy": {"frequency_hz": 1.2, "harmonics": [1], "samples": [64], "repeats": 1},
    "campbell": {"speeds_rpm": [[50, 90]], "orders": [1], "limit": 2.0, "band_hz": [0.9, 1.4]},
    "interference": {"scene": "bladed-disk", "speed_rpm": 11000, "families": 1},
    "mistuning": {"scene": "bladed-disk", "of": ["tip"], "samples": 1, "from": 700, "to": 710},
    "worst-mistuning": {
        "scene": "bladed-disk", "of": ["tip"], "contacts": "stuck", "starts": 1, "climbs": 0, "climb": 0,
    },
    "identify": {
        "unknowns": {"damper.mu": [0.1, 0.6]}, "starts": 1, "priors": {"damper.mu": [0.3, 0.1]},
        "candidates": {PATH[0]: [80.0, 90.0]},
        "data": [{**MEASURED, "conditions": {PATH[0]: 100.0}, "phase": [-0.3, -0.9]}],
    },
    "posterior": {
        "unknowns": {"damper.mu": [0.1, 0.6]}, "starts": 1, "draws": 100, "priors": {"damper.mu": [0.3, 0.1]},
        "data": [{**MEASURED, "conditions": {PATH[0]: 100.0}, "sd": [0.01, 0.02]}],
    },
    "modes": {"mode": 1, "from": 0.9, "to": 1.0},
    "controlled": {"amplitude": 1.0, "from": 1.0, "to": 1.1, "no_stability": True},
    "sensitivities": {},
    "plan": {},
}  # fmt: skip
"""A cheap request of each kind."""
OTHERWISE: dict[str, dict[str, Any]] = {
    "posterior": {
        "priors": None,
        "models": {"b": {"scene": "two-dof", "set": {PATH[0]: 90.0}, "unknowns": {"damper.kt": [2e3, 9e3]}}},
    },
    "worst-mistuning": {"contacts": "solved", "harmonics": 1, "set": {"shroud.N0": 500.0}},
}
"""What some of them have in another case."""

Place = tuple[str | int, ...]


def body_of(kind: str) -> dict[str, Any]:
    harmonics = {"harmonics": 1} if "harmonics" in SHIPPED[kind].request.model_fields else {}
    return {"scene": "two-dof", "set": {"excitation.amplitude": 100.0}} | harmonics | BASE[kind] | (
        {"set": {}} if "scene" in BASE[kind] else {}
    )  # fmt: skip


def numbers(value: Any, place: Place = ()) -> Iterator[Place]:
    """Places of the numbers in a body."""
    if isinstance(value, Mapping | list):
        for key, inner in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from numbers(inner, (*place, key))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield place


def schemas(schema: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    yield from schema.get("anyOf", [schema])


def further(name: str, schema: Mapping[str, Any], body: Mapping[str, Any]) -> Iterator[tuple[Place, Any]]:
    """Places of numbers of a key that the body leaves out, each with a value of the key that has it."""
    if name in body or name in ABOUT_THE_JOB:
        return
    for one in schemas(schema):
        if one.get("type") in ("number", "integer"):
            yield (name,), 1
        elif one.get("type") == "array":
            for item in schemas(one.get("items", {})):
                if item.get("type") in ("number", "integer"):
                    value = [1.0, 2.0] if one.get("minItems") == 2 else [1]
                    yield from (((name, i), value) for i in range(len(value)))
                elif item.get("type") == "array":
                    yield from (((name, 0, i), [[1.0, 2.0]]) for i in range(2))
        elif one.get("type") == "object":
            inner = next(iter(one.get("patternProperties", {}).values()), one.get("additionalProperties"))
            named = one.get("propertyNames", {}).get("enum")
            key = named[0] if named else PATH[0] if "patternProperties" in one else "damper"
            if isinstance(inner, dict) and any(each.get("type") == "number" for each in schemas(inner)):
                yield (name, key), {key: 1.0}


def places(kind: str) -> list[tuple[Place, dict[str, Any]]]:
    """Every place of a number in requests of a kind, with a body that has it."""
    body, schema = body_of(kind), SHIPPED[kind].request.model_json_schema()
    other = OTHERWISE.get(kind, {})
    found = [(place, body) for place in numbers(body)]
    found += [(place, {**body, **other}) for place in numbers(other)]
    for name, one in schema["properties"].items():
        found += [(place, {**body, name: value}) for place, value in further(name, one, body)]
    return found


def ends(kind: str, place: Place) -> list[float]:
    """The ends of a number of a schema."""
    schema = SHIPPED[kind].request.model_json_schema()["properties"][place[0]]
    found: list[float] = []
    for one in schemas(schema):
        found += [one[key] for key in one if key.lower().endswith(("minimum", "maximum"))]
    return found


def with_number(body: Mapping[str, Any], place: Place, value: float) -> dict[str, Any]:
    changed = copy.deepcopy(dict(body))
    inner: Any = changed
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    return changed


class _Nowhere:
    """No scenes but those that are shipped."""

    def scene_body(self, _name: str) -> None:
        return None

    def with_uploads(self, body: Mapping[str, object]) -> Mapping[str, object]:
        return body


def fault(kind: str, body: dict[str, Any]) -> str | None:
    """What goes wrong that must not: refused without a field, or any error of what is computed."""
    made = SHIPPED[kind]
    try:
        request = validated(made.request, body)
        resolved = made.resolve(request, _Nowhere())
        dumps(resolved.spec)
    except InvalidRequestError as error:
        return None if all(issue.subject and issue.said() for issue in error.issues) else str(error)
    begin = time.monotonic()
    try:
        made.run(resolved.spec, Silent(), lambda: time.monotonic() > begin + SECONDS)
    except (PartStoppedError, DataError):  # that measured data fit no model is known when it is solved
        return None
    except Exception as error:  # noqa: BLE001 - whatever it is
        return f"{type(error).__name__}: {error}"
    return None


CASES = {
    "-".join(map(str, (kind.name, *case[0]))): (kind.name, *case)
    for kind in SHIPPED
    for case in places(kind.name)
}


def test_a_number_out_of_its_range_is_refused_by_its_field() -> None:
    """None of these is within any range, whatever the scene."""
    for kind, place, body in CASES.values():
        for value in (1e100, -1e308, 10**400):
            try:
                request = validated(SHIPPED[kind].request, with_number(body, place, value))
                SHIPPED[kind].resolve(request, _Nowhere())
            except InvalidRequestError as refused:
                wrong = {issue.subject[0] for issue in refused.issues}
                assert wrong == {place[0]}, (kind, place, value)
            else:
                raise AssertionError((kind, place, value))


@pytest.mark.few(
    90, keep=["march-frequency_hz", "march-tolerance", "transient-begin_hz", "interference-speed_rpm"]
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("case", list(CASES))
def test_a_number_at_an_extreme(case: str) -> None:
    kind, place, body = CASES[case]
    values = [*VALUES, *ends(kind, place)]
    found = {repr(one): fault(kind, with_number(body, place, one)) for one in values}
    assert {value: wrong for value, wrong in found.items() if wrong} == {}
