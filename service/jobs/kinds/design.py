"""The kind `design`: the best damper of a scene, of what is known or in spite of what is not."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import ConfigDict, Field, RootModel

import optim
from optim.problem.keys import ROBUST, NominalAndRobustKeys, of_design
from service.jobs.common.problem import ProblemRequest, arguments, default_variables, problem_of
from service.jobs.common.records import design_record, robust_record, sweep_record
from service.jobs.common.results import Amplitude, KnownResult, PeakAt, ReachedResult, Table
from service.jobs.common.scenes import refusal, require, resolve_scene, resolved
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.kind_view import Json, KindView, NothingToDrawError, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop, SweepRecord
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.errors import Issue, pointer
from solver.scene.descriptions import DISK_LOAD
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from optim.results.best_so_far import BestSoFar
    from solver import Branch

UNCERTAIN = "uncertain"
_NOT_ROBUST = ("basins",)


_EXAMPLE: dict[str, Any] = {
    "scene": "bladed-disk",
    "variables": {DISK_LOAD: [20, 3000], "root.kt": [1e6, 1e8]},
    "cases": [{"name": "first bending"}, {"name": "twice the force", "set": {"excitation.amplitude": 100}}],
    "limit": 8e-5,
    "max_band_hz": 60,
    "forbidden_hz": [[520, 560]],
    "contact_states": {"shroud": "never-separates"},
    "method": "auto",
}


class _DesignRequest(NominalAndRobustKeys, ProblemRequest):
    """A design problem, in the words of `optim.design`, or with `uncertain` of `optim.robust_design`."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})


DesignRequest = of_design(_DesignRequest)


class OptimumResult(KnownResult, ReachedResult):
    """The best design of what is known: its values, its responses, and what holds it."""

    scene: str
    method: str
    optimum: dict[str, float]
    peak: PeakAt | None
    n_harmonics: int = Field(
        description="Highest harmonic kept; more than asked for where the peak needs them."
    )
    peaks: list[Table]
    band_hz: float | None
    limit: Amplitude
    bands: list[Table]
    objective: float | None
    rows: list[Table]
    held_by: Table | None
    stable: str
    stable_ground: str
    errors: list[Table]
    warnings: list[Any]
    plateau: Table
    chosen_by: str | None
    certainty: str = Field(description="Whether the range is closed by peaks followed over it, or sampled.")
    checked: list[Any]
    curve: Table | None
    looked_at: list[Any]
    evaluations: int
    newton_iterations: int
    tried: list[Table]
    basins: list[Table]
    seconds: float
    work: float | None
    active: list[str]
    optimality: float | None
    multipliers: list[float | None]
    conditions: Table | None
    broken: list[Table]


class RobustResult(KnownResult, ReachedResult):
    """The best design in spite of what is not known, beside the best of what is."""

    scene: str
    aim: str
    quantile: float | None
    uncertain: Table
    optimum: dict[str, float]
    nominal: Table | None
    robust: Table | None
    objective: float | None
    gain: float | None
    cuts: list[Table]
    gap: float | None
    inner_look: bool | None
    optimality: float | None
    violation: float | None
    unknown: Any
    designs: int
    responses: int
    seconds: float
    nominal_status: str
    warnings: list[Any]


class DesignResult(RootModel[OptimumResult | RobustResult]):
    """A design; with `uncertain` a robust one."""

    model_config = ConfigDict(defer_build=True)


def resolve(request: _DesignRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check the problem, fill in the variables."""
    scene = resolve_scene(request, source)
    given = arguments(request)
    cases = len(request.cases or [1])
    times = cases if request.samples is None or UNCERTAIN not in given else cases * request.samples
    points = POINTS_OF_A_SWEEP * times
    where = "/samples" if times > cases else "/cases"
    require(
        design_issues(scene, given)
        or balance_issues(where, scene, request.harmonics, points, "points of one design's responses")
    )
    return resolved(scene, **given, **default_variables(scene, given))


def design_issues(scene: Scene, given: Mapping[str, Any]) -> list[Issue]:
    """Everything wrong with the arguments of a design, robust or not."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from optim.problem.issues import problem_issues, uncertainty_issues

    known = {key: value for key, value in given.items() if key not in ROBUST}
    issues = problem_issues(scene, known)
    if UNCERTAIN in given:
        issues += [
            refusal(
                pointer(key), f"`{key}` is for a design without `uncertain` parameters, got {given[key]!r}"
            )
            for key in _NOT_ROBUST
            if key in given
        ]
        return issues + uncertainty_issues(scene, known, given[UNCERTAIN])
    alone = [key for key in ROBUST if key in given]
    return issues + [
        refusal(pointer(key), f"`{key}` is for a design with `uncertain` parameters, got {given[key]!r}")
        for key in alone
    ]


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Search."""
    scene, given = Scene.from_dict(spec["scene"]), problem_of(spec)
    if UNCERTAIN in given:
        return _run_robust(scene, given, progress, should_stop)
    found = optim.design(
        scene, **given, on_progress=progress, should_stop=should_stop, on_best=_telling(progress)
    )
    return JobOutput.of(
        found,
        reached=found.reached,
        sweeps=_on_the_way(found.sweeps),
        design=design_record(found),
    )


def _run_robust(
    scene: Scene, given: Mapping[str, Any], progress: Progress, should_stop: ShouldStop
) -> JobOutput:
    """Search over the uncertainty; the stored sweeps are those of the search without it."""
    found = optim.robust_design(
        scene, **given, on_progress=progress, should_stop=should_stop, on_best=_telling(progress)
    )
    return JobOutput.of(
        found,
        reached=found.reached,
        sweeps=_on_the_way(found.design.sweeps),
        design=robust_record(found),
    )


def _telling(progress: Progress) -> Callable[[BestSoFar], None]:
    """What tells of the best design so far."""
    return lambda found: progress.best(found.to_json())


def _on_the_way(branches: Iterable[Branch]) -> tuple[SweepRecord, ...]:
    """The responses that a search computed, as they are stored."""
    return tuple(sweep_record(branch, intermediate=True) for branch in branches if len(branch.values))


def draw(result: Json, sweeps: Sequence[StoredSweep], read: ReadSweep) -> Figure:
    """The response of the optimum; of a robust design both optima over the uncertainty."""
    if "nominal" not in result:
        from service.jobs.drawing import best_sweep_figure

        return best_sweep_figure(result, sweeps, read)
    from optim.views.plots.designs import robust_figure

    if result["nominal"] is None:
        raise NothingToDrawError("no design was found")
    return robust_figure(result)


DESIGN = JobKind(
    name="design",
    summary="The best damper of a scene.",
    request=DesignRequest,
    resolve=resolve,
    run=run,
    result=DesignResult,
    view=KindView(
        result="the optimum and what holds it",
        sweeps="every response computed",
        keys="those of [a design problem](design.md)",
        draw=draw,
    ),
)
