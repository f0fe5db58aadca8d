"""What is measured, with exact derivatives by any number of parameters: of a response, and of one contact.

A measurement is a linear functional Re Σ turn_k x̂_k of the observed motion, or is one to first order: an
amplitude |x̂_k| with turn = conj(x̂_k)/|x̂_k|, an extreme with turn = ξ e^{ikτ} because its place is stationary.
Each costs one adjoint solve with the factorisation they share (`solver.sensitivity.kernels.adjoint`).

A rig that measures a hysteresis loop prescribes the slip motion, so the law alone is asked: its coefficients
in closed form, and their derivatives by one evaluation for each path that acts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated

import numpy as np

from solver.balance.balance import Balance, contact_index
from solver.balance.parameter_derivatives import contact_slopes, force_along, resolved
from solver.balance.workspace import PointSolution, Workspace
from solver.contacts.kernels.stick_slip_events import FAILED
from solver.contacts.kernels.system import evaluation_by_value
from solver.errors import SettingError
from solver.jit.fourier import Complex, Integer, Real
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.kernels.adjoint import AMPLITUDE, SIGN, TAU, observe, slopes_along

TWO_PI = 2.0 * math.pi


class Quantity(Enum):
    """What is measured of the motion; the value is the word a user writes."""

    AMPLITUDE = "amplitude"
    COMPLEX = "complex"
    MAX_ABS = "max_abs"
    HALF_PEAK_TO_PEAK = "half_peak_to_peak"


@dataclass(frozen=True, slots=True, kw_only=True)
class Observed:
    """What is measured at a solution."""

    values: Annotated[Real, "(1,) array, of a complex amplitude (2,) its real and imaginary part [m]."]
    slopes: Annotated[
        Real, "(1 or 2, n_paths) array, their derivatives at a fixed frequency [m per unit of each]."
    ]
    by_frequency: Annotated[Real, "(1 or 2,) array, their derivatives by the frequency [m/Hz]."]
    states: Annotated[
        Integer, "(n_contacts,) array of state codes, see `solver.response.contact_response.state_of`."
    ]


class ObservedSensitivities(Sensitivities):
    """Measured quantities at points of one frequency response, with derivatives by parameter paths.

    Parameters and errors are those of `Sensitivities`.
    """

    @property
    def workspace(self) -> Workspace:
        """The arrays it works in, which solve too."""
        return self._workspace

    def solve(self, at_hz: float, guesses: tuple[Real, ...]) -> PointSolution:
        """Solve at a frequency by Newton's method from each guess in turn, and at last from nothing."""
        omega = TWO_PI * at_hz
        for guess in guesses:
            found = self._workspace.solve_from(omega, guess)
            if found.converged:
                return found
        return self._workspace.solve(omega)

    def observed(
        self, solution: Real, at_hz: float, quantity: Quantity, harmonic: int = 1
    ) -> Observed | None:
        """Return a quantity of the observed motion at a solution; None where the balance is singular.

        Parameters
        ----------
        solution : (n_unknowns,) slip motions [m], converged.
        at_hz : their frequency [Hz].
        quantity : what is measured.
        harmonic : whose amplitude, of `Quantity.AMPLITUDE` and `Quantity.COMPLEX`; a kept one.

        Raises
        ------
        SettingError
            A harmonic that the balance does not keep.
        """
        u, omega = np.ascontiguousarray(solution, dtype=np.float64), TWO_PI * at_hz
        space = self._workspace
        if not observe(space.system, space.linear, u, omega, space.point, self._x, self._tops):
            return None
        states = self._point.states.copy()
        values = self._aim(quantity, harmonic)
        good = slopes_along(
            space.system, space.linear, u, omega, space.point, self._wanted, values.size, self._turns,
            self._weights, self._pulls, self._by,
        )  # fmt: skip
        if not good:
            return None
        by_omega, slopes = zip(*(self._one(u, omega, row) for row in range(values.size)), strict=True)
        return Observed(
            values=values, slopes=np.array(slopes).reshape(values.size, -1), states=states,
            by_frequency=TWO_PI * np.array(by_omega),
        )  # fmt: skip

    def _aim(self, quantity: Quantity, harmonic: int) -> Real:
        """Fill the turns of a quantity of the motion just observed; return its values."""
        turns, tops, ks = self._turns, self._tops, self.balance.system.ks
        turns[:] = 0.0
        if quantity in (Quantity.MAX_ABS, Quantity.HALF_PEAK_TO_PEAK):
            rows: Complex = tops[:, SIGN, None] * np.exp(1j * np.outer(tops[:, TAU], ks))
            if quantity is Quantity.HALF_PEAK_TO_PEAK:
                turns[0] = 0.5 * (rows[0] + rows[1])
                return np.array([0.5 * float(tops[:, AMPLITUDE].sum())])
            leads = int(tops[1, AMPLITUDE] > tops[0, AMPLITUDE])
            turns[0] = rows[leads]
            return np.array([tops[leads, AMPLITUDE]])
        at = np.flatnonzero(ks == harmonic)
        if not at.size or harmonic < 1:
            raise SettingError(
                "harmonic", harmonic, f"must be one of the harmonics kept, {ks[ks > 0].tolist()}"
            )
        amplitude = complex(self._amplitudes.of(self._x)[at[0]])
        if quantity is Quantity.COMPLEX:
            turns[0, at[0]], turns[1, at[0]] = 1.0, -1j
            return np.array([amplitude.real, amplitude.imag])
        size = abs(amplitude)
        turns[0, at[0]] = amplitude.conjugate() / size if size > 0.0 else 1.0
        return np.array([size])


