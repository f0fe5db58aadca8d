"""A service whose kernels are not compiled yet answers at once, and goes over to them later."""

import asyncio
import json
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from test_previews import WaitRequest, _resolve

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
