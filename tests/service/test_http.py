"""The REST API over a real server: what it answers and what it refuses."""

import json
import re
import socket
import threading
import time

import httpx
import pytest
from each import each
from service_helpers import is_problem, job_ids, promptly, until
from starlette.requests import Request

from service.client.client import Client
from service.db import revisions
from service.db.models import JobState
from service.errors import QueueFullError, ServiceProblem
from service.schemas.problems import service_problem
from solver.results.units import quantity

SLOW = {"kind": "iteration", "seconds": 60.0}


def newest(client: httpx.Client) -> dict:
    listed = client.get("/v1/jobs?limit=1").json()["items"][0]
    assert listed["request"] is None
    return client.get(listed["links"]["self"]).json()


def test_a_job_from_acceptance_to_results(http: httpx.Client) -> None:
    accepted = http.post("/v1/jobs", json={"kind": "iteration", "seconds": 0.2, "sweeps": 1})
    assert accepted.status_code == 202
    job = accepted.json()
    assert accepted.headers["location"] == job["links"]["self"] == f"/v1/jobs/{job['id']}"
    assert job["status"] in ("accepted", "running")
    assert is_problem(http.get(job["links"]["results"]), 409)["detail"].endswith("no results yet")
    until(lambda: http.get(job["links"]["self"]).json()["status"] == "successful")
    results = http.get(job["links"]["results"]).json()
    assert results["status"] == "successful"
    assert results["result"]["steps"] > 0
    sweeps = http.get(job["links"]["sweeps"]).json()
    assert sweeps["items"] == results["sweeps"]
    assert sweeps["next"] is None
    sweep = http.get(sweeps["items"][0]["links"]["self"]).json()
    assert (sweep["from"], sweep["to"]) == (1.0, 2.0)
    assert len(sweep["arrays"]["amplitude"]) == sweep["points"] == 20


def test_prefer_wait_answers_small_jobs_directly(http: httpx.Client) -> None:
    small = {"kind": "iteration", "size": 10, "sweeps": 1}
    answer = http.post("/v1/jobs", json=small, headers={"Prefer": "respond-async, wait=20"})
    assert answer.status_code == 200
    assert answer.headers["preference-applied"] == "wait=20"
    body = answer.json()
    assert body["status"] == "successful"
    assert body["result"]["eigenvalue"] > 0.0
    assert len(body["sweeps"]) == 1
    again = http.post("/v1/jobs", json=small)
    assert again.status_code == 200
    assert again.json()["result_of"] == body["id"]
    assert again.json()["result"] == body["result"]
    assert again.json()["sweeps"] == body["sweeps"]
    slow = http.post("/v1/jobs", json=SLOW, headers={"Prefer": "wait=1"})
    assert slow.status_code == 202
    assert http.delete(slow.headers["location"]).json()["status"] == "dismissed"


def test_dismiss(http: httpx.Client) -> None:
    def trial() -> float:
        job = http.post("/v1/jobs", json={**SLOW, "fresh": True}).json()
        until(lambda: http.get(job["links"]["self"]).json()["status"] == "running")
        asked = time.monotonic()
        answer = http.delete(job["links"]["self"])
        took = time.monotonic() - asked
        assert answer.status_code == 200
        assert answer.json()["status"] == "dismissed"
        is_problem(http.get(job["links"]["results"]), 409)
        return took

    promptly(trial, 1.0)
    done = http.post("/v1/jobs", json={"kind": "iteration"}, headers={"Prefer": "wait=20"}).json()
    is_problem(http.delete(done["links"]["self"]), 409)


def test_what_people_read_of_a_result_is_what_the_command_prints(shipped: httpx.Client) -> None:
    body = {"kind": "margin", "scene": "bladed-disk", "from": 20, "to": 80, "limit": 1.5e-4, "points": 3}
    done = shipped.post("/v1/jobs", json={**body, "harmonics": 3}, headers={"Prefer": "wait=60"}).json()
    head, allowed, amplitudes, _shares = shipped.get(f"{done['links']['self']}/told").json()["blocks"]
    assert head["title"] == "bladed-disk, excitation from 20 to 80 N, 3 harmonics"
    assert "time" in dict(head["pairs"])
    [one] = done["result"]["allowed"]
    row = ["as it is", quantity(one["allowed"], "N"), "tip", quantity(one["at_hz"], "Hz"), "0.15 mm"]
    assert allowed["rows"] == [row]
    assert amplitudes["title"] == "amplitude [mm]"
    [sizes] = done["result"]["stress"]
    assert [float(cell) for _, cell in amplitudes["rows"]] == pytest.approx(
        [1e3 * size for size in sizes], rel=1e-3
    )


