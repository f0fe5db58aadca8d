"""Jobs as server-sent events, over a real server and from a service beside the one that runs them."""

import asyncio
import json
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import httpx
from postgresql_cluster import Cluster
from private_kinds import PRIVATE
from service_helpers import PATIENCE, is_problem, serving, settings_of, until

from service.auth.callers import KEYLESS
from service.http.routes.events import job_events
from service.queue.core import Service

SLOW = {"kind": "iteration", "seconds": 60.0, "fresh": True}


def parsed(lines: Iterable[str]) -> Iterator[dict]:
    """Events of a stream, by the rules of the HTML standard; comments as `comment`."""
    event: dict = {}
    for line in lines:
        if not line:
            if event:
                yield event
            event = {}
            continue
        name, _, value = line.partition(": ") if not line.startswith(":") else ("comment", "", line[2:])
        event[name] = json.loads(value) if name == "data" else value


def follow(client: httpx.Client, job: str, **headers: str) -> list[dict]:
    with client.stream("GET", f"/v1/jobs/{job}/events", headers=headers) as answer:
        assert answer.status_code == 200
        assert answer.headers["content-type"].partition(";")[0] == "text/event-stream"
        assert answer.headers["cache-control"] == "no-cache"
        return list(parsed(answer.iter_lines()))


def test_a_job_is_followed_to_its_end(http: httpx.Client) -> None:
    job = http.post(
        "/v1/jobs", json={"kind": "iteration", "seconds": 1.0, "tells": True, "fresh": True}
    ).json()
    begin = time.monotonic()
    events = follow(http, job["id"])
    elapsed = time.monotonic() - begin
    assert int(events[0]["retry"]) > 0
    named = [event for event in events if "event" in event]
    assert named[-1]["event"] == "end"
    assert named[-1]["data"] == http.get(f"/v1/jobs/{job['id']}").json()
    progress = [event["data"] for event in named if event["event"] == "progress"]
    running = [told for told in progress if told["status"] == "running"]
    assert 3 <= len(running) <= 10 * elapsed + 2, "ten a second at most"
    assert [told["progress"] for told in running] == sorted(told["progress"] for told in running)
    assert running[-1]["attempt"] == 1
    best = [told["best"]["values"]["step"] for told in running if told["best"] is not None]
    assert len(best) >= 2
    assert best == sorted(best), "the best so far goes with the progress"
    partial = [event["data"] for event in named if event["event"] == "partial"]
    points = [point for told in partial for point in told["points"]]
    assert [told["start"] for told in partial] == [
        sum(len(told["points"]) for told in partial[:n]) for n in range(len(partial))
    ]
    assert [int(value) for value, _ in points] == list(range(1, len(points) + 1))
    assert len(points) >= running[-1]["points"]


def test_a_broken_connection_goes_on_where_it_ended(http: httpx.Client) -> None:
    job = http.post("/v1/jobs", json={**SLOW, "tells": True}).json()["id"]
    with http.stream("GET", f"/v1/jobs/{job}/events") as answer:
        first = next(event for event in parsed(answer.iter_lines()) if event.get("event") == "partial")
    have = len(first["data"]["points"])

    def next_partial(last: str) -> dict:
        with http.stream("GET", f"/v1/jobs/{job}/events", headers={"Last-Event-ID": last}) as answer:
            events = parsed(answer.iter_lines())
            return next(event["data"] for event in events if event.get("event") == "partial")

    assert next_partial(first["id"])["start"] == have
    for unknown in ("00000000.5", "x", "0.0", "a" * 150, "end"):
        assert next_partial(unknown)["start"] == 0
    assert http.delete(f"/v1/jobs/{job}").json()["status"] == "dismissed"
    again = http.get(f"/v1/jobs/{job}/events", headers={"Last-Event-ID": "end"})
    assert (again.status_code, again.content) == (204, b"")
    ended = follow(http, job)[-1]["data"]
    assert ended["status"] == "dismissed"
    assert ended["best"]["values"]["step"] > 0.0, "of a search that was stopped the best is kept"


def test_refusals(http: httpx.Client) -> None:
    is_problem(http.get("/v1/jobs/none/events"), 404)
    is_problem(http.get("/v1/jobs/none/events", headers={"Last-Event-ID": "a" * 201}), 422)


