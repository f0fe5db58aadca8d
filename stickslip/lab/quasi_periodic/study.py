"""The study `quasi-periodic`: the response to two base frequencies that are no multiples."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache, partial
from itertools import count
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, Field, RootModel

from optim.criteria.key import Name
from service.jobs.common.result_models import answered
from service.jobs.common.scene_requests import LEAST, FrequencyHz, HarmonicRequest, Number, check
from service.jobs.common.sizes import balance_issues, coefficients, contact_motions
from service.jobs.kind_registry import Flag, Json
from service.jobs.study import Answer, Proposed, Question, Study, Watch, middle_hz, rounded
from solver.errors import Issue

if TYPE_CHECKING:
    from solver.results.told import Told
    from solver.scene.scene import Scene

_HARMONICS = (11, 7, 5, 3)
_UNKNOWNS = 1200  # of a balance that is solved in half a minute: the most harmonics with no more are proposed
_RESPONSES = 7  # of long periods, at most as many as that


@cache
def quasi_periodic_result() -> type[BaseModel]:
    """Return the schema of a response to two frequencies, or of a curve of them with `to_hz`."""
    one: Any = answered(
        "stickslip.lab.quasi_periodic.quasi_periodic_result:QuasiPeriodic",
        "QuasiPeriodicResult",
        turns=list[list[int]],
    )()
    other: Any = answered("solver:QuasiPeriodicCurve", "QuasiPeriodicCurveResult")()

    class TorusResult(RootModel[one | other]):
        """A response to two frequencies; with `to_hz` a curve of them over the first."""

    return TorusResult


class QuasiPeriodicStudy(Study, HarmonicRequest):
    """Find the response to two frequencies that are no multiples.

    Those are the scene's excitation, and one more force with a frequency of its own: a second engine order,
    another shaft, flutter.
    """

    EXAMPLES = ({"scene": "two-dof", "frequency_hz": 1.05, "second_hz": 1.3821, "amplitude": 60},)
    NAME, FUNCTION, RESULT = "quasi-periodic", "solver:quasi_periodic", quasi_periodic_result
    ASKS = Question("What if two forces act at once?", "engine", 7_000)
    TOLD = "stickslip.lab.quasi_periodic.tables:quasi_periodic"
    SHOWS = "the response to two frequencies ([two base frequencies](transients.md#two-base-frequencies))"
    FIGURE = "stickslip.lab.quasi_periodic.pictures:torus_drawn"
    COUNTED = "looks"

    frequency_hz: Annotated[FrequencyHz, Flag("--frequency", "HZ")] = Field(
        description="Frequency of the scene's own excitation [Hz]."
    )
    to_hz: Annotated[FrequencyHz | None, Flag("--to", "HZ")] = Field(
        default=None, description="Its last value, where a curve over it is wanted [Hz]."
    )
    points: Annotated[int, Field(strict=True, ge=2, le=2000), Flag(metavar="N")] = Field(
        default=41, description="Values of it of a curve, evenly."
    )
    second_hz: Annotated[FrequencyHz, Flag("--second", "HZ")] = Field(
        description="Frequency of the second force [Hz]."
    )
    amplitude: Annotated[Number, Flag(metavar="N")] = Field(description="Amplitude of the second force [N].")
    dof: Annotated[Name | None, Flag(metavar="NAME")] = Field(
        default=None, description="DOF it acts on; that of the scene's first force."
    )
    phase: Annotated[float, Field(strict=True, ge=-1e4, le=1e4), Flag(metavar="RAD")] = Field(
        default=0.0, description="Its phase [rad]."
    )
    engine_order: Annotated[int | None, Field(strict=True, ge=0, le=10_000), Flag(metavar="N")] = Field(
        default=None, description="Its engine order on a disk; the scene's."
    )
    harmonics: Annotated[int, Field(strict=True, ge=1, le=80), Flag(metavar="H")] = Field(
        default=7, description="Multiples of the faster frequency up to which all sums of the two are kept."
    )
    turns: Annotated[int, Field(strict=True, ge=12, le=1000), Flag(metavar="N")] = Field(
        default=90,
        description="Most turns of the faster frequency after which the motion is taken to repeat.",
    )
    tolerance: Annotated[float, Field(strict=True, ge=LEAST, le=0.1), Flag(metavar="E")] = Field(
        default=2e-3, description="Change by longer periods, relative, at which they are long enough."
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """A second force as large as half the first, with which the motion repeats after 7 turns and 9.

        On a disk it has the engine order by which both forces are one wave of that long period: there is one
        where turns and sectors have no common divisor. Turns are odd, so that half-waves stay alike.
        """
        first = next((one for one in scene.excitation if one.amplitude), None)
        if first is None:
            return "The scene has no excitation."
        sectors = scene.structure.sector_count
        p = next(each for each in count(7, 2) if math.gcd(each, sectors) == 1)
        q = p + 2
        turn_hz, motions = rounded(middle_hz(scene) / p, 4), contact_motions(scene)
        fits = (each for each in _HARMONICS if motions * coefficients(scene, each * q) <= _UNKNOWNS)
        order = {}
        if scene.structure.has_sectors:
            order["engine_order"] = q * pow(p, -1, sectors) * scene.engine_order % sectors
        body = {
            "frequency_hz": rounded(p * turn_hz, 8), "second_hz": rounded(q * turn_hz, 8),
            "amplitude": rounded(abs(first.amplitude) / 2.0), "turns": 2 * q,
            "harmonics": next(fits, _HARMONICS[-1]), **order,
        }  # fmt: skip
        return Proposed(body, ("second_hz", "amplitude", *order))

    def issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with frequencies, force and lengths."""
        from stickslip.lab.quasi_periodic.quasi_periodic import check as checked
        from stickslip.lab.quasi_periodic.quasi_periodic import second_force

        if self.to_hz is not None:
            from stickslip.lab.quasi_periodic.quasi_periodic_curve import curve_points

            if wrong := check(partial(curve_points, self.frequency_hz, self.to_hz, self.points)):
                return wrong
        given = (self.frequency_hz, self.second_hz, self.harmonics, self.turns, self.tolerance)
        force = partial(
            second_force, scene, amplitude=self.amplitude, dof=self.dof, phase=self.phase,
            engine_order=self.engine_order,
        )  # fmt: skip
        return check(partial(checked, scene, *given)) + check(force)

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        points = 1 if self.to_hz is None else self.points
        return balance_issues("turns", scene, self.harmonics * self.turns, 2 * _RESPONSES * points)

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """Find one response, or a curve of them."""
        if "to_hz" in asked:
            from solver import quasi_periodic_curve

            return Answer.of(quasi_periodic_curve(scene, **asked, **watch._asdict()))
        given = {key: value for key, value in asked.items() if key != "points"}
        return super().compute(scene, given, watch)

    @classmethod
    def result_class(cls, result: Json) -> type[Told]:
        """Return the class of a stored result."""
        from stickslip.lab.quasi_periodic.quasi_periodic_curve import QuasiPeriodicCurve
        from stickslip.lab.quasi_periodic.quasi_periodic_result import QuasiPeriodic

        return QuasiPeriodicCurve if isinstance(result["frequency_hz"], list) else QuasiPeriodic

    @classmethod
    def empty(cls, result: Json) -> str:
        """Return why there is nothing to draw."""
        curve = isinstance(result["frequency_hz"], list)
        some = any(one is not None for one in result["max_abs"]) if curve else result["line_hz"]
        return "" if some else "no response was found"
