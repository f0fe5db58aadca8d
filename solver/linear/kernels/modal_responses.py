"""What forces at the contacts move at one λ, through the modes: without the receptance between all pairs.

A_k F = X diag(1/d) Yᴴ F takes ports × modes products where the entries of A_k take ports² × modes. That is
what a residual needs whose derivatives are not asked for, at frequencies that are looked at once.
"""

from __future__ import annotations

import numpy as np

from solver.contacts.kernels.system import DENSE, FREQUENCY, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex
from solver.jit.separate import apart
from solver.linear.kernels.dynamic_stiffness import fill_terms
from solver.linear.kernels.receptance import BLOCK, add_driven_modes, fill_driven, scale_driven


@compiled
def goes_through_modes(system: System) -> bool:
    """Whether a structure has modes, or poles, and their way costs less: every port leads."""
    return bool(system.form != DENSE and system.leading.size == system.owner.size and system.owner.size > 1)


@apart
def driven_motions(system: System, p: float, out: Receptance) -> None:
    """Fill in the motions under the excitation at λ = p, with derivatives; A and B stay what they were."""
    omega = p if system.kind == FREQUENCY else system.omega
    by_omega = 1.0 if system.kind == FREQUENCY else 0.0
    nc, most = out.B.shape[2], min(BLOCK, system.eigenvalues.shape[1])
    driven, terms = np.empty((2 * (nc + 1), most)), np.empty((4, most))
    out.x_linear[:], out.u_linear[:] = 0.0, 0.0
    for i in range(system.ks.size):
        s = system.which[i]
        for first in range(0, system.eigenvalues.shape[1], BLOCK):
            size = min(BLOCK, system.eigenvalues.shape[1] - first)
            if fill_driven(system, s, first, size, i, driven):
                fill_terms(system, s, first, size, float(system.ks[i]), omega, by_omega, terms)
                add_driven_modes(size, i, driven, terms, out)
    scale_driven(system, p, out)


@apart
def modal_responses(system: System, p: float, i: int, forces: Complex, motions: Complex) -> None:
    """Fill the motions (nc,) of all ports that forces (nc,) of harmonic number i make at λ = p."""
    omega = p if system.kind == FREQUENCY else system.omega
    nc, most = forces.size, min(BLOCK, system.eigenvalues.shape[1])
    s, k = system.which[i], float(system.ks[i])
    terms, real, imag = np.empty((4, most)), np.empty(most), np.empty(most)
    modes, duals = system.contact_modes[s], system.contact_duals[s]
    motions[:] = 0.0
    for first in range(0, system.eigenvalues.shape[1], BLOCK):
        size = min(BLOCK, system.eigenvalues.shape[1] - first)
        fill_terms(system, s, first, size, k, omega, 0.0, terms)
        real[:], imag[:] = 0.0, 0.0
        for d in range(nc):
            f, g, row = forces[d].real, forces[d].imag, duals[d]
            for m in range(size):
                y = row[first + m]
                real[m] += y.real * f - y.imag * g
                imag[m] += y.real * g + y.imag * f
        for m in range(size):
            a, b = real[m], imag[m]
            real[m] = a * terms[0, m] - b * terms[1, m]
            imag[m] = a * terms[1, m] + b * terms[0, m]
        for c in range(nc):
            f, g, row = 0.0, 0.0, modes[c]
            for m in range(size):
                x = row[first + m]
                f += x.real * real[m] - x.imag * imag[m]
                g += x.real * imag[m] + x.imag * real[m]
            motions[c] += complex(f, g)
