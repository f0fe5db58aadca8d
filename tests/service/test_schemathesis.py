"""The description of the API against a real service: no error of the program, no answer out of form."""

import threading
from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from schemathesis import GenerationMode
from service_helpers import ServedClient, serving

from service.jobs.kinds import SHIPPED

schemathesis.checks.load_all_checks()
CHECKS = schemathesis.checks.CHECKS.get_by_names(
    ["not_a_server_error", "status_code_conformance", "content_type_conformance",
     "response_headers_conformance", "response_schema_conformance", "allow_header_conformance"]
)  # fmt: skip
MATRIX = "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 1.0\n2 2 2.0\n"


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedClient]:
    """Jobs that take long are not what this is about."""
    folder = tmp_path_factory.mktemp("schemathesis")
    with serving(folder, SHIPPED, job_seconds=1.0, queue_limit=100_000) as client:
        yield client


@pytest.fixture(scope="module")
def known(service: ServedClient) -> dict[str, str]:
    """An id of everything that has one."""
    body = {"scene": "two-dof", "variables": {"damper.N0": [20, 1000]}}
    job = service.post("/v1/designs", json=body, headers={"Prefer": "wait=60"}).json()
    upload = service.post("/v1/uploads", params={"name": "a.mtx"}, content=MATRIX).json()
    project = service.post("/v1/projects", json={"name": "known"}).json()
    return {"job_id": job["id"], "design_id": job["id"], "sweep_id": job["sweeps"][0]["id"],
            "upload_id": upload["id"], "name": "two-dof", "project_id": project["id"],
            "share_id": "none"}  # fmt: skip


def check(case: Any, url: str) -> None:
    case.validate_response(case.call(base_url=url, timeout=120.0), checks=CHECKS)


def run(service: ServedClient, known: dict[str, str], examples: int) -> int:
    """Every operation, with bodies and parameters by the description and against it; how many requests."""
    url = str(service.base_url).rstrip("/")
    sent = 0
    for found in schemathesis.openapi.from_url(f"{url}/openapi.json").get_all_operations():
        operation = found.ok()
        if operation.path.endswith("/events"):
            continue  # a stream has no end that could be checked
        if operation.method == "get" and "{" in operation.path:
            check(operation.Case(path_parameters=known), url)
        for mode in GenerationMode.POSITIVE, GenerationMode.NEGATIVE:
            if mode is GenerationMode.NEGATIVE and not (operation.body or operation.query):
                continue

            @settings(
                max_examples=examples, deadline=None, database=None, derandomize=True,
                suppress_health_check=list(HealthCheck), phases=[Phase.generate],
            )  # fmt: skip
            @given(case=operation.as_strategy(generation_mode=mode))
            def attempt(case: Any) -> None:
                nonlocal sent
                sent += 1
                check(case, url)

            attempt()
    return sent


def test_no_answer_is_an_error_of_the_program_or_out_of_its_form(
    service: ServedClient, known: dict[str, str]
) -> None:
    assert run(service, known, 1) > 40
    assert service.get("/health/ready").json()["ready"]


@pytest.mark.long
def test_thousands_of_requests(service: ServedClient, known: dict[str, str]) -> None:
    assert run(service, known, 30) > 500
    assert service.get("/health/ready").json()["ready"]
    assert threading.active_count() < 100
