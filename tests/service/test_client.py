"""The client: every route, typed; a connection that fails is made again without doing anything twice."""

import io
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pyarrow.parquet as pq
import pytest
from matrix_cases import beam
from service_helpers import ServedClient

import solver
from service.client.client import Client
from service.db.models import JobState
from service.errors import ServiceProblem
from service.schemas.answers import FinishedJob, JobAnswer, JobPoints, JobProgress

SLOW = {"kind": "iteration", "seconds": 60.0, "fresh": True}


@pytest.fixture
def client(http: ServedClient) -> Iterator[Client]:
    with Client(str(http.base_url)) as client:
        yield client


@pytest.fixture
def shipped_client(shipped: ServedClient) -> Iterator[Client]:
    with Client(str(shipped.base_url)) as client:
        yield client


def test_jobs_and_results(client: Client) -> None:
    body = {"kind": "iteration", "seed": 4001, "sweeps": 2}
    done = client.submit(body, wait=20.0)
    assert isinstance(done, FinishedJob)
    assert done.result is not None
    assert client.results(done.id).result == done.result
    assert [sweep.job for sweep in client.sweeps(job=done.id)] == [done.id] * 2
    assert done.id in {job.id for job in client.jobs(kind="iteration", limit=3)}
    running = client.submit(SLOW)
    assert not isinstance(running, FinishedJob)
    assert client.dismiss(running.id).status is JobState.DISMISSED


def test_sweeps_designs_scenes_and_plans(shipped_client: Client) -> None:
    client = shipped_client
    assert client.health().ready
    assert "stickslip_http_requests" in client.metrics()
    body = {"scene": "two-dof", "variables": {"damper.N0": [20, 900]}, "harmonics": 3}
    design = client.submit_design(body, wait=60.0)
    assert client.design(design.id).result["optimum"]
    assert design.id in {one.id for one in client.designs(scene="two-dof")}
    sweep = client.sweep(next(client.sweeps(job=design.id)).id)
    arrays = client.sweep_arrays(sweep.id)
    assert arrays["amplitude"].tolist() == sweep.arrays["amplitude"]
    assert len(client.sweep_csv(sweep.id).splitlines()) == sweep.points + 1
    assert pq.read_table(io.BytesIO(client.sweep_parquet(sweep.id))).num_rows == sweep.points
    assert b"<svg" in client.sweep_plot(sweep.id)
    assert client.sweep_plot(sweep.id, "png").startswith(b"\x89PNG")
    assert "two-dof" in {scene.name for scene in client.scenes()}
    scene = client.scene("two-dof").scene
    assert client.store_scene({**scene, "name": "of-the-client"}).name == "of-the-client"
    assert client.plan({"scene": "two-dof"})["effects"]


def test_uploads(client: Client) -> None:
    buffer = io.BytesIO()
    np.savez(buffer, M=beam(3)[0])
    made = client.upload(buffer.getvalue(), "M.npz")
    assert made.contents[0].rows == 6
    assert client.uploaded(made.id).sha256 == made.sha256
    assert made.id in {one.id for one in client.uploads()}
    client.delete_upload(made.id)
    with pytest.raises(ServiceProblem, match="no upload") as refused:
        client.uploaded(made.id)
    assert refused.value.status == 404


@contextmanager
def breaking(http: ServedClient, breaks: Callable[[int], int | None]) -> Iterator[str]:
    """A way to the service that breaks `breaks(n)` bytes into the answer of the n-th connection, or never."""
    listener = socket.create_server(("127.0.0.1", 0))
    opened: list[socket.socket] = []
    pumps: list[threading.Thread] = []

    def pump(source: socket.socket, sink: socket.socket, most: int | None) -> None:
        try:
            while most is None or most > 0:
                data = source.recv(65536 if most is None else most)
                if not data:
                    break
                sink.sendall(data)
                most = None if most is None else most - len(data)
        except OSError:
            pass
        finally:
            for end in (source, sink):
                try:
                    end.shutdown(socket.SHUT_RDWR)
                except OSError:
                    continue

    def serve() -> None:
        number = 0
        while True:
            try:
                ours, _ = listener.accept()
            except OSError:
                return
            theirs = socket.create_connection((http.base_url.host, http.base_url.port))
            opened.extend((ours, theirs))
            for arguments in ((ours, theirs, None), (theirs, ours, breaks(number))):
                pumps.append(threading.Thread(target=pump, args=arguments, daemon=True))
                pumps[-1].start()
            number += 1

    server = threading.Thread(target=serve, daemon=True)
    server.start()
    try:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}"
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        server.join()
        listener.close()
        for thread in pumps:
            thread.join()
        for one in opened:
            one.close()


def test_a_job_is_accepted_once_however_often_it_was_sent(http: ServedClient) -> None:
    before = len(http.get("/v1/jobs", params={"kind": "iteration"}).json()["items"])
    with breaking(http, lambda n: 10 if n < 3 else None) as url, Client(url) as client:
        job = client.submit({"kind": "iteration", "seed": 4002, "fresh": True})
    after = http.get("/v1/jobs", params={"kind": "iteration"}).json()["items"]
    assert after[0]["id"] == job.id
    assert len(after) == before + 1
    with breaking(http, lambda _n: 10) as url, Client(url) as client:
        with pytest.raises(ServiceProblem) as away:
            client.job(job.id)
        assert away.value.status == 0


def test_a_broken_stream_goes_on_behind_the_last_event(http: ServedClient) -> None:
    body = {"kind": "iteration", "seconds": 2.0, "tells": True, "fresh": True}
    with breaking(http, lambda n: 9000 + 3000 * n if n in (1, 2) else None) as url, Client(url) as client:
        job = client.submit(body)
        points: list[tuple[float, float]] = []
        starts, ends, progress = [], [], []
        for event in client.events(job.id):
            match event:
                case JobPoints():
                    starts.append((event.start, len(points)))
                    points[event.start :] = event.points
                case JobProgress():
                    progress.append(event.progress)
                case JobAnswer():
                    ends.append(event.status)
    assert all(start == have for start, have in starts), "nothing twice, nothing left out"
    assert [int(value) for value, _ in points] == list(range(1, len(points) + 1))
    assert ends == [JobState.SUCCESSFUL]
    assert progress == sorted(progress)


def test_waiting_has_an_end(client: Client) -> None:
    job = client.submit(SLOW)
    seen: list[int] = []
    assert client.wait(job.id, timeout=0.5, on_points=lambda told: seen.append(told.start)).id == job.id
    assert not client.job(job.id).status.finished
    client.dismiss(job.id)
    assert client.wait(job.id).status is JobState.DISMISSED


def test_scenes_are_drawn_up_and_changed_by_the_client(shipped_client: Client) -> None:
    case = shipped_client.templates()[0]
    scene = shipped_client.scene_from(case["name"], {"name": "drawn-up"})
    assert scene["name"] == "drawn-up"
    assert set(scene) <= set(shipped_client.scenes_schema()["properties"])
    text = f"{shipped_client.scene_text({'scene': scene})}# of May\n"
    changed = shipped_client.edit_scene({"text": text, "scene": {**scene, "name": "another"}})
    assert "# of May" in changed["text"]
    assert shipped_client.read_scene(changed["text"])["scene"]["name"] == "another"


def test_a_result_comes_as_the_class_that_python_gives(shipped_client: Client) -> None:
    done = shipped_client.submit({"kind": "sweep", "scene": "two-dof", "harmonics": 1}, wait=60.0)
    branch = shipped_client.result(done.id)
    assert isinstance(branch, solver.Branch)
    assert branch.to_json() == shipped_client.results(done.id).result
