"""The kind `solve`: the periodic response at one frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import ConfigDict, Field

import solver
from service.jobs.common.scenes import FrequencyHz, HarmonicRequest, require, resolve_scene, resolved
from service.jobs.common.sizes import balance_issues
from service.jobs.kind_view import Json, KindView, ReadSweep, StoredSweep
from service.jobs.kinds.registry.results import Amplitude, KindResult
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.scene.examples import DAMPER_LOAD
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_EXAMPLE: dict[str, Any] = {"scene": "two-dof", "frequency_hz": 1.2, "set": {DAMPER_LOAD: 80}}


class SolveRequest(HarmonicRequest):
    """One response; `frequency_hz` is the excitation frequency [Hz]."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    frequency_hz: FrequencyHz = Field(description="Excitation frequency [Hz].")


class SolveResult(KindResult):
    """One periodic response."""

    scene: str
    frequency_hz: float
    converged: bool
    status: str
    max_abs: Amplitude
    half_peak_to_peak: Amplitude
    mean: Amplitude
    harmonics: list[float] | None = Field(description="Amplitudes of the harmonics from 0 on [m].")
    flags: list[str]
    contacts: dict[str, str] = Field(description="What each contact does during the period.")
    unique: str = Field(
        default="not known", description="Whether it is the only response: proven or not known."
    )
    unique_ground: str = Field(default="", description="Why.")
    residual: float | None
    error_estimate: Amplitude
    n_harmonics: int
    newton_iterations: int
    seconds: float
    mean_range: list[float | None] | None = Field(
        default=None, description="Means that any history can leave [m], if the mean depends on it."
    )


def resolve(request: SolveRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check the size."""
    scene = resolve_scene(request, source)
    require(balance_issues("/harmonics", scene, request.harmonics))
    return resolved(scene, frequency_hz=request.frequency_hz, harmonics=request.harmonics)


def run(spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    """Solve the balance."""
    solution = solver.solve(
        Scene.from_dict(spec["scene"]), frequency_hz=spec["frequency_hz"], harmonics=spec["harmonics"]
    )
    return JobOutput.of(
        solution,
        reached=solution.converged,
    )


def draw(result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
    """The harmonics of the response."""
    from service.jobs.drawing import harmonics_of

    return harmonics_of(result)


SOLVE = JobKind(
    name="solve",
    summary="The periodic response at one frequency.",
    request=SolveRequest,
    resolve=resolve,
    run=run,
    result=SolveResult,
    view=KindView(
        result="the response at one frequency",
        flags={"frequency_hz": "--frequency"},
        draw=draw,
    ),
)
