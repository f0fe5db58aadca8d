"""Many observed DOFs at one solution: the modes move once, and each DOF is a sum over them."""

from __future__ import annotations

import numpy as np

from solver.balance.kernels.output import force_slope, measure_motion
from solver.balance.kernels.residual import evaluate_contacts
from solver.contacts.kernels.system import FREQUENCY, Evaluation, System
from solver.jit.fourier import Complex, Real, coefficient_count, cosine_position
from solver.jit.separate import apart
from solver.linear.kernels.dynamic_stiffness import fill_terms
from solver.linear.kernels.receptance import excitation


@apart
def modal_motion(
    system: System, u: Real, p: float, point: Evaluation, du: Real, dp: float, amplitudes: Complex
) -> None:
    """Fill in the modal coordinates q̂ = (f̂ − Yᴴ (F̂ − shift û)) / d and their change for (du, dλ).

    Parameters
    ----------
    point : the balance evaluated at (u, λ = p), with derivatives.
    amplitudes : (2, nk, nm) value and change.
    """
    omega = p if system.kind == FREQUENCY else system.omega
    by_omega = 1.0 if system.kind == FREQUENCY else 0.0
    nc, n, nm = system.owner.size, coefficient_count(system.ks), system.eigenvalues.shape[1]
    dF, terms, force = np.empty((nc, n)), np.empty((4, nm)), np.empty((2, nm), np.complex128)
    force_slope(system, point, du, dp, dF)
    for i in range(system.ks.size):
        s, here, has_sine = system.which[i], cosine_position(system.ks, i), system.ks[i] > 0
        fill_terms(system, s, 0, nm, float(system.ks[i]), omega, by_omega, terms)
        f, df = excitation(system, p, system.ks[i])
        for m in range(nm):
            force[0, m], force[1, m] = f * system.modal_forces[i, m], dp * df * system.modal_forces[i, m]
        for c in range(nc):
            at = c * n + here
            fc, dfc = point.F[c, here] - system.shift[c] * u[at], dF[c, here]
            fs, dfs = 0.0, 0.0
            if has_sine:
                fs, dfs = point.F[c, here + 1] - system.shift[c] * u[at + 1], dF[c, here + 1]
            here_force, change = complex(fc, -fs), complex(dfc, -dfs)
            row = system.contact_duals[s, c]
            for m in range(nm):
                force[0, m] -= row[m] * here_force
                force[1, m] -= row[m] * change
        for m in range(nm):
            term, slope = complex(terms[0, m], terms[1, m]), complex(terms[2, m], terms[3, m])
            amplitudes[0, i, m] = term * force[0, m]
            amplitudes[1, i, m] = term * force[1, m] + dp * slope * force[0, m]


@apart
def measure_through_modes(
    system: System, point: Evaluation, seen: Complex, solutions: Real, tangents: Real, x: Real, out: Real
) -> None:
    """Fill what `solver.balance.kernels.output.measure` does of several DOFs at points of a branch.

    Parameters
    ----------
    seen : (d, ns, nm) of each DOF, as `System.observe_modes`.
    solutions, tangents : (P, nt + 1) the points, λ last.
    x, out : (d, P, n) and (d, P, MEASURES), of which residual and what is lost are left as they are.
    """
    last, amplitudes = solutions.shape[1] - 1, np.empty((2, *system.modal_forces.shape), np.complex128)
    dx = np.empty(x.shape[2])
    for row in range(solutions.shape[0]):
        u, p = solutions[row, :last], solutions[row, last]
        evaluate_contacts(system, u, p, 0.0, False, point)  # at a solution no contact fails
        modal_motion(system, u, p, point, tangents[row, :last], tangents[row, last], amplitudes)
        for j in range(seen.shape[0]):
            for i in range(system.ks.size):
                here, s = cosine_position(system.ks, i), system.which[i]
                value, change = complex(0.0), complex(0.0)
                for m in range(seen.shape[2] if system.only in (-1, system.ks[i]) else 0):
                    value += seen[j, s, m] * amplitudes[0, i, m]
                    change += seen[j, s, m] * amplitudes[1, i, m]
                x[j, row, here], dx[here] = value.real, change.real
                if system.ks[i] > 0:
                    x[j, row, here + 1], dx[here + 1] = -value.imag, -change.imag
            measure_motion(system, point, x[j, row], dx, out[j, row])
