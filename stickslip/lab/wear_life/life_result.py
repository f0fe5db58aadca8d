"""What the life of worn contacts comes to."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar

from solver.arrays import FloatOrNaN, Real
from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import Known
from solver.results.known import OF_X, Measured
from solver.results.base import Data, Views


class WearLifeStatus(Enum):
    """How a life ended; the value is a sentence a user can act on."""

    COMPLETED = "The contacts were followed over all hours."
    WORN_OUT = "A number that wear lowers reached 0: what the contact does then its law does not say."
    TWO_PEAKS = (
        "From the last hour on two peaks are the highest in turn, each wears the contacts so that the other "
        "one grows: give the frequencies that it runs at."
    )
    NO_RESPONSE = (
        "Beyond the last hour no response was found: use more harmonics, or look at a sweep with the loads "
        "of that hour."
    )
    STALLED = "The steps became too small to go on: allow a larger tolerance."
    TOO_MANY_STEPS = (
        "The largest number of steps was used up: look at fewer hours, or allow a larger tolerance."
    )
    STOPPED = "Stopped on request: what was followed until then."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class WearLife(MadeOfResponses, Drawn):
    """Depths, loads and response over T hours of n contacts that wear, with derivatives by m numbers."""

    VIEWS: ClassVar = Views("stickslip.lab.wear_life", "tables:wear_life", "pictures:wear_life_figure")
    DATA: ClassVar = Data(
        "wear-life", {
            "hours": "hours amplitude frequency_hz used", "contact hours": "depths loads power",
            "contact": "contact=contacts",
            "path": "path=paths end_slopes highest_slopes limit_slopes margin_slopes",
            "contact path": "depth_slopes",
        }, "dof highest highest_hours limit hours_to_limit hours_to_margin", scene="scene",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene dof measured contacts hours amplitude frequency_hz depths loads power switches highest"
        " highest_hours limit hours_to_limit used hours_to_margin paths end_slopes highest_slopes"
        " limit_slopes margin_slopes depth_slopes at_peak n_harmonics steps responses seconds ended_by"
        " completed=reached status"
    )

    scene: Annotated[str, "Name of the scene."]
    dof: Annotated[str, "The observed DOF."]
    measured: Annotated[Measured, "What the amplitudes are of."] = OF_X
    status: Annotated[WearLifeStatus, "How it ended."]
    ended_by: Annotated[str, "What ended it, beyond the status; empty if nothing did."]
    contacts: Annotated[tuple[str, ...], "Names of the contacts that wear."]
    hours: Annotated[Real, "Running time [h]; twice where another peak becomes the highest, (T,)."]
    amplitude: Annotated[Real, "max|x| of the observed DOF, at the highest of several frequencies [m], (T,)."]
    frequency_hz: Annotated[Real, "Frequency of that [Hz], (T,)."]
    depths: Annotated[Real, "Wear depth of each contact [m], (n, T)."]
    loads: Annotated[Real, "Mean normal load N0 of each, below 0 of a gap [N]; NaN without, (n, T)."]
    power: Annotated[Real, "What friction takes out of each [W], (n, T)."]
    switches: Annotated[tuple[float, ...], "When another peak became the highest [h]."]
    highest: Annotated[FloatOrNaN, "The largest amplitude over all hours [m]."]
    highest_hours: Annotated[FloatOrNaN, "When that is [h]."]
    limit: Annotated[FloatOrNaN, "The limit of the amplitude [m]; NaN if none was given."]
    hours_to_limit: Annotated[FloatOrNaN, "When the amplitude first reaches it [h]; NaN if it does not."]
    used: Annotated[
        Real, "Of a scene with strengths the greatest share of the stresses allowed, (T,); else NaN."
    ]
    hours_to_margin: Annotated[FloatOrNaN, "When all of it is used, margin 1 [h]; NaN if it is not."]
    paths: Annotated[tuple[str, ...], "What is differentiated by, parameter paths and wear coefficients."]
    end_slopes: Annotated[Real, "Derivatives of the last amplitude [m per unit], (m,)."]
    highest_slopes: Annotated[Real, "Those of the largest amplitude over all hours [m per unit], (m,)."]
    limit_slopes: Annotated[Real, "Those of the time to the limit [h per unit]; NaN without, (m,)."]
    margin_slopes: Annotated[Real, "Those of the time to margin 1 [h per unit]; NaN without, (m,)."]
    depth_slopes: Annotated[Real, "Those of the last depths [m per unit], (n, m)."]
    at_peak: Annotated[bool, "It runs at the highest peak of the band; else at given frequencies."]
    n_harmonics: Annotated[int, "Highest harmonic asked for."]
    steps: Annotated[int, "Steps over the hours."]
    responses: Annotated[int, "Responses solved for."]
    seconds: Annotated[float, "Time taken [s]."]
    begin_known: Annotated[Known, "How well the response at the beginning is known."]
    end_known: Annotated[Known, "How well that at the end is known."]

    def known_parts(self) -> Iterable[Known]:
        """The responses at the beginning and at the end."""
        return self.begin_known, self.end_known
