"""The study `peaks`: the highest peak of the frequency response over a parameter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from service.jobs.common.result_models import answered
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.common.study_keys import (
    CERTIFICATES,
    Certify,
    RangeRequest,
    heavy,
    law_issues,
    prepare,
    range_issues,
    with_proofs,
)
from service.jobs.kind_registry import Flag
from service.jobs.stored_figures import SweepRecord
from service.jobs.study import Answer, Proposed, Question, Watch
from solver.errors import Issue
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from solver.scene.scene import Scene
    from solver.studies.peaks.track_results import PeakTrack


peaks_result = answered(
    "solver.studies.peaks.track_results:PeakTrack", "PeaksResult", certificates=CERTIFICATES
)


class Peaks(RangeRequest):
    """Track the highest peak over a parameter.

    With exact derivatives; sweeps check that no peak was missed, and the least highest peak is found.
    """

    EXAMPLES = ({"scene": "bladed-disk", "parameter": DISK_LOAD, "from": 20, "to": 3000},)
    NAME, FUNCTION, RESULT = "peaks", "solver:track_peak", peaks_result
    ASKS = Question("How does the peak follow the damper?", "damper", 25_000)
    TOLD = "solver.views.tables.tracks:track"
    SHOWS = "the highest peak over the parameter, where it is least ([peaks](peaks.md))"
    FIGURE, EMPTY = "solver.views.plots.tracks:track_figure", ("parameter", "no peak was tracked")
    SWEEPS, COUNTED = "those that look for peaks", "sweeps"

    checks: Annotated[int, Field(strict=True, ge=0, le=200), Flag(metavar="N")] = Field(
        default=3, description="Sweeps between the ends that look for peaks nothing has followed."
    )

    certify: Certify = False

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Return the range of what is designed by itself, where peaks can be tracked."""
        wrong, told = law_issues("scene", scene), super().propose(scene)
        if not isinstance(told, str) and heavy(scene, told.body["parameter"]):
            return "Peaks of a damper that lifts off fold, and are not followed with certainty: take the map."
        return wrong[0].said() if wrong else told

    def issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with the range and the laws of the contacts."""
        return range_issues(self, scene) + law_issues("scene", scene)

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        points = POINTS_OF_A_SWEEP * (self.checks + 2)
        return balance_issues("checks", scene, self.harmonics, points)

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """Follow the peaks; then prove the least, if that is asked for."""
        given = dict(asked)
        if not given.pop("certify", False):
            return super().compute(scene, given, watch)
        prepare(scene)
        answer = super().compute(scene, given, watch)
        track: Any = answer.result
        best, path = track.optimum, given["parameter"]
        if not best.active:
            return answer
        inside, there = path if best.status is best.status.TRACKED else "", scene.with_values({path: best.at})
        return with_proofs(answer, [(there, each.frequency) for each in best.active], inside, watch)

    @classmethod
    def sweeps(cls, found: PeakTrack) -> tuple[SweepRecord, ...]:
        """Return the responses that look for peaks."""
        from service.jobs.common.sweep_records import sweep_records

        return sweep_records(found.branches, intermediate=True)
