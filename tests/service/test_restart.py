"""Nothing that was accepted is lost, however the service ends."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest
from launch import answers, free_port
from service_helpers import PATIENCE, is_problem, pids, until

import solver
from service.client.client import Client
from service.db.engine import Database
from service.db.models import JobState
from service.db.repositories import JobRepository
from solver.scene.scene import Scene

SCRIPT = Path(__file__).with_name("serve_private.py")


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def client(port: int) -> Iterator[Client]:
    with Client(f"http://127.0.0.1:{port}") as client:
        yield client


Start = Callable[..., "subprocess.Popen[bytes]"]


@pytest.fixture
def start(tmp_path: Path, port: int) -> Iterator[Start]:
    """Starts services on one database, or who works for none; what they log is shown if the test fails."""
    started: list[subprocess.Popen[bytes]] = []
    log = tmp_path / "log"

    def begin(what: object = port) -> subprocess.Popen[bytes]:
        with log.open("ab") as stderr:
            command = [sys.executable, str(SCRIPT), f"sqlite:///{tmp_path}/jobs.db", str(what), "1"]
            started.append(subprocess.Popen(command, stderr=stderr))
        if what == port:
            until(lambda: answers(port))
        return started[-1]

    yield begin
    for process in started:
        process.kill()
        process.wait()
    sys.stderr.write(log.read_text())


def alive(pid: int) -> bool:
    """Whether the process runs; one that ended and was not collected yet does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):  # it was there when the file was opened
        return False


@pytest.mark.long
def test_a_service_killed_loses_nothing_and_leaves_no_worker(
    tmp_path: Path, client: Client, start: Start
) -> None:
    file = tmp_path / "pids"
    process = start()
    specs = [{"kind": "iteration", "seconds": 0.5, "seed": n, "pid_file": str(file)} for n in range(4)]
    jobs = [client.submit(spec).id for spec in specs]
    until(lambda: pids(file))
    process.kill()
    process.wait()
    until(lambda: not any(alive(pid) for pid in pids(file)))

    process = start()
    done = [client.wait(job, timeout=PATIENCE) for job in jobs]
    assert [job.status for job in done] == [JobState.SUCCESSFUL] * 4
    assert max(job.attempt for job in done) == 2
    assert sum(job.attempt for job in done) == len(pids(file)), "each attempt is counted, none is made twice"
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 0


@pytest.mark.long
def test_a_service_that_is_stopped_ends_what_does_not_heed_and_goes_on_with_it_later(
    tmp_path: Path, client: Client, start: Start
) -> None:
    file = tmp_path / "pids"
    process = start()
    running = client.submit({"kind": "deaf", "seconds": 600.0, "pid_file": str(file)}).id
    until(lambda: pids(file))
    process.terminate()
    assert process.wait(PATIENCE) == 0, "it does not wait for what takes 600 s"
    assert not any(alive(pid) for pid in pids(file))

    process = start()
    until(lambda: client.job(running).status is JobState.RUNNING)
    assert client.job(running).attempt == 1, "an orderly stop costs no attempt"
    assert client.dismiss(running).status is JobState.DISMISSED
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 0


@pytest.mark.long
def test_workers_that_get_the_same_sigterm_as_their_service_cost_no_attempt(
    tmp_path: Path, client: Client, start: Start
) -> None:
    """As when an init system ends everything in a service's control group at once."""
    file = tmp_path / "pids"
    process = start()
    job = client.submit({"kind": "iteration", "seconds": 1.0, "pid_file": str(file)}).id
    until(lambda: pids(file))
    for pid in (*pids(file), process.pid):
        os.kill(pid, signal.SIGTERM)
    assert process.wait(PATIENCE) == 0

    worked = start("work")
    assert worked.wait(PATIENCE) == 0, "until nothing waits"
    database = Database(f"sqlite:///{tmp_path}/jobs.db")
    done = JobRepository(database).get(job)
    database.close()
    assert done is not None
    assert (done.state, done.attempt) == (JobState.SUCCESSFUL, 1)


