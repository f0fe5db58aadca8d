"""Kinds of job for these tests only: real computations whose length and obedience a test can choose."""

import os
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, Field

from service.jobs.checkpoints import Checkpoints, RunParts
from service.jobs.job_parts import Division, JobPart, PartOutput, PartStoppedError
from service.jobs.kind_registry import JobKind, JobRequest, Registry, Resolved
from service.jobs.outputs import JobOutput, OnProgress, Progress, ShouldStop
from service.jobs.stored_figures import ContactValues, StoredArray, SweepRecord
from service.jobs.studies import map_study as maps
from service.jobs.studies.sweep_study import Sweep
from solver.errors import Issue, SceneError, SettingError


class IterationRequest(JobRequest):
    """Power iteration on a symmetric matrix."""

    size: int = Field(default=20, strict=True, ge=2, le=500)
    seed: int = Field(default=0, strict=True, ge=0)
    seconds: float = Field(default=0.0, strict=True, ge=0.0, le=600.0)
    pid_file: str | None = None
    sweeps: int = Field(default=0, strict=True, ge=0, le=10)
    tells: bool = False


class IterationResult(BaseModel):
    """What a power iteration finds."""

    eigenvalue: float = Field(description="The largest [1/s].")
    steps: int = Field(description="Iterations.")


def as_it_is(request: IterationRequest, _source: object) -> Resolved:
    spec = request.model_dump(mode="json", exclude={"fresh", "priority", "max_seconds"})
    return Resolved(spec=spec, scene_name="matrix")


_STEPS = 500


