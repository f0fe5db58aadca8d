"""The study `wear`: what friction wears off the contacts over hours, and the response meanwhile."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import ConfigDict, Field

from optim.criteria.key import FrequencyHz, Name, ParameterPath
from service.jobs.common.results import Curve, answered
from service.jobs.common.scenes import HarmonicRequest, PositiveNumber, check
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.registry import Flag
from service.jobs.study import Study
from solver.errors import Issue

if TYPE_CHECKING:
    from solver.scene.scene import Scene

_STEPS = 20  # over the hours, each with a look at the whole band
_NotNegative = Annotated[float, Field(strict=True, ge=0.0, le=1e15)]
_OfContacts = list[Curve]
_Block = Annotated[list[PositiveNumber], Field(min_length=2, max_length=2)]


class Wear(Study, HarmonicRequest):
    """Follow what friction wears off the contacts over hours, and the response meanwhile.

    Dissipated energy → depth of each contact → its load: the response and its power change, and so on.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "scene": "bladed-disk", "hours": 20, "coefficient": {"shroud": 1e-14},
                    "area": {"shroud": 1e-4}, "load_loss_per_depth": {"shroud": 1e6}, "harmonics": 5,
                }
            ]
        }
    )  # fmt: skip
    NAME, FUNCTION = "wear", "solver:wear_life"
    RESULT = answered(
        "solver.studies.wear_life.life_result:WearLife", "WearResult", depths=_OfContacts, loads=_OfContacts,
        power=_OfContacts, depth_slopes=_OfContacts,
    )  # fmt: skip
    TOLD = "solver.views.tables.responses:wear_life"
    SHOWS, COUNTED = "depths, loads and amplitude over hours ([wear](wear.md#wear-over-life))", "responses"
    GROUPED: ClassVar = {"mission": "solver:Mission", "wear": "solver:WearLaw"}
    FIGURE = "solver.views.plots.wear_life:wear_life_figure"
    EMPTY = ("hours", "no response was found at the beginning")

    hours: Annotated[PositiveNumber, Field(le=1e9), Flag(metavar="H")] = Field(
        description="How long it runs [h]."
    )
    coefficient: Annotated[dict[Name, _NotNegative], Field(min_length=1), Flag(metavar="CONTACT=X")] = Field(
        description="Wear coefficient [1/Pa, which is m³/J] of each contact or group that wears."
    )
    area: Annotated[dict[Name, PositiveNumber], Field(min_length=1), Flag(metavar="CONTACT=X")] = Field(
        description="Nominal area of each [m²]."
    )
    load_loss_per_depth: Annotated[dict[Name, _NotNegative] | None, Flag("--load-loss", "CONTACT=X")] = Field(
        default=None,
        description="What a depth of 1 m takes from the normal load of each [N/m]; its normal stiffness kn.",
    )
    stiffness_loss_per_depth: Annotated[
        dict[Name, _NotNegative] | None, Flag("--stiffness-loss", "CONTACT=X")
    ] = Field(
        default=None, description="What it takes from the tangential stiffness kt of each [N/m²]; nothing."
    )
    frequency_hz: Annotated[FrequencyHz | None, Flag("--frequency", "F")] = Field(
        default=None, description="Where it runs [Hz]; at the highest peak of the band if left out."
    )
    blocks: Annotated[list[_Block] | None, Field(min_length=1, max_length=1000)] = Field(
        default=None,
        description="Several frequencies [Hz], each with the hours of a mission it runs there.",
    )
    limit: Annotated[PositiveNumber | None, Flag(metavar="A")] = Field(
        default=None, description="Amplitude of the observed DOF [m]: when it is reached."
    )
    paths: Annotated[list[ParameterPath] | None, Field(max_length=100), Flag("--by", "PATH")] = Field(
        default=None,
        description="Parameters, or coefficient.NAME of a wear coefficient, to differentiate by.",
    )
    points: Annotated[int, Field(strict=True, ge=2, le=10_000), Flag(metavar="N")] = Field(
        default=40, description="Instants shown, evenly over the hours."
    )
    tolerance: Annotated[float, Field(strict=True, ge=1e-12, le=0.1), Flag(metavar="E")] = Field(
        default=1e-6, description="Relative error of a step over the hours."
    )

    def issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with contacts, frequencies and paths."""
        return check(partial(self._checked, scene))

    def _checked(self, scene: Scene) -> None:
        # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
        from solver.studies.wear_life.life import course_of
        from solver.studies.wear_life.mission import Mission
        from solver.studies.wear_life.wearing import WearLaw

        wear = WearLaw(self.coefficient, self.area, self.load_loss_per_depth, self.stiffness_loss_per_depth)
        mission = Mission(self.hours, self.frequency_hz, self.blocks)
        course_of(scene, mission, wear, paths=self.paths or (), harmonics=self.harmonics)

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        points = self.points + (POINTS_OF_A_SWEEP if self.frequency_hz is None else 1) * _STEPS
        return balance_issues("points", scene, self.harmonics, points)


STUDY = Wear