def test_of_what_has_no_result_there_is_nothing_to_read(http: httpx.Client) -> None:
    job = http.post("/v1/jobs", json={**SLOW, "fresh": True}).json()
    is_problem(http.get(f"{job['links']['self']}/told"), 409)
    http.delete(job["links"]["self"])
    failed = http.post("/v1/jobs", json={"kind": "bad-scene"}, headers={"Prefer": "wait=20"}).json()
    told = is_problem(http.get(f"{failed['links']['self']}/told"), 409)
    assert told["type"] == "urn:stickslip:problem:job-failed"
    # Of a kind that says nothing of its results the keys are told.
    done = http.post("/v1/jobs", json={"kind": "iteration"}, headers={"Prefer": "wait=20"}).json()
    [block] = http.get(f"{done['links']['self']}/told").json()["blocks"]
    assert "eigenvalue" in dict(block["pairs"])


def test_a_failed_job_says_why(http: httpx.Client) -> None:
    answer = http.post("/v1/jobs", json={"kind": "bad-scene"}, headers={"Prefer": "wait=20"})
    assert answer.status_code == 200
    body = answer.json()
    assert body["status"] == "failed"
    assert body["result"] is None
    assert body["error"]["issues"] == [{"pointer": "/contacts/0/mu", "detail": "`mu` must be >= 0, got -0.1"}]
    problem = is_problem(http.get(body["links"]["results"]), 409)
    assert problem["type"] == "urn:stickslip:problem:job-failed"
    assert problem["errors"] == body["error"]["issues"]


def test_idempotency_key(http: httpx.Client) -> None:
    headers = {"Idempotency-Key": "one"}
    body = {"kind": "iteration", "seed": 77, "fresh": True}
    first = http.post("/v1/jobs", json=body, headers=headers).json()
    second = http.post("/v1/jobs", json=dict(reversed(body.items())), headers=headers).json()
    assert first["id"] == second["id"]
    other = http.post("/v1/jobs", json={**body, "seed": 78}, headers=headers)
    assert "used for a different request" in is_problem(other, 422)["detail"]
    bad = is_problem(http.post("/v1/jobs", json=body, headers={"Idempotency-Key": "x" * 201}), 422)
    assert bad["errors"][0]["in"] == "header"


def test_a_key_used_at_the_same_time_makes_one_job(http: httpx.Client) -> None:
    found: list[str] = []

    def submit() -> None:
        body = {"kind": "iteration", "seed": 99, "fresh": True}
        answer = httpx.post(f"{http.base_url}/v1/jobs", json=body, headers={"Idempotency-Key": "same"})
        found.append(answer.json()["id"])

    threads = [threading.Thread(target=submit) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8
    assert len(set(found)) == 1


@each(
    ("body", "pointer", "words"),
    [
        ({}, "/kind", "`kind` is missing"),
        ({"kind": "nothing"}, "/kind", "must be one of iteration, "),
        ({"kind": ["iteration"]}, "/kind", "must be one of"),
        ({"kind": "iteration", "colour": 1}, "/colour", "not a known key"),
        ({"kind": "iteration", "size": 1}, "/size", "greater than or equal to 2, got 1"),
        ({"kind": "iteration", "size": "20"}, "/size", "must be"),
        ({"kind": "iteration", "size": True}, "/size", "must be"),
        ({"kind": "iteration", "seconds": 1e9}, "/seconds", "less than or equal to 600"),
        ({"kind": "iteration", "fresh": 1}, "/fresh", "must be"),
        ({"kind": "iteration", "priority": 101}, "/priority", "less than or equal to 100"),
        ({"kind": "iteration", "a/b~c": 1}, "/a~1b~0c", "not a known key"),
    ],
)
def test_a_bad_body_is_refused_with_a_pointer(
    http: httpx.Client, body: dict, pointer: str, words: str
) -> None:
    before = job_ids(http)
    problem = is_problem(http.post("/v1/jobs", json=body), 422)
    assert problem["type"] == "urn:stickslip:problem:invalid-request"
    assert [entry["pointer"] for entry in problem["errors"]] == [pointer]
    assert words in problem["errors"][0]["detail"]
    assert job_ids(http) == before, "nothing is written of what is refused"


@pytest.mark.parametrize(
    ("text", "pointers"),
    [
        ('{"kind": "iteration", "seconds": NaN}', ["/seconds"]),
        ('{"kind": "iteration", "seconds": -Infinity}', ["/seconds"]),
        ('{"kind": "iteration", "seconds": 1e999, "list": [0, Infinity]}', ["/list/1", "/seconds"]),
    ],
)
def test_numbers_that_are_not_finite_are_refused(http: httpx.Client, text: str, pointers: list[str]) -> None:
    answer = http.post("/v1/jobs", content=text, headers={"Content-Type": "application/json"})
    problem = is_problem(answer, 422)
    assert [entry["pointer"] for entry in problem["errors"]] == pointers


@each(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b'"x"',
        b"\xff",
        b'{"kind": "iteration", "kind": "deaf"}',
        b"[" * 15_000,
        b'{"kind": ' + b"9" * 5000 + b"}",
    ],
)
def test_what_is_no_json_object_is_refused(http: httpx.Client, content: bytes) -> None:
    is_problem(http.post("/v1/jobs", content=content, headers={"Content-Type": "application/json"}), 400)


