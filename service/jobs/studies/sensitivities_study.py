"""The study `sensitivities`: what one per cent of every parameter does to the highest peaks and the band."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from service.jobs.common.result_models import PeakAt, answered
from service.jobs.common.scene_requests import HarmonicRequest, PositiveNumber
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.kind_registry import Flag, Json
from service.jobs.stored_figures import SweepRecord
from service.jobs.study import Answer, Question, Study, Watch
from solver.errors import Issue

if TYPE_CHECKING:
    from optim.results.studies_result import SensitivityResult
    from solver.scene.scene import Scene


class Sensitivities(Study, HarmonicRequest):
    """Say what matters: per cent of the peaks and the band for one per cent of each parameter.

    Exact derivatives through the whole solve; what matters most for the highest peak comes first.
    """

    EXAMPLES = ({"scene": "two-dof", "harmonics": 5},)
    NAME, FUNCTION = "sensitivities", "optim:sensitivities"
    RESULT = answered(
        "optim.results.studies_result:SensitivityResult", "SensitivitiesResult", peaks=list[PeakAt]
    )
    ASKS = Question("Which value matters most?", "damper", 500)
    TOLD = "optim.views.tables.studies:shares"
    SHOWS = "what one per cent of a parameter does to peaks and band ([its page](design.md#sensitivities))"
    SWEEPS, FIGURE = "the response", "optim.views.plots.figures:sensitivities_figure"

    limit: Annotated[PositiveNumber | None, Flag(metavar="A")] = Field(
        default=None,
        description="Amplitude [m] above which the resonance band is measured; peak/√2 if left out.",
    )

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        return balance_issues("harmonics", scene, self.harmonics, POINTS_OF_A_SWEEP)

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], _watch: Watch) -> Answer:
        """Compute at once: it takes little longer than the response."""
        import optim

        found = optim.sensitivities(scene, **asked)
        return Answer.of(found)

    @classmethod
    def sweeps(cls, found: SensitivityResult) -> tuple[SweepRecord, ...]:
        """Return the response."""
        from service.jobs.common.sweep_records import sweep_records

        return sweep_records([found.branch])

    @classmethod
    def empty(cls, result: Json) -> str:
        """Return why there is nothing to draw."""
        some = any(row["peak_percent"] is not None for row in result["rows"])
        return "" if some else "no parameter has a per cent"
