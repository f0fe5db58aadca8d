"""The force of one contact under a motion that is given, with its derivatives by parameter paths.

A rig that measures a hysteresis loop prescribes the slip motion, so the law alone is asked: its coefficients
in closed form, and their derivatives by one evaluation for each path that acts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solver.balance.balance import Balance
from solver.balance.parameter_derivatives import contact_slopes, force_along, resolved
from solver.balance.workspace import Workspace
from solver.contacts.kernels.stick_slip_events import FAILED
from solver.contacts.kernels.system import evaluation_by_value
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.wording import listing


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
        names = [each.name for each in balance.scene.contacts]
        if contact not in names:
            raise SettingError("contact", contact, f"must be one of {listing(names)}")
        at, system = names.index(contact), balance.system
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
