"""The study `interference`: natural frequencies over the nodal diameter, and the orders that meet them."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from optim.criteria.key import SpeedRpm
from service.jobs.common.result_models import answered
from service.jobs.common.scene_requests import FrequencyHz, check
from service.jobs.common.sizes import is_quick, memory_issues
from service.jobs.common.study_keys import of_keys
from service.jobs.kind_registry import Flag, Json
from service.jobs.study import NO_SECTORS, Proposed, Question, Study, first_order, middle_hz, rounded
from solver.errors import Issue
from solver.first_use import on_demand

if TYPE_CHECKING:
    from solver.scene.scene import Scene

_ABOVE_BAND = 2.0
_Orders = Annotated[
    list[Annotated[int, Field(strict=True, ge=1, le=1_000_000)]], Field(min_length=1, max_length=1000)
]


class Interference(Study):
    """Draw natural frequencies over the nodal diameter, with the engine orders that meet them.

    Each with all contacts open and all stuck: friction moves a resonance between the two.
    """

    EXAMPLES = ({"scene": "bladed-disk", "speed_rpm": 11000},)
    NAME, FUNCTION = "interference", "solver:interference_diagram"
    RESULT = answered("solver.studies.study_results:InterferenceDiagram", "InterferenceResult")
    TOLD = "solver.views.tables.disks:interference"
    SHOWS = "frequencies at each nodal diameter, orders that meet them ([interference](disks.md))"
    ASKS = Question("Which orders meet which modes?", "engine", 300)
    FIGURE = "solver.views.plots.disks:interference_figure"
    COUNTED = "nodal diameters"

    speed_rpm: Annotated[SpeedRpm | None, Flag("--speed", "RPM")] = Field(
        default=None, description="Speed of rotation [1/min]; the scene's own, and without one no orders."
    )
    orders: Annotated[_Orders | None, Flag("--order", "N")] = Field(
        default=None, description="Excitations a revolution; all that reach the frequencies if left out."
    )
    families: Annotated[int, Field(strict=True, ge=1, le=100), Flag(metavar="N")] = Field(
        default=6, description="How many natural frequencies at each nodal diameter."
    )
    up_to_hz: Annotated[FrequencyHz | None, Flag("--up-to", "HZ")] = Field(
        default=None, description="Families that begin above are left out [Hz]."
    )
    within: Annotated[float, Field(ge=0.0, le=1.0), Flag(metavar="S")] = Field(
        default=0.05, description="Relative distance of an order from a family that counts."
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """The speed that brings the order of the scene into the middle of its band."""
        if not scene.structure.has_sectors:
            return NO_SECTORS
        speed = scene.speed or rounded(60.0 * middle_hz(scene) / max(first_order(scene), 1))
        body = {"speed_rpm": speed, "up_to_hz": _ABOVE_BAND * scene.observe.band[1]}
        return Proposed(body, () if scene.speed else ("speed_rpm",))

    def issues(self, scene: Scene) -> list[Issue]:
        """Return why it is no disk, or a speed that cannot be."""
        from solver.studies.interference import checked_speed

        return check(partial(checked_speed, scene, self.speed_rpm, self.orders))

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        from solver.studies.mistuning import without_mistuning

        if (large := memory_issues(without_mistuning(scene), 1)) or not is_quick(scene):
            return large
        # How many orders reach the frequencies only these say.
        drawn = partial(on_demand(self.FUNCTION), scene, **self.spec(scene))
        return of_keys(check(drawn), self.own_keys())

    @classmethod
    def empty(cls, result: Json) -> str:
        """Return why there is nothing to draw."""
        some = any(point["open_hz"] for point in result["diameters"])
        return "" if some else "it has no natural frequency to draw"
