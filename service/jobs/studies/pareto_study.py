"""The study `pareto`: the front of peak against resonance band."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from optim.problem.problem_keys import PointsOfFront, of_front
from service.jobs.common.problem_requests import ProblemRequest
from service.jobs.common.result_models import answered
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.common.study_keys import heavy
from service.jobs.stored_figures import SweepRecord
from service.jobs.study import Proposed, Question
from solver.errors import Issue
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from optim import ParetoResult as Front
    from solver.scene.scene import Scene


pareto_result = answered("optim:ParetoResult", "ParetoResult", scene=str, dof=str, limit=float | None)


class _Pareto(PointsOfFront, ProblemRequest):
    """Find the front of peak against resonance band.

    Designs of which none has both a lower peak and a narrower band than another, with what a narrower band
    costs. The problem is described as for `design`, without weights and a limit on the band.
    """

    EXAMPLES = ({"scene": "bladed-disk", "variables": {DISK_LOAD: [20, 3000]}, "limit": 8e-5},)
    NAME, FUNCTION, RESULT = "pareto", "optim:pareto_front", pareto_result
    ASKS = Question("What does a narrower band cost?", "damper", 110_000)
    KEYS = "those of a design problem, `points`"
    TOLD = "optim.views.tables.design:front"
    SHOWS, SWEEPS = "the front of [peak against band](design.md#peak-against-band)", "those of its points"
    EMPTY, FIGURE = ("points", "its front has no point"), "optim.views.plots.figures:pareto_figure"

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Of a damper that lifts off, heavy ones: among the light ones the narrowest band is no design."""
        told = super().propose(scene)
        if isinstance(told, str):
            return told
        ranges = told.body["variables"].items()
        return Proposed(
            {"variables": {path: [heavy(scene, path) or low, high] for path, (low, high) in ranges}}
        )

    @classmethod
    def lacks(cls, given: Collection[str]) -> bool:
        """Return whether it is left open what is designed: then it is what is proposed."""
        return "variables" not in given

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        points = POINTS_OF_A_SWEEP * len(self.cases or [1]) * (self.points or 1)
        words = "points of the responses of a front"
        return balance_issues("points", scene, self.harmonics, points, words)

    @classmethod
    def sweeps(cls, found: Front) -> tuple[SweepRecord, ...]:
        """Return the responses of its points."""
        from service.jobs.common.sweep_records import sweep_records

        known = [point.design.evaluation for point in found.points]
        responses = [one for evaluation in known if evaluation is not None for one in evaluation.responses]
        return sweep_records((one.branch for one in responses), intermediate=True)


Pareto = of_front(_Pareto)
