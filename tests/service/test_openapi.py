"""The description of the API: bodies and errors have examples, answers types; a page without scripts."""

import inspect
import json
import re
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from service_helpers import ServedClient, is_problem

from service.client import workbench
from service.client.client import Client
from service.jobs.kinds import SHIPPED
from service.jobs.strict_json import validated

WITHOUT_BODY = {"204", "304"}


@pytest.fixture(scope="module")
def description(shipped: ServedClient) -> dict[str, Any]:
    return shipped.get("/openapi.json").json()


def operations(description: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, methods in description["paths"].items():
        for method, operation in methods.items():
            yield method, path, operation


def test_operation_ids_are_stable_and_unique(description: dict[str, Any]) -> None:
    found = [operation["operationId"] for _, _, operation in operations(description)]
    assert len(found) == len(set(found))
    assert {"submit", "submit_design", "list_jobs", "get_job", "dismiss", "results", "events", "list_sweeps",
            "get_sweep", "plot_svg", "plot_png", "list_designs", "get_design", "list_scenes", "get_scene",
            "store_scene", "upload", "list_uploads", "get_upload", "delete_upload", "plan", "live", "ready",
            "metrics"} <= set(found)  # fmt: skip


def test_every_answer_is_typed_and_every_error_has_an_example(description: dict[str, Any]) -> None:
    shown = set()
    for method, path, operation in operations(description):
        for status, answer in operation["responses"].items():
            where = (method, path, status)
            content = answer.get("content", {})
            assert bool(content) != (status in WITHOUT_BODY), where
            for form, media in content.items():
                schema = media.get("schema") or media.get("itemSchema")
                assert schema, where
                assert schema not in ({}, {"type": "object"}), where
                if form == "application/problem+json":
                    names = [one["$ref"].rpartition("/")[2] for one in media["examples"].values()]
                    values = [description["components"]["examples"][name]["value"] for name in names]
                    assert status == "default" or {one["status"] for one in values} == {int(status)}, where
                    shown |= {one["type"].rpartition(":")[2] for one in values}
        assert "default" in operation["responses"]
    assert {"not-found", "conflict", "job-failed", "queue-full", "body-too-large"} <= shown


def test_every_body_has_examples_that_work(shipped: ServedClient, description: dict[str, Any]) -> None:
    bodies = 0
    for method, path, operation in operations(description):
        for form, media in operation.get("requestBody", {}).get("content", {}).items():
            bodies += 1
            examples = [one["value"] for one in media["examples"].values()]
            assert examples, (path, form)
            if path == "/v1/jobs":
                kinds = {one["properties"]["kind"]["const"] for one in media["schema"]["oneOf"]}
                assert {example["kind"] for example in examples} == kinds, (
                    "tests/service/test_kinds.py runs them"
                )
            elif path == "/v1/uploads":
                data = {"params": {"name": "example.mtx"}, "content": examples[0]}
                assert shipped.request(method, path, **data).status_code in (200, 201)
            elif "{" in path:
                continue  # tests/service/test_workbench.py sends them
            elif path != "/v1/designs":
                assert shipped.request(method, path, json=examples[0]).status_code in (200, 201), path
    assert bodies >= 10


def test_the_page_needs_neither_scripts_nor_the_internet(shipped: ServedClient) -> None:
    page = shipped.get("/docs")
    assert page.status_code == 200
    policy = page.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "<script" not in page.text
    links = re.findall(r'(?:href|src)="([^"]+)"', page.text)
    assert all(link.startswith(("/", "#")) for link in links)
    assert all(shipped.get(link).status_code == 200 for link in set(links) if link.startswith("/"))
    ids = set(re.findall(r'id="([^"]+)"', page.text))
    assert {link[1:] for link in links if link.startswith("#")} <= ids
    assert "Idempotency-Key" in page.text or "MatrixMarket" in page.text


def test_the_description_is_whole(shipped: ServedClient, description: dict[str, Any]) -> None:
    text = shipped.get("/openapi.json").text
    assert json.loads(text) == description
    for reference in re.findall(r'"\$ref":\s*"#/([^"]+)"', text):
        found: Any = description
        for key in reference.split("/"):
            found = found[key]
    body = description["paths"]["/v1/jobs"]["post"]["requestBody"]["content"]["application/json"]["schema"]
    kinds = {one["properties"]["kind"]["const"]: one for one in body["oneOf"]}
    assert set(kinds) == {kind.name for kind in SHIPPED}
    for kind, schema in kinds.items():
        assert schema["examples"], kind
        for example in schema["examples"]:
            assert example["kind"] == kind
            request = validated(SHIPPED[kind].request, {k: v for k, v in example.items() if k != "kind"})
            assert SHIPPED[kind].resolve(request, shipped.service.scenes).scene_name == example["scene"]
    assert {"from", "to", "set", "harmonics", "frequency_hz"} <= set(kinds["sweep"]["properties"])
    assert "requestBody" in description["paths"]["/v1/designs"]["post"]


def test_there_is_a_method_for_every_route(description: dict[str, Any]) -> None:
    source = inspect.getsource(Client) + inspect.getsource(workbench)
    for path, operations in description["paths"].items():
        if path in ("/health/live", "/docs", "/docs/style.css"):
            continue
        words = [word for word in path.split("/") if word and not word.startswith("{") and "." not in word]
        assert "/" + "/".join(words[:2]) in source, path
        assert all(f"/{word}" in source or word in source for word in words), (path, operations)


def test_other_refusals_have_the_form_described(http: httpx.Client) -> None:
    is_problem(http.get("/docs/none"), 404)
    is_problem(http.post("/docs"), 405)