class LoopSensitivities:
    """The force of a contact with one relative motion, with derivatives.

    Parameters
    ----------
    balance : of a frequency response; its harmonics are those of motion and force.
    contact : name of the contact.
    paths : parameter paths of the scene.

    Raises
    ------
    SettingError
        No such contact, one with several relative motions, or an unknown path.
    """

    def __init__(self, balance: Balance, contact: str, paths: Sequence[str]) -> None:
        at, system = contact_index(balance.scene, contact), balance.system
        if system.first_port[at + 1] - system.first_port[at] != 1:
            raise SettingError("contact", contact, "must be a contact with one relative motion")
        self._balance, self._at = balance, at
        slopes, loads = contact_slopes(balance, resolved(balance, paths))
        self._slopes, self._loads = slopes[:, at].copy(), loads[:, at].copy()
        self._point = evaluation_by_value(Workspace.of(balance).point)

    def force(self, motion: Real, omega: float) -> tuple[Real, Real, int] | None:
        """Return the force under a motion, with its derivatives.

        Parameters
        ----------
        motion : (n,) coefficients of the kept harmonics [m].
        omega : angular frequency [rad/s].

        Returns
        -------
        (n,) coefficients of the force [N], (n_paths, n) their derivatives, and the state code; None where the
        law has no force that repeats.
        """
        found, state = self._law(motion, omega, np.zeros_like(self._slopes[0]), np.zeros_like(self._loads[0]))
        if state == FAILED:
            return None
        force, slopes = found[0], np.zeros((len(self._slopes), motion.size))
        for i, (slope, load) in enumerate(zip(self._slopes, self._loads, strict=True)):
            if np.any(slope != 0.0):
                slopes[i] = self._law(motion, omega, slope, load)[0][1]
        return force, slopes, state

    def _law(self, motion: Real, omega: float, slope: Real, dload: Real) -> tuple[tuple[Real, Real], int]:
        """Return the force and its derivative along (slope, dload), (n,) each, and the state."""
        U = np.asarray(motion).reshape(1, -1)
        force, change, state = force_along(self._balance, self._point, self._at, U, omega, slope, dload)
        return (force[0].copy(), change[0].copy()), state
