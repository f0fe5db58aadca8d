"""A service whose kernels are not compiled yet answers at once, and goes over to them later."""

import asyncio
import json
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
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
from service.queue.health import readiness
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


@pytest.mark.parametrize(("compiling", "ready"), [(False, 0), (True, 0), (False, 1)])
def test_readiness_says_what_is_being_started(compiling: bool, ready: int) -> None:
    service: Any = SimpleNamespace(
        compiling=compiling, settings=SimpleNamespace(least_free_bytes=0),
        database=SimpleNamespace(trouble=lambda _: None),
        queue=SimpleNamespace(alive=True, status=lambda: SimpleNamespace(ready=ready)),
    )  # fmt: skip
    found = readiness(service)
    assert found.ready is (compiling or ready > 0)
    assert ("compiled" in (found.starting or "")) is compiling


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
