"""The study `map`: the response over frequency and a parameter, with the ridge of its peaks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from service.jobs.common.result_models import Curve, KindResult, answered
from service.jobs.common.scene_requests import CHECKED_BY, SCENE, stored_scene
from service.jobs.common.sizes import MOST_POINTS, balance_issues
from service.jobs.common.study_keys import RangeRequest, heavy, law_issues, range_issues
from service.jobs.job_parts import Division, JobPart, PartOutput, PartStoppedError
from service.jobs.kind_registry import Flag, JobKind, Json
from service.jobs.outputs import JobOutput, OnProgress, ShouldStop
from service.jobs.stored_figures import StoredArray
from service.jobs.studies.peaks_study import peaks_result
from service.jobs.study import Proposed, Question
from solver.errors import Issue
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from solver.scene.scene import Scene
    from solver.studies.response_map import MapGrid

_Count = Annotated[int, Field(strict=True, ge=2, le=MOST_POINTS // 2)]


@cache
def map_result() -> type[KindResult]:
    """Return the schema of a map."""
    return answered(
        "solver.studies.study_results:ResponseMap", "MapResult", amplitude=list[Curve],
        half_peak_to_peak=list[Curve], ridge=peaks_result() | None, largest_residual=float | None,
    )()  # fmt: skip


class Map(RangeRequest):
    """Map the response over frequency and a parameter, with the ridge of its peaks."""

    EXAMPLES = ({
        "scene": "bladed-disk", "parameter": DISK_LOAD, "from": 20, "to": 3000, "steps": 60,
        "frequencies": 400,
    },)  # fmt: skip
    NAME, FUNCTION, RESULT = "map", "solver:response_map", map_result
    ASKS = Question("How does the response change with the damper?", "damper", 41_000)
    TOLD = "solver.views.tables.tracks:response_map"
    SHOWS, SWEEPS = "the amplitude on the grid, the ridge of its peaks", "those that look for peaks"
    FIGURE = "solver.views.plots.tracks:map_figure"

    steps: Annotated[_Count, Flag(metavar="N")] = Field(default=60, description="Values of the parameter.")
    frequencies: Annotated[_Count, Flag(metavar="N")] = Field(
        default=400, description="Frequencies over the scene's band."
    )
    ridge: Annotated[bool, Field(strict=True)] = Field(
        default=True, description="Track the peaks too; false is faster, and for contacts of every law."
    )

    def issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with the range and, with a ridge, with the laws of the contacts."""
        return range_issues(self, scene) + (law_issues("ridge", scene) if self.ridge else [])

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """With a ridge where every law has one; of dampers that lift off without, coarse, of heavy ones."""
        told = super().propose(scene)
        if isinstance(told, str):
            return told
        if least := heavy(scene, told.body["parameter"]):
            few = {"from": least, "steps": 30, "frequencies": 200, "ridge": False}
            return Proposed({**told.body, **few})
        return Proposed({**told.body, "ridge": not law_issues("ridge", scene)})

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        points = self.steps * self.frequencies
        if points > MOST_POINTS:
            return [Issue(("steps",), f"× `frequencies` must be at most {MOST_POINTS}", points)]
        return balance_issues("steps", scene, self.harmonics, points, "`steps` × `frequencies`")

    @classmethod
    def empty(cls, result: Json) -> str:
        """Return why there is nothing to draw."""
        some = any(value is not None for row in result["amplitude"] for value in row)
        return "" if some else "no point of it was solved"

    @classmethod
    def as_kind(cls) -> JobKind:
        """Return the kind of job, which is computed in parts."""
        return replace(super().as_kind(), run=PARTS.run, parts=PARTS)


def split(spec: Mapping[str, Any]) -> list[JobPart]:
    """The ridge, which takes longest, and strips of rows."""
    grid, ridge = _grid(spec), spec["ridge"]
    from solver.studies.response_map import OF_THE_GRID

    weight = (OF_THE_GRID if ridge else 1.0) / grid.steps
    tracked = [JobPart(spec={"ridge": True}, weight=1.0 - OF_THE_GRID)] if ridge else []
    return tracked + [
        JobPart(spec={"rows": [first, last]}, weight=weight * (last - first)) for first, last in grid.strips
    ]


def run_part(
    spec: Mapping[str, Any], part: Mapping[str, Any], progress: OnProgress, should_stop: ShouldStop
) -> PartOutput:
    """Track the peaks, or solve some rows."""
    if part.get("ridge"):
        return _ridge(spec, progress, should_stop)
    strip = _grid(spec).solve(*part["rows"], on_progress=progress, should_stop=should_stop)
    if strip.stopped:
        raise PartStoppedError
    return PartOutput(
        result={
            "first": strip.first, "newton_iterations": strip.newton_iterations, "seconds": strip.seconds
        },
        arrays={"values": StoredArray.of(strip.values)},
        points=strip.values.shape[0] * strip.values.shape[1],
    )  # fmt: skip


def join(spec: Mapping[str, Any], outputs: Mapping[int, PartOutput]) -> JobOutput:
    """The map from its strips; the stored sweeps are those that look for peaks."""
    from service.jobs.common.sweep_records import unpacked
    from solver.results.known import Known, worst_of
    from solver.studies.response_map import Strip

    parts = list(outputs.values())
    ridge = parts.pop(0) if spec["ridge"] else None
    found = _grid(spec).joined([Strip(**part.result, values=part.arrays["values"].array()) for part in parts])
    result = found.to_json()
    if ridge is not None:
        result["ridge"] = ridge.result["ridge"]
        result |= worst_of([found.known, Known.of_result(ridge.result["ridge"])]).to_json()
        result["seconds"] = found.seconds + ridge.result["ridge"]["seconds"]
    return JobOutput(
        result=result,
        sweeps=() if ridge is None else unpacked(ridge.result["sweeps"], ridge.arrays),
        shortfall=None if found.reached else found.status.value,
    )


def _grid(spec: Mapping[str, Any]) -> MapGrid:
    from solver.studies.response_map import map_grid

    given = {name: value for name, value in spec.items() if name not in (SCENE, CHECKED_BY)}
    return map_grid(stored_scene(spec), **given)


def _ridge(spec: Mapping[str, Any], progress: OnProgress, should_stop: ShouldStop) -> PartOutput:
    import solver
    from service.jobs import strict_json
    from service.jobs.common.sweep_records import packed, sweep_records

    track = solver.track_peak(
        stored_scene(spec), spec["parameter"], spec["start"], spec["stop"], harmonics=spec["harmonics"],
        on_progress=lambda share, _sweeps: progress(share, 0), should_stop=should_stop,
    )  # fmt: skip
    if track.status is solver.TrackStatus.STOPPED:
        raise PartStoppedError
    sweeps, arrays = packed(sweep_records(track.branches, intermediate=True))
    return PartOutput(result={"ridge": strict_json.finite(track.to_json()), "sweeps": sweeps}, arrays=arrays)


PARTS = Division(split=split, run_part=run_part, join=join)