def test_other_refusals(http: httpx.Client) -> None:
    is_problem(http.get("/v2/jobs"), 404)
    is_problem(http.get("/nothing"), 404)
    is_problem(http.get("/v1/jobs/none"), 404)
    is_problem(http.delete("/v1/jobs/none"), 404)
    is_problem(http.get("/v1/jobs/none/results"), 404)
    is_problem(http.get("/v1/sweeps/none"), 404)
    is_problem(http.get("/v1/scenes/none"), 404)
    put = http.put("/v1/jobs", json={})
    assert is_problem(put, 405)["detail"] == "PUT is not possible at /v1/jobs, use GET, HEAD, POST"
    assert put.headers["allow"] == "GET, HEAD, POST"
    assert http.delete("/v1/scenes/read").headers["allow"] == "POST"
    kind = is_problem(http.post("/v1/jobs", json={"kind": "k" * 10_000}), 422)
    assert len(kind["detail"]) < 1000
    form = http.post("/v1/jobs", data={"kind": "iteration"})
    assert "application/json" in is_problem(form, 415)["detail"]
    is_problem(http.post("/v1/designs", json={"kind": "iteration"}), 422)
    limit = is_problem(http.get("/v1/jobs?limit=0"), 422)
    assert (limit["errors"][0]["in"], limit["errors"][0]["pointer"]) == ("query", "/limit")
    is_problem(http.get("/v1/jobs?colour=red"), 422)
    is_problem(http.get("/v1/jobs?status=lost"), 422)
    is_problem(http.get("/v1/jobs?cursor=abc"), 422)
    is_problem(http.get("/health/ready", headers={"Host": "evil.example"}), 421)


def test_a_body_that_is_too_large(http: httpx.Client) -> None:
    large = json.dumps({"kind": "iteration", "x": "y" * 30_000}).encode()
    headers = {"Content-Type": "application/json"}
    is_problem(http.post("/v1/jobs", content=large, headers=headers), 413)
    chunks = (large[at : at + 1000] for at in range(0, len(large), 1000))
    is_problem(http.post("/v1/jobs", content=chunks, headers=headers), 413)


def test_pages_of_jobs_show_each_once(http: httpx.Client) -> None:
    made = [http.post("/v1/jobs", json={"kind": "threads", "seed": n}).json()["id"] for n in range(7)]
    seen: list[str] = []
    page = http.get("/v1/jobs?kind=threads&limit=3").json()
    added = http.post("/v1/jobs", json={"kind": "threads", "seed": 8}).json()["id"]
    while True:
        seen += [job["id"] for job in page["items"]]
        if page["next"] is None:
            break
        page = http.get(page["next"]).json()
    assert seen == made[::-1]
    assert http.get("/v1/jobs?kind=threads&limit=1").json()["items"][0]["id"] == added
    until(lambda: not http.get("/v1/jobs?kind=threads&status=accepted").json()["items"])
    assert http.get("/v1/jobs?scene=matrix&limit=1").json()["items"]
    assert not http.get("/v1/jobs?scene=other").json()["items"]


def test_health_and_description(http: httpx.Client) -> None:
    assert http.get("/health/live").json() == {"status": "live"}
    health = http.get("/health/ready").json()
    assert health["ready"]
    assert (health["workers"], health["workers_ready"]) == (1, 1)
    assert health["revision"] == revisions.head_revision()
    assert health["database_version"].count(".") == 2


