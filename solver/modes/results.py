"""A nonlinear mode: what `nonlinear_mode` returns, and what can be read off it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar

import numpy as np

from solver.errors import SettingError
from solver.jit import fourier
from solver.jit.fourier import Complex, Integer, Real
from solver.modes.corrector import State
from solver.response.contact_response import ContactState, state_of
from solver.results.base import Drawn
from solver.results.told import json_numbers
from solver.results.views import Views
from solver.scene.scene import Scene
from solver.wording import listing


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
class NonlinearMode(Drawn):
    """Frequency and damping ratio of a mode over its amplitude; n points along the curve.

    Attributes
    ----------
    scene : Scene
        As it was solved: with the engine order of the nodal diameter.
    mode : int
        Number of the linear mode it begins with, the contacts as they are at rest, 1 the slowest.
    nodal_diameter : int or None
        Of harmonic 1; None of a structure without sectors.
    amplitude : (n,) array
        a with a² = Σ Q_kᴴ M Q_k over the harmonics k ≥ 1, of one sector if cyclic [√kg m].
    frequency_hz, damping_ratio : (n,) array
        ω / 2π and ζ.
    frequency_error, damping_error : (n,) array
        Estimates of what more harmonics would change: a Newton step with twice as many. NaN if not asked for.
    max_abs : (n,) array
        max|x| of the observed DOF [m].
    states : (n, n_contacts) array
        What each contact does over the period, see `contact_states`.
    residual : (n,) array
        Relative residual of the equations.
    contact_motions, contact_forces : (n, n_ports, 2H + 1) array
        Coefficients of the relative motions [m] and of the forces along them [N]; port after port of each
        contact.
    dof_motions : (n, n_dofs, 2H + 1) array
        Coefficients of every DOF [m], of one sector if cyclic. Harmonic 1 lags the excitation's by 90°.
    forcing : (n,) array
        |Qᴴ f| of the scene's own excitation and the mass-normalised mode Q_1 / a [N/√kg].
    points : tuple of State
        The unknowns of every point, for `solver.mode_gradient`; `whole_matrices` says of which equations.
    """

    VIEWS: ClassVar = Views("solver.views", "of_mode", "mode_dataset", "modes:mode_figure")

    scene: Scene
    mode: int
    nodal_diameter: int | None
    n_harmonics: int
    status: NonlinearModeStatus
    amplitude: Real
    frequency_hz: Real
    damping_ratio: Real
    frequency_error: Real
    damping_error: Real
    max_abs: Real
    states: Integer
    residual: Real
    contact_motions: Real
    contact_forces: Real
    dof_motions: Real
    forcing: Real
    points: tuple[State, ...]
    whole_matrices: bool
    newton_iterations: int
    rejected_steps: int
    seconds: float

    @property
    def completed(self) -> bool:
        """Whether the curve reaches the amplitude asked for."""
        return self.status is NonlinearModeStatus.COMPLETED

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of the contacts, as `states` has them."""
        return tuple(contact.name for contact in self.scene.contacts)

    def contact_states(self, i: int) -> dict[str, ContactState]:
        """What each contact does at point i."""
        return {
            name: state_of(int(code)) for name, code in zip(self.contact_names, self.states[i], strict=True)
        }

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
        if contact not in self.contact_names:
            raise SettingError("contact", contact, f"must be one of {listing(self.contact_names)}")
        if isinstance(samples, bool) or not isinstance(samples, int) or samples < 2:
            raise SettingError("samples", samples, "must be a whole number from 2")
        at = self.contact_names.index(contact)
        ports = np.cumsum([0, *(len(each.end_keys) for each in self.scene.contacts)])
        motions = self.contact_motions[i, ports[at] : ports[at + 1]]
        given = self.scene.contacts[at].at_frequency(2.0 * math.pi * float(self.frequency_hz[i]))
        tau = np.asarray(2.0 * math.pi / samples * np.arange(samples), dtype=np.float64)
        basis = fourier.basis(tau, (motions.shape[1] - 1) // 2)
        return basis @ motions[0], given.force_at(motions, given.normal_load(motions), tau)

    def to_json(self) -> dict[str, Any]:
        """Return the curve as one JSON object."""
        states = [[state_of(int(code)).value for code in row] for row in self.states]
        return {
            "scene": self.scene.name,
            "mode": self.mode,
            "nodal_diameter": self.nodal_diameter,
            "completed": self.completed,
            "status": self.status.value,
            "amplitude": self.amplitude.tolist(),
            "frequency": self.frequency_hz.tolist(),
            "damping_ratio": self.damping_ratio.tolist(),
            "frequency_error": json_numbers(self.frequency_error),
            "damping_error": json_numbers(self.damping_error),
            "dof": self.scene.observe.dof,
            "max_abs": self.max_abs.tolist(),
            "contacts": list(self.contact_names),
            "states": states,
            "n_harmonics": self.n_harmonics,
            "newton_iterations": self.newton_iterations,
            "rejected_steps": self.rejected_steps,
            "seconds": self.seconds,
        }
