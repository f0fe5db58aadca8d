"""The study `wear`: what friction wears off the contacts over hours, and the response meanwhile."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import Field

from optim.criteria.key import FrequencyHz, Name, ParameterPath
from service.jobs.common.result_models import Curve, Table, answered
from service.jobs.common.scene_requests import HarmonicRequest, NotNegative, Number, PositiveNumber, check
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.kind_registry import Flag
from service.jobs.study import Answer, Proposed, Question, Study, Watch
from solver.errors import Issue

if TYPE_CHECKING:
    from solver.scene.scene import Scene

_OF_A_CHOICE = ("parameter", "start", "stop", "from_hours", "factors", "looks")
_OF_A_LIFE = ("limit", "paths", "points", "tolerance")
_CHOOSING, _CLOSING = 0.8, 10  # share of the time of a choice, and lives that close in on it
_HOURS, _COEFFICIENT, _AREA = 5.0, 1e-14, 1e-4  # are proposed
_STEPS = 20  # over the hours, each with a look at the whole band
_OfContacts = list[Curve]
_Block = Annotated[list[PositiveNumber], Field(min_length=2, max_length=2)]


_CHOSEN: Any = (
    Table | None,
    Field(None, description="Of `parameter`: the best value, and the worst amplitude with every one tried."),
)


class Wear(Study, HarmonicRequest):
    """Follow what friction wears off the contacts over hours, and the response meanwhile.

    Dissipated energy → depth of each contact → its load: the response and its power change, and so on.
    """

    EXAMPLES = ({
        "scene": "bladed-disk", "hours": 20, "coefficient": {"shroud": 1e-14},
        "area": {"shroud": 1e-4}, "load_loss_per_depth": {"shroud": 1e6}, "harmonics": 5,
    },)  # fmt: skip
    NAME, FUNCTION = "wear", "solver:wear_life"
    RESULT = answered(
        "stickslip.lab.wear_life.life_result:WearLife", "WearResult", depths=_OfContacts, loads=_OfContacts,
        power=_OfContacts, depth_slopes=_OfContacts, chosen=_CHOSEN,
    )  # fmt: skip
    ASKS = Question("How does it wear?", "life", 40_000)
    TOLD = "stickslip.lab.wear_life.tables:wear_life"
    SHOWS, COUNTED = "depths, loads and amplitude over hours ([wear](wear.md#wear-over-life))", "responses"
    GROUPED: ClassVar = {"mission": "solver:Mission", "wear": "solver:WearLaw"}
    FIGURE = "stickslip.lab.wear_life.pictures:wear_life_figure"
    EMPTY = ("hours", "no response was found at the beginning")

    hours: Annotated[PositiveNumber, Field(le=1e9), Flag(metavar="H")] = Field(
        description="How long it runs [h]."
    )
    coefficient: Annotated[dict[Name, NotNegative], Field(min_length=1), Flag(metavar="CONTACT=X")] = Field(
        description="Wear coefficient [1/Pa, which is m³/J] of each contact or group that wears."
    )
    area: Annotated[dict[Name, PositiveNumber], Field(min_length=1), Flag(metavar="CONTACT=X")] = Field(
        description="Nominal area of each [m²]."
    )
    load_loss_per_depth: Annotated[dict[Name, NotNegative] | None, Flag("--load-loss", "CONTACT=X")] = Field(
        default=None,
        description="What a depth of 1 m takes from the normal load of each [N/m]; its normal stiffness kn.",
    )
    stiffness_loss_per_depth: Annotated[
        dict[Name, NotNegative] | None, Flag("--stiffness-loss", "CONTACT=X")
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

    parameter: Annotated[ParameterPath | None, Flag(metavar="PATH")] = Field(
        default=None,
        description="What is chosen, before anything is worn, so that the worst amplitude is least; the life "
        "is that of the best value.",
    )
    start: Annotated[Number | None, Flag(metavar="A")] = Field(
        default=None, alias="from", description="Least value of that parameter."
    )
    stop: Annotated[Number | None, Flag(metavar="B")] = Field(
        default=None, alias="to", description="Its largest value."
    )
    from_hours: Annotated[NotNegative | None, Flag(metavar="H")] = Field(
        default=None, description="From when on its amplitude counts [h], 0 the whole life; the end alone."
    )
    factors: Annotated[_Block, Flag(metavar="LO HI")] = Field(
        default=[1.0, 1.0], description="Between which factors all wear coefficients may be for it."
    )
    looks: Annotated[int, Field(strict=True, ge=3, le=1000), Flag(metavar="N")] = Field(
        default=9, description="Values over the range that the choice begins with."
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Five hours at the peak; coefficient and area of its contacts are assumed, and what a depth takes of
        the load where a contact has no normal stiffness."""
        rubbing = {c.group or c.name: c for c in scene.contacts if c.load is not None and hasattr(c, "mu")}
        if not rubbing:
            return "The scene has no contact that rubs and wears."
        stiff = {name: getattr(c, "kt", 0.0) for name, c in rubbing.items() if not getattr(c, "kn", None)}
        assumed = {
            "coefficient": dict.fromkeys(rubbing, _COEFFICIENT), "area": dict.fromkeys(rubbing, _AREA),
            **({"load_loss_per_depth": stiff} if stiff else {}),
        }  # fmt: skip
        return Proposed({"hours": _HOURS, **assumed}, ("hours", *assumed))

    def issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with contacts, frequencies and paths, and with what is chosen."""
        return self._choice(scene) or check(partial(self._checked, scene))

    def _choice(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with the range of what is chosen."""
        if self.parameter is None:
            alone = {"from": self.start, "to": self.stop, "from_hours": self.from_hours}
            words = "is for a `parameter` that is chosen"
            return [Issue((key,), words, value) for key, value in alone.items() if value is not None]
        if self.start is None or self.stop is None or self.stop <= self.start:
            words = "needs `from` and `to`, the first below the second"
            return [Issue(("parameter",), words, self.parameter)]
        ends = (("from", self.start), ("to", self.stop))
        return [
            issue
            for key, value in ends
            for issue in check(partial(scene.with_values, {self.parameter: value}), key)
        ]

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """Follow a life; first choose what is least in the worst case, if that is asked for."""
        search = {key: asked[key] for key in _OF_A_CHOICE if key in asked}
        given = {key: value for key, value in asked.items() if key not in _OF_A_CHOICE}
        if "parameter" not in search:
            return super().compute(scene, given, watch)
        from stickslip.lab.wear_life.least_worn_peak import least_worn_peak

        grouped = cls.grouped({key: given[key] for key in given if key not in _OF_A_LIFE})
        part = watch.part(0.0, _CHOOSING)
        best = least_worn_peak(scene, **search, **grouped, **part._asdict())
        at = scene if math.isnan(best.at) else scene.with_values({best.parameter: best.at})
        answer = super().compute(at, given, watch.part(_CHOOSING, 1.0))
        status = answer.status if best.reached else str(best.status.value)
        return answer._replace(
            json={**answer.json, "chosen": best.to_json()}, reached=answer.reached and best.reached,
            status=status,
        )  # fmt: skip

    def _checked(self, scene: Scene) -> None:
        from stickslip.lab.wear_life.life import course_of
        from stickslip.lab.wear_life.mission import Mission
        from stickslip.lab.wear_life.wearing import WearLaw

        wear = WearLaw(self.coefficient, self.area, self.load_loss_per_depth, self.stiffness_loss_per_depth)
        mission = Mission(self.hours, self.frequency_hz, self.blocks)
        course_of(scene, mission, wear, paths=self.paths or (), harmonics=self.harmonics)

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        lives = 1 if self.parameter is None else self.looks + _CLOSING
        points = self.points + lives * (POINTS_OF_A_SWEEP if self.frequency_hz is None else 1) * _STEPS
        return balance_issues("points", scene, self.harmonics, points)