def test_scenes(http: httpx.Client) -> None:
    listed = {scene["name"]: scene for scene in http.get("/v1/scenes").json()["items"]}
    assert listed["two-dof"]["shipped"]
    assert (
        listed["two-dof"]["title"]
        == "Two masses in a chain, a friction damper from the second to the ground."
    )
    assert all(0 < len(one["title"]) < 110 for one in listed.values() if one["shipped"])
    scene = http.get("/v1/scenes/two-dof").json()["scene"]
    whole, drawn = (http.get("/v1/scenes/fe-disk", params={"files": files}) for files in (True, False))
    left_out = whole.json()["scene"]["structure"].keys() - drawn.json()["scene"]["structure"].keys()
    assert "diameters" in left_out
    assert len(drawn.content) < 0.01 * len(whole.content)
    is_problem(http.get("/v1/scenes/..%2Ftwo-dof"), 404)
    same = http.post("/v1/scenes", json=scene)
    assert same.status_code == 200
    changed = {**scene, "observe": {**scene["observe"], "band": [1.0, 2.0]}}
    assert (
        "shipped under the name 'two-dof'" in is_problem(http.post("/v1/scenes", json=changed), 409)["detail"]
    )
    mine = http.post("/v1/scenes", json={**changed, "name": "mine"})
    assert mine.status_code == 201
    assert http.get(mine.headers["location"]).json()["scene"]["observe"]["band"] == [1.0, 2.0]
    assert http.post("/v1/scenes", json={**changed, "name": "mine"}).status_code == 200
    is_problem(http.post("/v1/scenes", json={**scene, "name": "mine"}), 409)
    bad = {**scene, "name": "bad", "contacts": [{**scene["contacts"][0], "mu": -0.1, "colour": "red"}]}
    problem = is_problem(http.post("/v1/scenes", json=bad), 422)
    assert {"/contacts/0/mu", "/contacts/0/colour"} == {entry["pointer"] for entry in problem["errors"]}
    assert "bad" not in {scene["name"] for scene in http.get("/v1/scenes").json()["items"]}


def test_the_client_speaks_all_of_it(http: httpx.Client) -> None:
    with Client(str(http.base_url)) as client:
        seen: list[float] = []
        job = client.submit(
            {"kind": "iteration", "seconds": 0.4, "seed": 5, "sweeps": 3}, idempotency_key="c"
        )
        done = client.wait(job.id, on_progress=lambda fraction, _points: seen.append(fraction))
        assert done.status is JobState.SUCCESSFUL
        assert seen == sorted(seen)
        assert len(client.results(job.id).sweeps) == 3
        listed = list(client.sweeps(job=job.id, limit=2, sort="peak", completed=True))
        assert [s.peak.value for s in listed] == sorted(s.peak.value for s in listed)
        assert len(listed) == 3
        assert len(client.sweep(listed[0].id).arrays["parameter"]) == 20
        slow = client.submit({**SLOW, "seed": 6})
        assert client.wait(slow.id, timeout=0.0).status is not JobState.SUCCESSFUL
        assert client.dismiss(slow.id).status is JobState.DISMISSED
        with pytest.raises(ServiceProblem, match="no job 'a b'") as refused:
            client.job("a b")
        assert refused.value.status == 404
    with Client("http://127.0.0.1:9", timeout=1.0) as client, pytest.raises(ServiceProblem) as refused:
        client.job("x")
    assert refused.value.status == 0


def test_a_client_that_leaves_while_it_waits_harms_nothing(http: httpx.Client) -> None:
    body = json.dumps({**SLOW, "seed": 9}).encode()
    with socket.create_connection((http.base_url.host, http.base_url.port)) as raw:
        raw.sendall(
            b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            b"Prefer: wait=30\r\nContent-Length: %d\r\n\r\n" % len(body) + body
        )
        until(lambda: newest(http)["request"].get("seed") == 9)
    job = newest(http)
    assert http.delete(job["links"]["self"]).json()["status"] == "dismissed"


def test_an_error_of_the_program_is_a_problem_with_a_reference(http: httpx.Client) -> None:
    problem = is_problem(http.post("/v1/jobs", json={"kind": "confused"}), 500)
    assert "mistake" not in str(problem)
    assert re.search(r"under [0-9a-f]{12}$", problem["detail"])


def test_answers_are_not_held_back(http: httpx.Client) -> None:
    """Nagle's algorithm and delayed acknowledgements together would cost each one 40 ms."""

    def trial() -> float:
        begin = time.perf_counter()
        http.get("/health/live")
        return time.perf_counter() - begin

    promptly(trial, 0.03, tries=200)


def test_a_full_queue_says_when_to_come_back() -> None:
    request = Request(
        {"type": "http", "method": "POST", "path": "/v1/jobs", "headers": [], "server": ("a", 1)}
    )
    answer = service_problem(request, QueueFullError("2 jobs wait already", retry_after=10))
    assert (answer.status_code, answer.headers["retry-after"]) == (503, "10")
