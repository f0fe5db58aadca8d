"""`/metrics`: requests by route, jobs and workers, in the format monitors read."""

import httpx
from prometheus_client.parser import text_string_to_metric_families


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
