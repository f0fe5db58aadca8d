"""One periodic response: what `solve` returns, and what can be read off it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from solver.arrays import FloatOrNaN, Real
from solver.errors import SettingError
from solver.first_use import on_demand
from solver.results.base import Drawn, Views
from solver.results.known import Note, Stable, Verdict
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from solver.response.contact_response import ContactResponse
    from solver.response.stability.verdict import Uniqueness

MEAN_UNDETERMINED = "mean_undetermined"
HISTORY_DEPENDENT = "history_dependent"


class SolutionStatus(Enum):
    """How a solve ended; the value is a sentence a user can act on."""

    CONVERGED = "The balance is satisfied."
    ACCURACY_NOT_REACHED = (
        "The balance is satisfied, but the accuracy asked for was not reached with the most harmonics "
        "allowed: ask for less, or set the harmonics yourself."
    )
    NOT_CONVERGED = (
        "No solution was found at this frequency: try more harmonics, or a sweep that passes through it."
    )
    RATCHETS = (
        "There is no periodic motion: a part that contacts alone hold ratchets, it drifts a little further "
        "every period. Press it harder, take away what pulls it to one side, or hold it by a spring."
    )
    UNDAMPED = (
        "At this frequency there is a resonance and no damping, so that nothing bounds the "
        "response: give the structure some (damping_ratio = 0.001, say)."
    )
    TOO_STIFF = (
        "A contact is so much stiffer than the structure that what it deforms is lost in the rounding of its "
        "motion: lower kt. Above a million times the structure's stiffness the response no longer depends on "
        "it."
    )
    POWER_LOST = (
        "The balance is satisfied as far as rounding shows, but the power put in is not what is dissipated: "
        "no such motion exists. Press parts that contacts alone hold harder, hold them by a spring, or lower "
        "kt."
    )
    RIGID_OPENS = (
        "A contact with kn = inf opens under its load: what happens where it closes again is an impact, "
        "which takes a law of its own. Press it harder, or give it a finite kn."
    )
    NO_ORBIT = (
        "The events of the contacts were followed for thousands of periods without a motion that repeats: "
        "change the frequency a little, give some damping, or look at a march, it may have another period."
    )
    LAW_FAILED = (
        "The law of a contact gives no finite force that repeats from period to period for a motion tried: "
        "look at its functions and parameters, or give it more samples."
    )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Solution(Drawn):
    """A periodic response at one frequency."""

    VIEWS: ClassVar = Views("solver.views", "responses:solution", "of_solution", "solution_dataset")
    JSON: ClassVar = (
        "scene measured=scene.measured frequency_hz converged status max_abs half_peak_to_peak mean"
        " harmonics flags notes contacts stable=stability.stable stable_ground=stability.ground"
        " unique unique_ground residual error_estimate n_harmonics newton_iterations seconds"
        " drift_per_period mean_range"
    )

    scene: Annotated[Scene, "What vibrates."]
    frequency_hz: Annotated[float, "Of the excitation [Hz]."]
    n_harmonics: Annotated[int, "The number asked for."]
    status: Annotated[SolutionStatus, "Whether and why; every number below is NaN where it is none."]
    max_abs: Annotated[
        FloatOrNaN,
        "Largest of the observed DOF over the period [m]. Not unique when `flags` has ``mean_undetermined``: "
        "it and the mean then depend on the history, and with ``history_dependent`` half peak to peak too. "
        "Without these flags they are what a start from rest with contacts free of force leads to.",
    ]
    half_peak_to_peak: Annotated[FloatOrNaN, "(max x - min x) / 2 of it [m]."]
    mean: Annotated[FloatOrNaN, "Its mean [m]."]
    harmonics: Annotated[
        Real,
        "|mean| and the amplitude of each harmonic of the observed DOF [m], up to the highest one kept: "
        "that is above `n_harmonics` where a force is. Zero if not kept. (H + 1,).",
    ]
    observed: Annotated[Real, "Its coefficients [m], (2H + 1,)."]
    contacts: Annotated[tuple[ContactResponse, ...], "One for each contact of the scene."]
    flags: Annotated[
        tuple[str, ...],
        "``mean_undetermined``, ``history_dependent``, ``all_stuck``, ``separation``, ``not_unique``, "
        "``symmetric_unstable``, ``travelling_wave_assumed`` where they apply; for the last three see "
        "`solver.continuation.branches.symmetry_breaking`. ``mean_load_above_friction`` of what ratchets "
        "because its contacts cannot hold its mean load (`solver.balance.mean_loads`).",
    ]
    residual: Annotated[FloatOrNaN, "Relative residual of the balance."]
    error_estimate: Annotated[
        FloatOrNaN,
        "Estimated error of `max_abs` by the harmonics left out and the residual [m]; of "
        "`half_peak_to_peak` where the mean is not determined. See "
        "`solver.continuation.extrema.error_estimate`.",
    ]
    newton_iterations: Annotated[int, "What it took."]
    seconds: Annotated[float, "Time taken [s]."]
    mean_range: Annotated[
        tuple[float, float],
        "Bounds of the mean over every history [m], forces left in contacts by assembly included; NaN "
        "where no bound is known. See `solver.response.history_dependence`.",
    ] = (math.nan, math.nan)
    _judged: list[Verdict] = field(default_factory=list, init=False, compare=False)  # once, when asked for
    _drifts: list[float] = field(default_factory=list, init=False, compare=False)

    @classmethod
    def without_numbers(
        cls, *, highest: int, residual: float = math.nan, newton_iterations: int = 0,
        flags: tuple[str, ...] = (), **told: Any,
    ) -> Solution:  # fmt: skip
        """Return what stands for a response that was not found; `highest` harmonic of its arrays."""
        return cls(
            **told, max_abs=math.nan, half_peak_to_peak=math.nan, mean=math.nan, contacts=(), flags=flags,
            harmonics=np.full(highest + 1, np.nan), observed=np.full(2 * highest + 1, np.nan),
            residual=residual, error_estimate=math.nan, newton_iterations=newton_iterations,
        )  # fmt: skip

    @property
    def converged(self) -> bool:
        """Whether the numbers are a solution."""
        return self.status in (SolutionStatus.CONVERGED, SolutionStatus.ACCURACY_NOT_REACHED)

    @property
    def highest_harmonic(self) -> int:
        """The last one in `harmonics`, H of every (2H + 1,) array."""
        return int(self.harmonics.size) - 1

    @property
    def notes(self) -> tuple[Note, ...]:
        """What of the scene is hardly meant."""
        found: tuple[Note, ...] = on_demand("solver.response.plausibility:plausibility")(self.scene)
        return found

    @property
    def uniqueness(self) -> Uniqueness:
        """Whether the scene is proven to have no other response at this frequency, and why."""
        found: Uniqueness = on_demand("solver.response.stability.verdict:uniqueness")(
            self.scene, self.frequency_hz
        )
        return found

    @property
    def stability(self) -> Verdict:
        """Whether it is stable, and how that is known; found when asked for, and not where it costs much."""
        if not self._judged:
            self._judged.append(on_demand("solver.response.stability.verdict:of_solution")(self))
        return self._judged[0]

    @property
    def stable(self) -> Stable:
        """Whether small perturbations die out: yes, no, or not known."""
        return self.stability.stable

    @property
    def ratchets(self) -> bool:
        """Whether a part that contacts alone hold drifts a little further every period."""
        return self.status is SolutionStatus.RATCHETS

    @property
    def drift_per_period(self) -> FloatOrNaN:
        """How far what RATCHETS drifts in a period [m]; found when asked for (`solver.response.drift`).

        It is the largest of all DOFs; infinite where a mean load above friction speeds it up without end,
        NaN where there is none or it is not known.
        """
        if not self.ratchets:
            return math.nan
        if not self._drifts:
            self._drifts.append(on_demand("solver.response.drift:of_solution")(self))
        return self._drifts[0]

    def to_json(self, *, with_stability: bool = False) -> dict[str, Any]:
        """Return the answer as one JSON object; on request with what `solver.stability` says, which costs."""
        if with_stability:
            found = (
                on_demand("solver.response.stability.floquet:stability")(self).to_json()
                if self.converged
                else None
            )
            return {**self.to_json(), "stability": found}
        only = self.uniqueness
        found = self._json(
            harmonics=self.harmonics if self.converged else None,
            contacts={contact.name: contact.state for contact in self.contacts},
            unique=only.unique, unique_ground=only.ground,
        )  # fmt: skip
        told = {"drift_per_period": self.ratchets, "mean_range": MEAN_UNDETERMINED in self.flags}
        return {key: value for key, value in found.items() if told.get(key, True)}


def check_converged(solution: Solution) -> None:
    """Raise SettingError where there is no response to go on from."""
    if not solution.converged:
        raise SettingError("solution", solution.status.value, "must have converged")
