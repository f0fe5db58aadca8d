"""`/metrics`: requests by route, jobs and workers, in the format monitors read."""

import httpx
from prometheus_client.parser import text_string_to_metric_families
from service_helpers import until

from service.queue.meters import OTHERS, Refusals


def numbers(http: httpx.Client) -> dict[tuple[str, tuple[tuple[str, str], ...]], float]:
    answer = http.get("/metrics")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/plain; version=0.0.4")
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def requests(found: dict, method: str, route: str, status: str) -> float:
    labels = (("method", method), ("route", route), ("status", status))
    return found.get(("stickslip_http_requests_total", labels), 0.0)


def test_requests_are_counted_by_route_and_status(http: httpx.Client) -> None:
    before = numbers(http)
    for name in ("nobody-1", "nobody-2"):
        assert http.get(f"/v1/jobs/{name}").status_code == 404
    assert http.get("/no/such/page").status_code == 404
    assert http.request("BREW", "/v1/jobs").status_code == 405
    after = numbers(http)

    def more(method: str, route: str, status: str) -> float:
        return requests(after, method, route, status) - requests(before, method, route, status)

    assert more("GET", "/v1/jobs/{job_id}", "404") == 2.0
    assert more("GET", "none", "404") == 1.0
    assert sum(more("other", route, "405") for route in ("none", "/v1/jobs")) == 1.0
    assert more("GET", "/metrics", "200") == 1.0
    # No id ever becomes a label.
    assert not any("nobody" in str(key) for key in after)


def test_jobs_and_workers_are_those_of_the_service(http: httpx.Client) -> None:
    found = numbers(http)
    ready = http.get("/health/ready").json()
    for state, count in ready["jobs"].items():
        assert found["stickslip_jobs", (("state", state),)] == count
    assert found["stickslip_workers", (("state", "wanted"),)] == ready["workers"]
    assert found["stickslip_database_up", ()] == 1.0
    assert found["stickslip_queue_up", ()] == 1.0


def test_times_add_up(http: httpx.Client) -> None:
    http.get("/health/live")
    found = numbers(http)
    labels = (("method", "GET"), ("route", "/health/live"))
    count = found["stickslip_http_request_seconds_count", labels]
    assert count >= 1.0
    assert found["stickslip_http_request_seconds_bucket", (("le", "+Inf"), *labels)] == count
    assert 0.0 < found["stickslip_http_request_seconds_sum", labels] < 60.0 * count


def test_jobs_are_timed_by_kind_and_lanes_by_name(http: httpx.Client) -> None:
    def more(name: str, **labels: str) -> float:
        key = (name, tuple(sorted(labels.items())))
        return numbers(http).get(key, 0.0) - before.get(key, 0.0)

    before = numbers(http)
    body = {"kind": "iteration", "size": 5, "fresh": True}
    answer = http.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"})
    assert answer.status_code == 200
    until(lambda: more("stickslip_job_run_seconds_count", kind="iteration", outcome="finished") == 1.0)
    assert more("stickslip_job_wait_seconds_count", kind="iteration") == 1.0
    assert more("stickslip_lane_wait_seconds_count", lane="writes") >= 1.0
    assert before["stickslip_oldest_waiting_seconds", ()] >= 0.0


def test_refusals_are_counted_of_the_busiest_owners_by_name() -> None:
    """No series ever falls, and the sum is that of all refusals, whoever comes to the front."""
    refused, seen = Refusals(shown=2, ranked=6), dict[tuple[str, str], float]()
    owners = ["a"] * 3 + ["b"] * 2 + ["c"] * 9 + [f"once {k}" for k in range(20)] + ["a"] * 20 + ["c"]
    for number, owner in enumerate(owners, 1):
        refused.count(owner, 429 if number % 3 else 503)
        [family] = refused.collect()
        found = {(one.labels["owner"], one.labels["status"]): one.value for one in family.samples}
        named = {owner for owner, _ in found} - {OTHERS}
        assert len(named) <= 2
        assert sum(found.values()) == number
        assert all(found[key] >= value for key, value in seen.items() if key in found)
        seen = found
    assert named == {"a", "c"}
