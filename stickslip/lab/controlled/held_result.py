"""Responses of one amplitude over the frequency: what `held_amplitude` returns."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from solver.arrays import Real
from solver.modes.mode_results import OF_CONTACTS, ModalCurve
from solver.results.base import Data, Views


class HeldStatus(Enum):
    """How a curve ended; the value is a sentence a user can act on."""

    COMPLETED = "The curve reaches the end of the range."
    NOT_BEGUN = (
        "No response with this amplitude was found at the first frequency: begin elsewhere, with a smaller "
        "amplitude, or fewer harmonics."
    )
    STOPPED = "The curve could not be followed beyond its last point: try other harmonics."
    TURNED_BACK = (
        "The curve turned back and left the range where it began: no response has this amplitude beyond."
    )
    TOO_LONG = "The end of the range was not reached within the points allowed: ask for more of them."
    CANCELLED = "It was cancelled; the points up to then are there."


class LeastForce(NamedTuple):
    """The least factor on the excitation along a curve, and its frequency [Hz]; NaN without a point."""

    excitation: float
    frequency: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class HeldAmplitude(ModalCurve):
    """Responses of one amplitude over the frequency, at the DOF that the scene observes; n points."""

    VIEWS: ClassVar = Views("solver.views", "disks:held", "disks:held_figure")
    DATA: ClassVar = Data(
        "controlled", {"point": "frequency=frequency_hz excitation excitation_error phase=phase_deg"
         " max_abs stable=stable_words", **OF_CONTACTS, "point harmonic": "observed"},
        "amplitude=held harmonics=n_harmonics",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene dof=scene.observe.dof amplitude=held completed=reached status frequency=frequency_hz"
        " excitation excitation_error phase=phase_deg max_abs contacts=contact_names states=state_words"
        " changes stable stability_unknown=unknown least n_harmonics seconds"
    )

    held: Annotated[float, "Amplitude of harmonic 1 of the observed DOF [m]."]
    n_harmonics: Annotated[int, "Highest harmonic kept."]
    status: Annotated[HeldStatus, "How the curve ended."]
    frequency_hz: Annotated[Real, "Of the excitation [Hz], (n,)."]
    excitation: Annotated[Real, "Factor on the scene's excitation that this response takes, (n,)."]
    excitation_error: Annotated[
        Real, "Estimate of what more harmonics would change of it: a Newton step with twice as many, (n,)."
    ]
    phase_deg: Annotated[Real, "By which harmonic 1 of the observed DOF leads the excitation [deg], (n,)."]
    stable: Annotated[
        tuple[bool | None, ...],
        "Whether the response is stable while its force is held; None where `unknown` says why not known.",
    ]
    unknown: Annotated[str, "Why stability is not known; empty if it is."]
    observed: Annotated[Real, "Coefficients of the observed DOF [m], (n, 2H + 1)."]
    least: Annotated[
        LeastForce, "The least force, solved for between points: the peak of the response to that force."
    ]

    @property
    def stable_words(self) -> tuple[str, ...]:
        """Whether each response is stable: yes, no, or empty where it is not known."""
        return tuple({None: "", True: "yes", False: "no"}[one] for one in self.stable)

    @property
    def changes(self) -> tuple[tuple[float, float, str], ...]:
        """Where the curve has a kink: two frequencies [Hz] between which a contact changes its state."""
        found = []
        for i in range(len(self.states) - 1):
            for c in np.flatnonzero(self.states[i] != self.states[i + 1]).tolist():
                ends = float(self.frequency_hz[i]), float(self.frequency_hz[i + 1])
                found.append((*ends, self.scene.contacts[c].name))
        return tuple(found)

    def to_json(self) -> dict[str, Any]:
        """Return the curve as one JSON object."""
        changes = [{"from": low, "to": high, "contact": name} for low, high, name in self.changes]
        return self._json(changes=changes, least=self.least if self.excitation.size else None)
