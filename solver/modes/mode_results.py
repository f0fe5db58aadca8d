"""Curves along a mode: what `nonlinear_mode`, `held_amplitude` and `phase_resonance` return."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np

from solver.arrays import Complex, Integer, Real
from solver.errors import SettingError, check_count
from solver.results.base import Data, Drawn, Views
from solver.scene.scene import Scene
from solver.wording import listing

if TYPE_CHECKING:
    from solver.modes.mode_curve import ModeState
    from solver.response.contact_response import ContactState


OF_CONTACTS: Mapping[str, str] = {"contact": "contact=contact_names", "point contact": "state=state_words"}
"""The columns of a data set that say what the contacts do."""


class NonlinearModeStatus(Enum):
    """How a curve ended; the value is a sentence a user can act on."""

    COMPLETED = "The curve reaches the largest amplitude."
    NOT_BEGUN = (
        "No point was found at the smallest amplitude: begin where the contacts still stick, or take fewer "
        "harmonics."
    )
    STOPPED = (
        "The curve could not be followed beyond its last point: try other harmonics, or begin a second one "
        "beyond it."
    )
    TURNED_BACK = "The curve turned back below the smallest amplitude: begin at a smaller one."
    TOO_LONG = "The largest amplitude was not reached within the points allowed: ask for more of them."
    CANCELLED = "It was cancelled; the points up to then are there."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ModalCurve(Drawn):
    """Root of the results that are curves of n points with the states of the contacts along them."""

    scene: Annotated[Scene, "As it was solved: with the engine order of the nodal diameter."]
    max_abs: Annotated[Real, "max|x| of the observed DOF [m], (n,)."]
    states: Annotated[Integer, "What each contact does, see `contact_states`, (n, n_contacts)."]
    residual: Annotated[Real, "Relative residual of the equations, (n,)."]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of the contacts, as `states` has them."""
        return tuple(contact.name for contact in self.scene.contacts)

    @property
    def state_words(self) -> tuple[tuple[str, ...], ...]:
        """What each contact does over the period, at each point, in words."""
        every = (self.contact_states(i).values() for i in range(len(self.states)))
        return tuple(tuple(state.value for state in row) for row in every)

    def contact_states(self, i: int) -> dict[str, ContactState]:
        """What each contact does at point i."""
        # Loaded here: who reads results, or what they are, needs no compiled loops.
        from solver.response.contact_response import state_of

        return dict(zip(self.contact_names, map(state_of, self.states[i].tolist()), strict=True))


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class NonlinearMode(ModalCurve):
    """Frequency and damping ratio of a mode over its amplitude; n points along the curve."""

    VIEWS: ClassVar = Views("solver.views", "disks:mode", "disks:mode_figure")
    DATA: ClassVar = Data(
        "modes", {"point": "amplitude frequency=frequency_hz damping_ratio frequency_error damping_error"
         " max_abs forcing", **OF_CONTACTS, "dof": "dof=scene.dofs",
        "point dof harmonic": "motion=dof_motions"},
        "mode_number=mode harmonics=n_harmonics nodal_diameter",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene mode nodal_diameter completed=reached status amplitude frequency=frequency_hz damping_ratio"
        " frequency_error damping_error dof=scene.observe.dof max_abs contacts=contact_names"
        " states=state_words n_harmonics newton_iterations rejected_steps seconds"
    )

    mode: Annotated[int, "Number of the linear mode it begins with, contacts as at rest, 1 the slowest."]
    nodal_diameter: Annotated[int | None, "Of harmonic 1; None of a structure without sectors."]
    n_harmonics: Annotated[int, "Highest harmonic kept."]
    status: Annotated[NonlinearModeStatus, "How the curve ended."]
    amplitude: Annotated[
        Real, "a with a² = Σ Q_kᴴ M Q_k over the harmonics k ≥ 1, of one sector if cyclic [√kg m], (n,)."
    ]
    frequency_hz: Annotated[Real, "ω / 2π [Hz], (n,)."]
    damping_ratio: Annotated[Real, "ζ, (n,)."]
    frequency_error: Annotated[
        Real,
        "Estimate of what more harmonics would change [Hz]: a Newton step with twice as many, (n,); NaN if "
        "not asked for.",
    ]
    damping_error: Annotated[Real, "The same of the damping ratio, (n,)."]
    contact_motions: Annotated[
        Real, "Coefficients of the relative motions [m], port after port, (n, n_ports, 2H + 1)."
    ]
    contact_forces: Annotated[Real, "Coefficients of the forces along them [N], as many."]
    dof_motions: Annotated[
        Real,
        "Coefficients of every DOF [m], of one sector if cyclic, (n, n_dofs, 2H + 1). Harmonic 1 lags the "
        "excitation's by 90°.",
    ]
    forcing: Annotated[
        Real, "|Qᴴ f| of the scene's own excitation and the mass-normalised mode Q_1 / a [N/√kg], (n,)."
    ]
    points: Annotated[
        tuple[ModeState, ...],
        "The unknowns of every point, for `solver.mode_gradient`; `whole_matrices` says of which equations.",
    ]
    whole_matrices: bool
    newton_iterations: Annotated[int, "Of all points."]
    rejected_steps: Annotated[int, "Steps that were tried again."]

    def shape(self, i: int) -> Complex:
        """Return harmonic 1 of every DOF over the amplitude, (n_dofs,) [1/√kg], at point i."""
        cosine, sine = self.dof_motions[i, :, 1], self.dof_motions[i, :, 2]
        return np.asarray((cosine - 1j * sine) / self.amplitude[i])

    def loop(self, i: int, contact: str, *, samples: int = 512) -> tuple[Real, Real]:
        """Return motion [m] and force [N] of a contact over one period at point i, (samples,) each.

        Of a contact with several relative motions they are the first. The force is the one the law gives,
        with its corners.

        Raises
        ------
        SettingError
            An unknown contact, or fewer than 2 samples.
        """
        # Loaded here: who reads results, or what they are, needs no compiled loops.
        from solver.jit.fourier import basis

        if contact not in self.contact_names:
            raise SettingError("contact", contact, f"must be one of {listing(self.contact_names)}")
        check_count("samples", samples, 2)
        at = self.contact_names.index(contact)
        ports = np.cumsum([0, *(len(each.end_keys) for each in self.scene.contacts)])
        motions = self.contact_motions[i, ports[at] : ports[at + 1]]
        given = self.scene.contacts[at].at_frequency(2.0 * math.pi * float(self.frequency_hz[i]))
        tau = np.asarray(2.0 * math.pi / samples * np.arange(samples), dtype=np.float64)
        waves = basis(tau, (motions.shape[1] - 1) // 2)
        return waves @ motions[0], given.force_at(motions, given.normal_load(motions), tau)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PhaseResonance(ModalCurve):
    """Responses in phase resonance over the amplitude; n points along the curve."""

    VIEWS: ClassVar = Views("solver.views", "disks:mode", "disks:resonance_figure")
    DATA: ClassVar = Data(
        "phase-resonance", {"point": "amplitude frequency=frequency_hz excitation max_abs"},
        "mode_number=mode",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene mode completed=reached status amplitude frequency=frequency_hz excitation"
        " dof=scene.observe.dof max_abs contacts=contact_names states=state_words seconds"
    )

    mode: Annotated[int, "Number of the linear mode it begins with."]
    status: Annotated[NonlinearModeStatus, "How the curve ended."]
    amplitude: Annotated[Real, "Modal amplitude a [√kg m], (n,)."]
    frequency_hz: Annotated[Real, "Of the excitation [Hz], (n,)."]
    excitation: Annotated[
        Real, "Factor on the scene's excitation that this response takes; below 0 it lags by 270°, (n,)."
    ]
