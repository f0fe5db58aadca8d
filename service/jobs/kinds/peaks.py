"""The kind `peaks`: the highest peak of the frequency response over a parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import ConfigDict, Field

import solver
from service.jobs.common.ranges import RangeRequest, law_issues, range_issues
from service.jobs.common.records import sweep_records
from service.jobs.common.results import Curve, EndedResult, KnownResult, Table
from service.jobs.common.scenes import require, resolve_scene, resolved
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.kind_view import Json, KindView, NothingToDrawError, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.scene.examples import DISK_LOAD
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_EXAMPLE: dict[str, Any] = {"scene": "bladed-disk", "parameter": DISK_LOAD, "from": 20, "to": 3000}


class PeaksRequest(RangeRequest):
    """Tracked peaks, in the words of the command.

    Attributes
    ----------
    checks : int
        Sweeps between the ends that look for peaks nothing has followed.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    checks: Annotated[int, Field(strict=True, ge=0, le=200)] = Field(
        default=3, description="Sweeps between the ends that look for peaks nothing has followed."
    )


class PeaksResult(KnownResult, EndedResult):
    """The highest peak over the parameter, what competes with it, and where it is least."""

    scene: str
    parameter: Curve
    parameter_path: str
    unit: str
    peak: Curve
    frequency: Curve
    slope: Curve
    optimum: Table
    exchanges: list[Table]
    competing: list[Table]
    n_harmonics: int
    sweeps: int
    seconds: float


def resolve(request: PeaksRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check the range, the laws of the contacts and the size."""
    scene = resolve_scene(request, source)
    points = POINTS_OF_A_SWEEP * (request.checks + 2)
    require(
        range_issues(request, scene)
        + law_issues("/scene", scene)
        + balance_issues("/checks", scene, request.harmonics, points)
    )
    return resolved(
        scene,
        parameter=request.parameter,
        start=request.from_,
        stop=request.to,
        checks=request.checks,
        harmonics=request.harmonics,
    )


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Track; the stored sweeps are those that look for peaks."""
    track = solver.track_peak(
        Scene.from_dict(spec["scene"]),
        spec["parameter"],
        spec["start"],
        spec["stop"],
        harmonics=spec["harmonics"],
        checks=spec["checks"],
        on_progress=progress,
        should_stop=should_stop,
    )
    return JobOutput.of(
        track,
        reached=track.completed,
        sweeps=sweep_records(track.branches, intermediate=True),
    )


def draw(result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
    """The highest peak over the parameter."""
    from service.jobs.drawing import track_of
    from solver.views.plots.tracks import track_figure

    if not result["parameter"]:
        raise NothingToDrawError("no peak was tracked")
    return track_figure(track_of(result), dof="x")


PEAKS = JobKind(
    name="peaks",
    summary="The highest peak over a parameter, and where it is least.",
    request=PeaksRequest,
    resolve=resolve,
    run=run,
    result=PeaksResult,
    view=KindView(
        result="the highest peak over the parameter, where it is least ([peaks](peaks.md))",
        sweeps="those that look for peaks",
        draw=draw,
    ),
)