def test_the_points_of_a_sweep_arrive_while_it_is_computed(http: httpx.Client, tmp_path: Path) -> None:
    scene = http.get("/v1/scenes/two-dof").json()["scene"]
    body = {"kind": "held-sweep", "scene": scene, "from": 0.05, "to": 20.0, "fresh": True}
    job = http.post("/v1/jobs", json={**body, "until": str(tmp_path / "seen")}).json()["id"]
    points: list[list[float]] = []
    with http.stream("GET", f"/v1/jobs/{job}/events") as answer:
        for event in parsed(answer.iter_lines()):
            points += event["data"]["points"] if event.get("event") == "partial" else []
            if len(points) >= 64:
                (tmp_path / "seen").touch()
    sweep = http.get(f"/v1/jobs/{job}/results").json()["sweeps"][0]
    arrays = http.get(sweep["links"]["self"]).json()["arrays"]
    known = list(map(list, zip(arrays["parameter"], arrays["amplitude"], strict=True)))
    # The finished branch has the points that were told, in their order, and those put between.
    rest = iter(known)
    assert all(point in rest for point in points)
    assert len(points) >= 64


def test_streams_hold_no_threads_and_do_not_hold_a_shutdown(tmp_path: Path) -> None:
    ended = []

    async def watch(url: str, job: str, count: int, started: threading.Event) -> None:
        limits = httpx.Limits(max_connections=None)
        async with httpx.AsyncClient(base_url=url, timeout=PATIENCE, limits=limits) as client:
            open_streams = 0

            async def one() -> None:
                nonlocal open_streams
                async with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
                    async for line in answer.aiter_lines():
                        if line.startswith("event: progress") and not started.is_set():
                            open_streams += 1
                            if open_streams >= count:
                                started.set()
                ended.append(time.monotonic())

            await asyncio.gather(*(one() for _ in range(count)))

    # Streams that nobody sends home end with the job, or are cut when the time of open requests is over.
    with serving(tmp_path, PRIVATE, shutdown_seconds=60.0) as client:
        job = client.post("/v1/jobs", json={**SLOW, "seconds": 600.0}).json()["id"]
        before = threading.active_count()
        started = threading.Event()
        watcher = threading.Thread(
            target=lambda: asyncio.run(watch(str(client.base_url), job, 120, started)), daemon=True
        )
        watcher.start()
        assert started.wait(PATIENCE)
        assert threading.active_count() - before <= 42, "40 short reads at a time, and the watcher"
        begin = time.monotonic()
    assert time.monotonic() - begin < 30.0
    watcher.join(PATIENCE)
    assert len(ended) == 120


def test_a_silent_job_has_a_heartbeat_and_a_client_that_leaves_is_forgotten(tmp_path: Path) -> None:
    with serving(tmp_path, PRIVATE, heartbeat_seconds=0.1) as client:
        first = client.post("/v1/jobs", json=SLOW).json()["id"]
        waiting = client.post("/v1/jobs", json=SLOW).json()["id"]
        with client.stream("GET", f"/v1/jobs/{waiting}/events") as answer:
            comments = (event for event in parsed(answer.iter_lines()) if "comment" in event)
            assert [next(comments)["comment"] for _ in range(3)][1:] == ["still here"] * 2
        until(lambda: not client.service.waiters._listeners)
        for job in (waiting, first):
            client.delete(f"/v1/jobs/{job}")


def test_a_job_of_another_service_is_followed_by_its_row(cluster: Cluster) -> None:
    with cluster.database(empty=False) as url:
        other = Service(settings_of(url)(), PRIVATE)
        here = Service(settings_of(url)(), PRIVATE)
        other.start()
        here.open()
        try:
            row, _ = other.submit({"kind": "iteration", "seconds": 600.0})

            async def told() -> list[str]:
                names: list[str] = []
                async for event in job_events(here, row.id, KEYLESS):
                    if event.event is None:
                        continue
                    names.append(event.event)
                    if len(names) == 3:
                        other.dismiss(row.id)
                return names

            names = asyncio.run(told())
            assert set(names[:-1]) == {"progress"}
            assert len(names) > 3
            assert names[-1] == "end"
        finally:
            other.stop()
            here.database.close()
