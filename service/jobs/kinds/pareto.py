"""The kind `pareto`: the front of peak against resonance band."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import ConfigDict, Field

import optim
from optim.problem.keys import PointsOfFront, of_front
from service.jobs.common.problem import ProblemRequest, arguments, default_variables, problem_of
from service.jobs.common.records import sweep_record
from service.jobs.common.results import Amplitude, KnownResult, ReachedResult, Table
from service.jobs.common.scenes import require, resolve_scene, resolved
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.kind_view import Json, KindView, NothingToDrawError, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.errors import Issue
from solver.scene.descriptions import DISK_LOAD
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_EXAMPLE: dict[str, Any] = {"scene": "bladed-disk", "variables": {DISK_LOAD: [20, 3000]}, "limit": 8e-5}


class _ParetoRequest(PointsOfFront, ProblemRequest):
    """A design problem without a limit on the band and weights: those are the front's own."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})


ParetoRequest = of_front(_ParetoRequest)


def pareto_issues(scene: Scene, given: Mapping[str, Any]) -> list[Issue]:
    """Everything wrong with the arguments of a front."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from optim.problem.issues import problem_issues

    return problem_issues(scene, {key: value for key, value in given.items() if key != "points"})


class ParetoResult(KnownResult, ReachedResult):
    """The front: designs of which none has both a lower peak and a narrower band than another."""

    scene: str
    dof: str
    limit: Amplitude
    points: list[Table]
    knee: int | None = Field(description="Number of the point where the front bends most.")
    dominated: list[Table]
    missed: list[Table]
    ends: list[Table]
    evaluations: int
    seconds: float


def resolve(request: _ParetoRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check the problem, fill in the variables."""
    scene = resolve_scene(request, source)
    given = arguments(request)
    points = POINTS_OF_A_SWEEP * len(request.cases or [1]) * (request.points or 1)
    words = "points of the responses of a front"
    require(pareto_issues(scene, given) or balance_issues("/points", scene, request.harmonics, points, words))
    return resolved(scene, **given, **default_variables(scene, given))


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Follow the front; the stored sweeps are those of its points."""
    found = optim.pareto_front(
        Scene.from_dict(spec["scene"]), **problem_of(spec), on_progress=progress, should_stop=should_stop
    )
    evaluations = [point.design.evaluation for point in found.points]
    branches = [
        r.branch for evaluation in evaluations if evaluation is not None for r in evaluation.responses
    ]
    return JobOutput.of(
        found,
        reached=found.reached,
        sweeps=tuple(sweep_record(branch, intermediate=True) for branch in branches if len(branch.values)),
    )


def draw(result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
    """The front."""
    from optim.views.plots.designs import pareto_figure

    if not result["points"]:
        raise NothingToDrawError("its front has no point")
    return pareto_figure(result)


PARETO = JobKind(
    name="pareto",
    summary="The front of peak against resonance band.",
    request=ParetoRequest,
    resolve=resolve,
    run=run,
    result=ParetoResult,
    view=KindView(
        result="the front of peak against band ([trade-offs](trade-offs.md))",
        sweeps="those of its points",
        keys="those of a design problem, `points`",
        draw=draw,
    ),
)
