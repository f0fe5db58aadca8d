"""The study `margin`: stress over the excitation for several dampers, and the excitation each allows."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from optim.criteria.key import Name, ParameterPath
from service.jobs.common.result_models import Curve, answered
from service.jobs.common.scene_requests import HarmonicRequest, Number, PositiveNumber, check
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.kind_registry import Flag
from service.jobs.study import Proposed, Question, Study, rounded
from solver.errors import Issue, Naming
from solver.scene.descriptions import DAMPER_LOAD

if TYPE_CHECKING:
    from solver.scene.scene import Scene

# Of the excitation from and to, and of its peak, what is proposed: its range holds what reaches that limit.
_LEAST, _MOST, _ALLOWED = 0.25, 2.0, 1.5
_Values = Annotated[dict[ParameterPath, Number], Field(max_length=1000)]
_Dampers = Annotated[dict[Name, _Values], Field(min_length=1, max_length=50)]


class Margin(Study, HarmonicRequest):
    """Draw the stress over the excitation for several dampers, and the excitation each allows.

    Of a scene whose stresses have no material the amplitude is looked at, against a limit.
    """

    EXAMPLES = ({"scene": "two-dof", "from": 10, "to": 200, "limit": 2.0},)
    NAME, FUNCTION = "margin", "solver:margin_diagram"
    RESULT = answered(
        "solver.studies.study_results:MarginDiagram", "MarginResult", stress=list[Curve], used=list[Curve]
    )
    ASKS = Question("What margin is left?", "damper", 7_000)
    TOLD = "solver.views.tables.tracks:margin"
    SHOWS = "stress over the excitation, what each damper allows ([criteria](criteria.md))"
    FIGURE, EMPTY = "solver.views.plots.tracks:margin_figure", ("level", "it has no level to draw")
    COUNTED = "responses"

    start: Annotated[PositiveNumber, Flag(metavar="A")] = Field(
        alias="from", description="Least amplitude of the excitation, in its unit."
    )
    stop: Annotated[PositiveNumber, Flag(metavar="B")] = Field(alias="to", description="Largest amplitude.")
    points: Annotated[int, Field(strict=True, ge=2, le=1000), Flag(metavar="N")] = Field(
        default=9, description="Levels of the excitation, in equal ratios."
    )
    dampers: _Dampers | None = Field(
        default=None, description="Name to the values that make each damper; the scene as it is.",
        examples=[{"light": {DAMPER_LOAD: 50}, "heavy": {DAMPER_LOAD: 200}}],
    )  # fmt: skip
    limit: Annotated[PositiveNumber | None, Flag(metavar="A")] = Field(
        default=None, description="Amplitude allowed [m], of a scene without strengths."
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Excitations around the scene's own; without strengths a limit on the amplitude is assumed."""
        force = max((abs(one.amplitude) for one in scene.excitation), default=0.0)
        if not force:
            return "The scene has no excitation."
        strengths = any(one.material is not None for one in scene.recovery)
        ends = {"from": rounded(_LEAST * force), "to": rounded(_MOST * force)}
        return Proposed(ends, of_peak={} if strengths else {"limit": _ALLOWED})

    def issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with the ends and the dampers."""
        from solver.studies.margin_diagram import checked_dampers, checked_levels

        if self.stop <= self.start:
            return [Issue(("to",), Naming(f"must be above {{from}} = {self.start:g}"), self.stop)]
        levels = partial(checked_levels, scene, self.start, self.stop, self.points, self.limit)
        return check(levels) + check(partial(checked_dampers, scene, self.dampers))

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        points = self.points * len(self.dampers or [1]) * POINTS_OF_A_SWEEP
        return balance_issues("points", scene, self.harmonics, points)
