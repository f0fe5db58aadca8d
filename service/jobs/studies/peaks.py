"""The study `peaks`: the highest peak of the frequency response over a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import ConfigDict, Field

from service.jobs.common.results import answered
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.common.study_keys import RangeRequest, law_issues, range_issues
from service.jobs.figures import SweepRecord
from service.jobs.registry import Flag
from service.jobs.study import Study
from solver.errors import Issue
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from solver.scene.scene import Scene
    from solver.studies.peaks.results import PeakTrack


peaks_result = answered("solver.studies.peaks.results:PeakTrack", "PeaksResult")


class Peaks(Study, RangeRequest):
    """Track the highest peak over a parameter.

    With exact derivatives; sweeps check that no peak was missed, and the least highest peak is found.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"scene": "bladed-disk", "parameter": DISK_LOAD, "from": 20, "to": 3000}]
        }
    )
    NAME, FUNCTION, RESULT = "peaks", "solver:track_peak", peaks_result
    TOLD = "solver.views.tables.tracks:track"
    SHOWS = "the highest peak over the parameter, where it is least ([peaks](peaks.md))"
    FIGURE, EMPTY = "solver.views.plots.tracks:track_figure", ("parameter", "no peak was tracked")
    SWEEPS, COUNTED = "those that look for peaks", "sweeps"

    checks: Annotated[int, Field(strict=True, ge=0, le=200), Flag(metavar="N")] = Field(
        default=3, description="Sweeps between the ends that look for peaks nothing has followed."
    )

    def issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with the range and the laws of the contacts."""
        return range_issues(self, scene) + law_issues("scene", scene)

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        points = POINTS_OF_A_SWEEP * (self.checks + 2)
        return balance_issues("checks", scene, self.harmonics, points)

    @classmethod
    def sweeps(cls, found: PeakTrack) -> tuple[SweepRecord, ...]:
        """Return the responses that look for peaks."""
        from service.jobs.common.records import sweep_records

        return sweep_records(found.branches, intermediate=True)


STUDY = Peaks
