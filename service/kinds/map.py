"""The kind `map`: the response over frequency and a parameter, with the ridge of its peaks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import ConfigDict, Field

import solver
from service.jobs import JobKind, JobOutput, Progress, Resolved, SceneSource, ShouldStop
from service.kinds.ranges import RangeRequest, law_issues, range_issues
from service.kinds.records import sweep_records
from service.kinds.scenes import refusal, require, resolve_scene, resolved
from service.kinds.sizes import MOST_POINTS, dofs_solved, size_issues
from solver.errors import Issue
from solver.scene import Scene

_EXAMPLE: dict[str, Any] = {
    "scene": "bladed-disk",
    "parameter": "shroud.N0",
    "from": 20,
    "to": 3000,
    "steps": 60,
    "frequencies": 400,
}
_Count = Annotated[int, Field(strict=True, ge=2, le=MOST_POINTS // 2)]


class MapRequest(RangeRequest):
    """A map, in the words of the command.

    Attributes
    ----------
    steps : int
        Values of the parameter.
    frequencies : int
        Frequencies over the band.
    ridge : bool
        Whether the peaks are tracked too.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    steps: _Count = Field(default=60, description="Values of the parameter.")
    frequencies: _Count = Field(default=400, description="Frequencies over the scene's band.")
    ridge: bool = Field(
        default=True, strict=True,
        description="Track the peaks too; false is faster, and for contacts of every law.",
    )  # fmt: skip


def resolve(request: MapRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check the range, the size and, with a ridge, the laws of the contacts."""
    scene = resolve_scene(request, source)
    require(
        range_issues(request, scene)
        + _size_issues(request, scene)
        + (law_issues("/ridge", scene) if request.ridge else [])
    )
    return resolved(
        scene,
        parameter=request.parameter,
        start=request.from_,
        stop=request.to,
        steps=request.steps,
        frequencies=request.frequencies,
        ridge=request.ridge,
        harmonics=request.harmonics,
    )


def _size_issues(request: MapRequest, scene: Scene) -> list[Issue]:
    points = request.steps * request.frequencies
    if points > MOST_POINTS:
        return [refusal("/steps", f"`steps` × `frequencies` must be at most {MOST_POINTS}, got {points}")]
    words = "`steps` × `frequencies`"
    return size_issues("/steps", words, points, request.harmonics, dofs_solved(scene))


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Solve the grid; the stored sweeps are those that look for peaks."""
    found = solver.response_map(
        Scene.from_dict(spec["scene"]),
        spec["parameter"],
        spec["start"],
        spec["stop"],
        steps=spec["steps"],
        frequencies=spec["frequencies"],
        ridge=spec["ridge"],
        harmonics=spec["harmonics"],
        on_progress=progress,
        should_stop=should_stop,
    )
    return JobOutput(
        result=found.to_json(),
        sweeps=() if found.ridge is None else sweep_records(found.ridge.branches),
        shortfall=None if found.completed else found.status.value,
    )


MAP = JobKind(
    name="map",
    summary="The response over frequency and a parameter, with the ridge of its peaks.",
    request=MapRequest,
    resolve=resolve,
    run=run,
)