@pytest.mark.long
@pytest.mark.parametrize(
    "ends",
    [
        (signal.SIGKILL,),
        pytest.param((signal.SIGTERM, signal.SIGKILL, signal.SIGINT), marks=pytest.mark.long),
    ],
)
def test_a_long_sweep_goes_on_after_every_way_to_end_a_service(
    ends: tuple[signal.Signals, ...],
    client: Client,
    start: Start,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("STICKSLIP_CHECKPOINT_SECONDS", "0.05")
    disk = solver.annulus(solver.load_scene("bladed-disk")).to_dict()
    body = {"scene": disk, "from": 650, "to": 750, "harmonics": 13}
    process = start()
    job = client.submit({**body, "kind": "slow-sweep"}).id
    for number in ends:
        known = client.job(job).progress
        until(lambda far=known: client.job(job).progress > far + 0.1)
        reached = client.job(job).progress
        process.send_signal(number)
        process.wait(PATIENCE)
        process = start()
        assert client.job(job).progress > 0.5 * reached, "what was computed is not lost"
    done = client.wait(job, timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.SUCCESSFUL, 2), "a kill costs an attempt"
    branch = solver.sweep(Scene.from_dict(disk), start=650.0, stop=750.0, harmonics=13)
    result = client.results(job).result
    assert result["parameter"] == branch.values.tolist()
    assert result["peak"] == pytest.approx(
        {"value": branch.peak.value, "at": branch.peak.at} if branch.peak else None, rel=1e-9
    )
    process.terminate()
    assert process.wait(PATIENCE) == 0


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_stop_waits_for_nobody(
    port: int, start: Start, client: Client, number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Open streams and waiting requests are sent home, clients that do nothing are left behind."""
    for name, seconds in {"SHUTDOWN": 3, "HEADER": 600, "BODY": 600, "MAX_WAIT": 600}.items():
        monkeypatch.setenv(f"STICKSLIP_{name}_SECONDS", str(seconds))
    process = start()
    job = client.submit({"kind": "iteration", "seconds": 600.0}).id
    until(lambda: client.job(job).status is JobState.RUNNING)
    address = f"http://127.0.0.1:{port}"
    ended: dict[str, float] = {}
    began = threading.Barrier(4)

    def follow(name: str) -> None:
        with httpx.stream("GET", f"{address}/v1/jobs/{job}/events", timeout=PATIENCE) as response:
            lines = response.iter_lines()
            next(lines)
            began.wait()
            for _ in lines:
                pass
        ended[name] = time.monotonic()

    def wait() -> None:
        began.wait()
        body = {"kind": "iteration", "seconds": 600.0, "seed": 1}
        answer = httpx.post(f"{address}/v1/jobs", json=body, headers={"Prefer": "wait=600"}, timeout=PATIENCE)
        assert answer.status_code == 202, "it is told where its job is"
        ended["waiting"] = time.monotonic()

    threads = [threading.Thread(target=follow, args=(name,)) for name in ("one", "two")]
    threads.append(threading.Thread(target=wait))
    for thread in threads:
        thread.start()
    half_said = [
        b"GET /v1/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\n",
        b"POST /v1/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
        b"Content-Length: 1000\r\n\r\n{",
        b"",
    ]
    sockets = [socket.create_connection(("127.0.0.1", port)) for _ in half_said]
    for one, text in zip(sockets, half_said, strict=True):
        one.sendall(text)
    began.wait()
    until(lambda: len(list(client.jobs())) == 2)  # the request that waits is known to the service
    asked = time.monotonic()
    process.send_signal(number)
    assert process.wait(PATIENCE) == 0, "nobody is waited for for 600 s"
    for thread in threads:
        thread.join(PATIENCE)
    for one in sockets:
        one.close()
    assert set(ended) == {"one", "two", "waiting"}
    assert max(ended.values()) - asked < 3.0, "who waits is sent home at once, not after 3 s"


@pytest.mark.long
def test_what_the_end_of_a_service_interrupts_is_answered_503_and_can_be_repeated(
    port: int, client: Client, start: Start
) -> None:
    """The first submission waits for the workers to come up; the service is told to stop meanwhile."""
    found: list[httpx.Response] = []
    headers = {"Idempotency-Key": "once"}

    def submit() -> None:
        body = {"kind": "iteration", "seconds": 0.0, "seed": 1}
        # Nothing is promised to who comes when the service takes no connections any more.
        with contextlib.suppress(httpx.ConnectError):
            found.append(
                httpx.post(f"http://127.0.0.1:{port}/v1/jobs", json=body, headers=headers, timeout=PATIENCE)
            )

    process = start()
    thread = threading.Thread(target=submit)
    thread.start()
    time.sleep(0.1)
    process.terminate()
    thread.join()
    assert process.wait(PATIENCE) == 0
    written = [answer for answer in found if answer.status_code == 202]  # in time
    if found and not written:
        assert is_problem(found[0], 503)["type"].endswith("stopping")
        assert int(found[0].headers["retry-after"]) >= 1
    start()
    submit()
    assert found[-1].status_code == (200 if written else 202)
    client.wait(found[-1].json()["id"])
    assert len(list(client.jobs())) == 1