def power_iteration(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """The largest eigenvalue; goes on for at least `seconds` and looks at `should_stop` in every step.

    Steps beyond those it needs are a thousand a second at most: jobs that are to last leave the processor to
    what is tested beside them.
    """
    if spec["pid_file"]:
        with Path(spec["pid_file"]).open("a") as file:
            file.write(f"{os.getpid()}\n")
    generator = np.random.default_rng(spec["seed"])
    matrix = generator.standard_normal((spec["size"], spec["size"]))
    matrix = matrix + matrix.T + 10.0 * np.sqrt(spec["size"]) * np.eye(spec["size"])
    vector = np.ones(spec["size"])
    start, steps, value = time.monotonic(), 0, 0.0
    while steps < _STEPS or time.monotonic() - start < spec["seconds"]:
        if should_stop():
            break
        image = matrix @ vector
        value = float(vector @ image / (vector @ vector))
        vector = image / np.linalg.norm(image)
        steps += 1
        if spec["tells"]:
            progress.best({"values": {"step": float(steps)}, "peak": value})
            progress.found([(float(steps), value)])
            time.sleep(0.002)
        elif steps > _STEPS:
            time.sleep(0.001)
        progress(min(1.0, (time.monotonic() - start) / max(spec["seconds"], 1e-9)), steps)
    records = tuple(_record(vector, value, steps, index) for index in range(spec["sweeps"]))
    return JobOutput(result={"eigenvalue": value, "steps": steps}, sweeps=records)


A_SWEEP = SweepRecord(
    scene_name="matrix",
    scene_hash="0" * 64,
    parameter="frequency",
    from_value=1.0,
    to_value=2.0,
    frequency_hz=None,
    excitation_amplitude=1.0,
    harmonics=1,
    points=2,
    peak=1.0,
    peak_at=1.5,
    limit=None,
    band_hz=None,
    newton_iterations=300,
    rejected_steps=0,
    seconds=0.1,
    completed=True,
    status="complete",
)
"""A stored sweep without contacts and arrays."""


def _record(vector: np.ndarray, value: float, steps: int, index: int) -> SweepRecord:
    return replace(
        A_SWEEP,
        points=vector.size,
        peak=value + index,
        newton_iterations=steps,
        contacts=(ContactValues(name="damper", kt=1.0, mu=0.3, N0=100.0 * index, N1=0.0, N1_phase=0.0),),
        arrays={
            "parameter": StoredArray.of(np.linspace(1.0, 2.0, vector.size)),
            "amplitude": StoredArray.of(vector),
        },
    )


def deaf(spec: Mapping[str, Any], progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    """The same, but it never looks whether it should stop."""
    return power_iteration(spec, progress, lambda: False)


def bad_scene(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    raise SceneError([Issue(("contacts", 0, "mu"), "must be >= 0", -0.1)])


def bad_setting(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    raise SettingError("harmonics", 0, "must be at least 1")


def falls_short(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Computes, and says that it did not get where it should."""
    done = power_iteration(spec, progress, should_stop)
    return JobOutput(result=done.result, sweeps=done.sweeps, shortfall="no limit was met: raise `limit`")


def broken(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    raise ZeroDivisionError("a mistake in the program")


def not_json(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    return JobOutput(result={"number": np.int64(1)})


def not_finite(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    return JobOutput(result={"mean": float("nan"), "list": [float("inf"), np.float64(1.0)]})


def unsendable(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    return JobOutput(result={}, sweeps=(lambda: None,))


def out_of_memory(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    raise MemoryError("this much is not there")


def allocate(spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    """As many megabytes as the seed says."""
    held = np.ones((spec["seed"], 1_000_000), np.uint8)
    return JobOutput(result={"bytes": int(held.size), "pid": os.getpid()})


def threads(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    """What the environment of a worker says about threads."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
    return JobOutput(result={name: os.environ.get(name) for name in names})


STRETCH_SECONDS = 0.1


def slow(should_stop: ShouldStop) -> ShouldStop:
    """Asked between stretches of a branch and between parts: makes each of them last longer."""

    def slowly() -> bool:
        time.sleep(STRETCH_SECONDS)
        return should_stop()

    return slowly


def slow_sweep(
    spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop, checkpoints: Checkpoints
) -> JobOutput:
    """The kind `sweep`, slowly."""
    return Sweep.run_on(spec, progress, slow(should_stop), checkpoints)


class HeldSweep(Sweep):
    """A sweep whose second stretch waits for a file."""

    until: str


def held_sweep(
    spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop, checkpoints: Checkpoints
) -> JobOutput:
    """The kind `sweep`; what it has found is told while it waits, however fast it was."""
    asked = dict(spec)
    seen = Path(asked.pop("until"))

    def held() -> bool:
        while not seen.exists() and not should_stop():
            time.sleep(0.01)
            progress(0.0, 0)
        return should_stop()

    return Sweep.run_on(asked, progress, held, checkpoints)


def slow_map(
    spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop, checkpoints: Checkpoints
) -> JobOutput:
    """The kind `map`, slowly."""
    return RunParts(maps.PARTS)(spec, progress, slow(should_stop), checkpoints)


def naps(spec: Mapping[str, Any]) -> list[JobPart]:
    """As many parts as the size says."""
    return [JobPart(spec={"number": number}) for number in range(spec["size"])]


def nap(
    spec: Mapping[str, Any], part: Mapping[str, Any], _progress: OnProgress, should_stop: ShouldStop
) -> PartOutput:
    """Takes so many seconds, and leaves the processor to what is tested beside it."""
    end = time.monotonic() + spec["seconds"]
    while (left := end - time.monotonic()) > 0.0:
        if should_stop():
            raise PartStoppedError
        time.sleep(min(left, 0.05))
    return PartOutput(result={"square": part["number"] ** 2, "pid": os.getpid()}, points=1)


def rested(_spec: Mapping[str, Any], outputs: Mapping[int, PartOutput]) -> JobOutput:
    told = [output.result for output in outputs.values()]
    return JobOutput(result={key: [one[key] for one in told] for key in ("square", "pid")})


NAPS = Division(split=naps, run_part=nap, join=rested)

_RUNS = {
    "iteration": power_iteration,
    "deaf": deaf,
    "bad-scene": bad_scene,
    "bad-setting": bad_setting,
    "falls-short": falls_short,
    "broken": broken,
    "not-json": not_json,
    "not-finite": not_finite,
    "unsendable": unsendable,
    "out-of-memory": out_of_memory,
    "allocate": allocate,
    "threads": threads,
}


def confused(_request: IterationRequest, _source: object) -> Resolved:
    raise RuntimeError("a mistake in the program")


SLOW = (
    replace(Sweep.as_kind(), name="slow-sweep", run_on=slow_sweep),
    replace(Sweep.as_kind(), name="held-sweep", request=HeldSweep, run_on=held_sweep),
    replace(maps.Map.as_kind(), name="slow-map", parts=None, run_on=slow_map),
)
PRIVATE = Registry(
    JobKind(name=name, summary=name, request=IterationRequest, resolve=as_it_is, run=run)
    for name, run in _RUNS.items()
).extended(
    JobKind(
        name="told-iteration",
        summary="",
        request=IterationRequest,
        resolve=as_it_is,
        run=power_iteration,
        result=IterationResult,
    ),
    JobKind(name="confused", summary="", request=IterationRequest, resolve=confused, run=power_iteration),
    JobKind(name="naps", summary="", request=IterationRequest, resolve=as_it_is, run=NAPS.run, parts=NAPS),
    *SLOW,
)


def cannot_warm_up() -> None:
    raise RuntimeError("the numerical packages are not there")
