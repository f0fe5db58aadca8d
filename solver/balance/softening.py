"""A solution from nothing by contacts that are soft at first: tangential stiffness is raised to its own.

Stiff contacts that slip far beyond what their springs give are nearly rigid friction, where Newton's method
from full stick wanders. With springs so soft that no contact slips the response is found at once; on the way
to the stiffness given each solution is the guess of the next.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.newton import from_stuck, newton
from solver.contacts.kernels.columns import KT, KT_SECOND
from solver.contacts.kernels.system import Evaluation, Receptance, System, by_reference
from solver.jit.fourier import Real
from solver.linear.kernels.receptance import receptance

SOFTEST = 1e-4  # share of the stiffness to begin with
_FACTOR, _LARGEST, _LEAST = 10.0, 100.0, 1.1  # from one stiffness to the next
_FEW = 8  # iterations up to which the next factor is larger


def solve_softened(
    system: System, linear: Receptance, point: Evaluation, u: Real, p: float
) -> tuple[bool, int, float]:
    """Raise the tangential stiffness of every contact to its own, the result in `u`; as `newton`."""
    contacts, own = system.contacts, by_reference(system)

    def softened(share: float) -> System:
        table = contacts.copy()
        table[:, [KT, KT_SECOND]] *= share
        return by_reference(system._replace(contacts=table))

    here, factor = SOFTEST, _FACTOR
    good, spent, norm = from_stuck(softened(here), linear, u, p, point)
    while good and here < 1.0:
        ahead, trial = min(1.0, here * factor), u.copy()
        receptance(own, p, linear)
        closer, more, norm = newton(softened(ahead), linear, trial, p, 0.0, point)
        spent += more
        if closer:
            u[:], here = trial, ahead
            factor = min(_LARGEST, factor**2) if more <= _FEW else factor
        else:
            factor = math.sqrt(factor)
            good = factor > _LEAST
    return bool(good), int(spent), float(norm) if good else np.inf
