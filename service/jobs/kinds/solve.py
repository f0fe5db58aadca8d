"""The kind `solve`: the periodic response at one frequency, or all that are found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import ConfigDict, Field

import solver
from service.jobs.common.results import Amplitude, KindResult
from service.jobs.common.scenes import FrequencyHz, HarmonicRequest, require, resolve_scene, resolved
from service.jobs.common.sizes import balance_issues
from service.jobs.kind_view import Json, KindView, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.response.stability import MOST_STARTS
from solver.scene.descriptions import DAMPER_LOAD
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_EXAMPLE: dict[str, Any] = {"scene": "two-dof", "frequency_hz": 1.2, "set": {DAMPER_LOAD: 80}}
_EVERY: dict[str, Any] = {"scene": "two-dof", "frequency_hz": 1.05, "all": True, "starts": 8}
_STOPPED = "The search was stopped: these are the solutions found until then."


class SolveRequest(HarmonicRequest):
    """One response, or all that a search finds.

    Attributes
    ----------
    frequency_hz : float
        Excitation frequency [Hz].
    every : bool
        Look for all solutions (`all` in the body).
    starts : int
        Random starts of that search.
    seed : int
        Of their random numbers.
    """

    model_config = ConfigDict(validate_by_alias=True, json_schema_extra={"examples": [_EXAMPLE, _EVERY]})

    frequency_hz: FrequencyHz = Field(description="Excitation frequency [Hz].")
    every: bool = Field(
        default=False, alias="all", strict=True, description="Look for all solutions, with their stability."
    )
    starts: int = Field(default=40, strict=True, ge=0, le=MOST_STARTS, description="Random starts of `all`.")
    seed: int = Field(default=0, strict=True, ge=0, lt=2**63, description="Of the random starts of `all`.")


class SolveResult(KindResult):
    """One periodic response: of a search for all, the largest."""

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
    stable: str = Field(
        default="not known", description="Whether small perturbations die out: yes, no, not known."
    )
    stable_ground: str = Field(default="", description="Why, and a stable response beside one that is not.")
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
    drift_per_period: float | None = Field(
        default=None, description="How far a part that ratchets drifts in a period [m], if that is known."
    )
    solutions: list[dict[str, Any]] | None = Field(
        default=None, description="Of a search for all: each solution with its stability, largest first."
    )
    complete: bool | None = Field(default=None, description="Whether these are proven to be all.")
    missing_by_signs: int | None = Field(
        default=None, description="How many are missing at least, by the signs of the determinants."
    )
    starts: int | None = Field(default=None, description="Random starts that were made.")
    stopped: bool | None = Field(default=None, description="Whether the search was ended before its end.")
    note: str | None = Field(default=None, description="What is known of the list.")


def resolve(request: SolveRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check the size."""
    scene = resolve_scene(request, source)
    require(balance_issues("/harmonics", scene, request.harmonics))
    search = {"all": True, "starts": request.starts, "seed": request.seed} if request.every else {}
    return resolved(scene, frequency_hz=request.frequency_hz, harmonics=request.harmonics, **search)


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Solve the balance, once or from many starts."""
    scene, at = Scene.from_dict(spec["scene"]), spec["frequency_hz"]
    if not spec.get("all"):
        solution = solver.solve(scene, frequency_hz=at, harmonics=spec["harmonics"])
        return JobOutput.of(solution, reached=solution.converged)
    found = solver.solve_all(
        scene, frequency_hz=at, harmonics=spec["harmonics"], starts=spec["starts"], seed=spec["seed"],
        on_progress=progress, should_stop=should_stop,
    )  # fmt: skip
    largest = (
        found.solutions[0].solution
        if found.solutions
        else solver.solve(scene, frequency_hz=at, harmonics=spec["harmonics"])
    )
    seconds = {"seconds": found.seconds}
    return JobOutput(
        result=largest.to_json() | found.to_json() | seconds,
        shortfall=_STOPPED if found.stopped else None if found.solutions else largest.status.value,
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
        flags={"frequency_hz": "--frequency", "every": "--all"},
        draw=draw,
    ),
)
