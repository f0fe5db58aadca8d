"""The kind `march`: time marching, the independent referee."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import ConfigDict, Field

import solver
from service.jobs.common.periods import history_of
from service.jobs.common.results import Amplitude, KindResult, Table
from service.jobs.common.scenes import FrequencyHz, SceneRequest, require, resolve_scene, resolved
from service.jobs.common.sizes import march_issues
from service.jobs.kind_view import Json, KindView, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


SAMPLES = 512
_EXAMPLE: dict[str, Any] = {"scene": "two-dof", "frequency_hz": 1.2}


class MarchRequest(SceneRequest):
    """A time march.

    Attributes
    ----------
    frequency_hz : float
        Excitation frequency [Hz].
    steps_per_period : int or None
        Steps of the finer run; chosen from the fastest motion of the structure if left out.
    tolerance : float
        Largest relative change over a period of a motion that repeats.
    max_periods : int
        Periods marched at most.
    history : bool
        Whether the last period is in the result, as `history`.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    frequency_hz: FrequencyHz = Field(description="Excitation frequency [Hz].")
    steps_per_period: Annotated[int, Field(strict=True, ge=16, le=1_000_000)] | None = Field(
        default=None, description="Steps of the finer run; chosen by the solver if left out."
    )
    tolerance: float = Field(
        default=1e-10, strict=True, gt=0.0, lt=1.0, description="Largest change over a period, relative."
    )
    max_periods: int = Field(
        default=20_000, strict=True, ge=1, le=1_000_000, description="Periods marched at most."
    )
    history: bool = Field(
        default=False, strict=True, description="Give the last period too: motion and loops of the contacts."
    )


class MarchResult(KindResult):
    """The motion a time march settled to."""

    max_abs: Amplitude
    half_peak_to_peak: Amplitude
    mean: Amplitude
    harmonics: list[float | None] | None = Field(description="Amplitudes of the harmonics from 0 on [m].")
    periods: int
    steps_per_period: int
    error_estimate: float | None = Field(description="Relative to the largest displacement.")
    status: str
    seconds: float
    history: Table | None = Field(default=None, description="The last period, where it was asked for.")


def resolve(request: MarchRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check the size."""
    scene = resolve_scene(request, source)
    require(march_issues(scene, request.steps_per_period, request.max_periods))
    return resolved(
        scene,
        frequency_hz=request.frequency_hz,
        steps_per_period=request.steps_per_period,
        tolerance=request.tolerance,
        max_periods=request.max_periods,
        **({"history": True} if request.history else {}),
    )


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """March until the motion repeats."""
    marched = solver.march(
        Scene.from_dict(spec["scene"]),
        frequency_hz=spec["frequency_hz"],
        steps_per_period=spec["steps_per_period"],
        tolerance=spec["tolerance"],
        max_periods=spec["max_periods"],
        on_progress=progress,
        should_stop=should_stop,
    )
    result = marched.to_json()
    if spec.get("history"):
        result["history"] = history_of(marched, SAMPLES)
    return JobOutput(result=result, shortfall=None if marched.converged else marched.status.value)


def draw(result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
    """The harmonics of the last period."""
    from service.jobs.drawing import harmonics_of

    return harmonics_of(result)


MARCH = JobKind(
    name="march",
    summary="Time marching, the independent referee.",
    request=MarchRequest,
    resolve=resolve,
    run=run,
    result=MarchResult,
    view=KindView(
        result="amplitude and periods marched",
        flags={"frequency_hz": "--frequency", "steps_per_period": "--steps"},
        draw=draw,
    ),
)
