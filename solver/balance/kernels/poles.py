"""Resonances of structures in modes whose contacts are springs."""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.system import System
from solver.jit.fourier import Real
from solver.jit.separate import apart


@apart
def spring_poles(system: System, stiffness: Real, at: Real, half_width: Real) -> None:
    """Fill the resonances with a spring at every port, of a system whose form is MODES.

    Parameters
    ----------
    stiffness : (nc,) of the springs, less the shift [N/m].
    at, half_width : (ns, nm) in units of kω, ascending; damping is that of the modes to first order; filled.
    """
    ns, nm = system.eigenvalues.shape
    matrix = np.empty((nm, nm), np.complex128)
    for s in range(ns):
        for a in range(nm):
            for b in range(nm):
                total = complex(system.eigenvalues[s, a].real if a == b else 0.0)
                for c in range(stiffness.size):
                    total += system.contact_duals[s, c, a] * stiffness[c] * system.contact_modes[s, c, b]
                matrix[a, b] = total
        squares, shapes = np.linalg.eigh(matrix)
        for m in range(nm):
            width = 0.0
            for n in range(nm):
                width += 0.5 * abs(shapes[n, m]) ** 2 * system.dampings[s, n]
            at[s, m], half_width[s, m] = math.sqrt(max(squares[m], 0.0)), width
