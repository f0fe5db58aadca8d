"""A service whose kernels are not compiled yet answers at once, and goes over to them later."""

import asyncio
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from launch import COMMAND, answers, free_port
from private_kinds import PRIVATE
from service_helpers import PATIENCE, MakeSettings, until
from test_executor import fork_servers
from test_previews import WaitRequest, _resolve

from service.http.app import create_app
from service.http.middleware.connections import Connections
from service.http.server import _bind, _config, _Opening, _Server
from service.jobs.kind_registry import JobKind, Registry
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.queue.core import FIRST_KERNELS, Compiler
from service.queue.health import Part, readiness
from service.workers import processes
from service.workers.warm_pool import Previews
from solver.jit import compiler_process
from solver.jit.folder import folder


def tell_way(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    import os

    return JobOutput(result={"interprets": compiler_process.interprets(), "process": os.getpid()})


def begins() -> None:
    compiler_process.interpret()


KINDS = Registry(
    [JobKind(name="way", summary="way", request=WaitRequest, resolve=_resolve, run=tell_way)], begins
)


def told(previews: Previews) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(asyncio.run(previews.compute("way", {"seconds": 0.0})))
    return found


def test_previews_begin_interpreted_and_go_over_to_compiled_kernels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(compiler_process.SETTING, raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    # From nothing: what others are forked off would look for the kernels that nobody compiled.
    monkeypatch.setattr(processes, "_settings_of_the_first", {"of": "another time"})
    folder.cache_clear()
    previews = Previews(1.0, KINDS, workers=1)
    try:
        first = told(previews)
        assert first["interprets"]
        assert previews._seconds > 1.0
        compiler_process.compiled(compiler_process.Stage.FIRST)
        previews.renew()
        second = told(previews)
        assert not second["interprets"]
        assert second["process"] != first["process"]
        assert previews._seconds == 1.0
    finally:
        previews.close()
        folder.cache_clear()


@pytest.fixture
def uncompiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A folder of kernels without any."""
    monkeypatch.delenv(compiler_process.SETTING, raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    folder.cache_clear()
    yield
    folder.cache_clear()


def begun(compiling: bool, ready: int, workers: int = 2) -> Any:
    status = SimpleNamespace(ready=ready, workers=workers)
    return SimpleNamespace(
        compiling=compiling, compiler=Compiler(), settings=SimpleNamespace(least_free_bytes=0),
        database=SimpleNamespace(trouble=lambda _: None), previews=SimpleNamespace(ready=ready),
        queue=SimpleNamespace(alive=True, status=lambda: status),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("compiling", "ready", "states"),
    [
        (False, 0, ["ready", "waits", "waits", "waits"]),
        (True, 0, ["ready", "compiles", "waits", "waits"]),
        (False, 1, ["ready", "ready", "waits", "ready"]),
        (False, 2, ["ready", "ready", "ready", "ready"]),
    ],
)
@pytest.mark.usefixtures("uncompiled")
def test_readiness_says_what_is_being_started(compiling: bool, ready: int, states: list[str]) -> None:
    found = readiness(begun(compiling, ready))
    assert found.ready is (compiling or ready > 0)
    assert ("compiled" in (found.starting or "")) is compiling
    assert [part.name for part in found.parts] == ["Service and store", "Worker 1", "Worker 2", "Live curves"]
    assert [part.state for part in found.parts] == states


@pytest.mark.parametrize(("ready", "state"), [(15, "waits"), (16, "ready")])
def test_many_workers_are_one_part(ready: int, state: str) -> None:
    _, workers, _ = readiness(begun(False, ready, 16)).parts
    assert (workers.name, workers.state) == ("16 workers", state)


@pytest.mark.usefixtures("uncompiled")
def test_how_long_the_compiler_takes_follows_from_what_it_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr("service.queue.core.time.monotonic", lambda: now)
    service = begun(True, 0)

    def worker() -> Part:
        return readiness(service).parts[1]

    assert (worker().done, worker().of, worker().seconds_left) == (0, FIRST_KERNELS, None)
    compiler_process.note(10, 14)
    assert worker().seconds_left is None, "no pace is seen yet"
    now = 120.0
    compiler_process.note(30, 44)
    assert worker().seconds_left == pytest.approx(FIRST_KERNELS - 30)  # one a second
    compiler_process.note(FIRST_KERNELS + 5, FIRST_KERNELS + 10)
    assert worker().of == FIRST_KERNELS + 10
    compiler_process.note(FIRST_KERNELS + 10, FIRST_KERNELS + 10)
    assert worker().seconds_left is None, "whether more are found is not known"


def test_a_server_lives_while_its_service_is_loaded(make_settings: MakeSettings) -> None:
    settings, go_on = make_settings(), threading.Event()

    def load(connections: Connections) -> FastAPI:
        assert go_on.wait(PATIENCE)
        return create_app(settings, PRIVATE, connections)

    opening = _Opening(settings, load, lambda: None)
    server, listener = _Server(_config(opening, settings), opening), _bind(settings)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    end = time.monotonic() + PATIENCE
    while not server.started and time.monotonic() < end:
        time.sleep(0.01)
    try:
        with httpx.Client(base_url=f"http://localhost:{listener.getsockname()[1]}") as client:
            assert client.get("/health/live", timeout=PATIENCE).json() == {"status": "live"}
            with pytest.raises(httpx.ReadTimeout):
                client.get("/v1/kinds", timeout=0.3)
            asked: list[int] = []
            waiting = threading.Thread(
                target=lambda: asked.append(client.get("/v1/jobs", timeout=PATIENCE).status_code)
            )
            waiting.start()
            go_on.set()
            waiting.join()
            assert asked == [200]
            whole = client.get("/health/live")
            assert (whole.json(), "x-content-type-options" in whole.headers) == ({"status": "live"}, True)
    finally:
        go_on.set()
        server.should_exit = True
        thread.join()
        listener.close()
    assert opening.trouble is None


def test_a_service_that_cannot_be_loaded_ends_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "text.db").write_text("this is no database " * 100)
    words = [*COMMAND, "serve", "--port", "0", "--database", f"sqlite:///{tmp_path}/text.db"]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 2
    assert "not a database" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_service_told_to_end_while_it_is_loaded_ends_at_once_and_well(tmp_path: Path) -> None:
    port, log = free_port(), tmp_path / "log"
    words = [*COMMAND, "serve", "--port", str(port), "--database", f"sqlite:///{tmp_path}/jobs.db"]
    with log.open("w") as stderr:
        process = subprocess.Popen(words, stderr=stderr)
        until(lambda: answers(port))
        process.terminate()
        assert process.wait(PATIENCE) == 0
    assert "Traceback" not in log.read_text()


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked off one on Linux only")
def test_what_processes_are_forked_off_begins_before_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "_settings_of_the_first", None)
    processes.begin()
    begun = fork_servers()
    process = processes.start(print, (), "nothing")
    process.join(PATIENCE)
    assert process.status() == 0
    process.close()
    assert [one.pid for one in begun] == [one.pid for one in fork_servers()]
    assert len(begun) == 1
