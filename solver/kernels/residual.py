"""The balance at one (u, λ): residual, Jacobian and derivative by λ from the contact forces."""

from __future__ import annotations

import math

import numpy as np

from solver.fourier import Real, coefficient_count, cosine_position
from solver.kernels.compiled import compiled, out_of_line
from solver.kernels.events import FAILED, piece_of
from solver.kernels.force import contact_force
from solver.kernels.linear import copy_block, fill_block
from solver.kernels.system import (
    FRICTION,
    KT,
    LOAD_AMPLITUDE,
    LOAD_COEFFICIENTS,
    LOAD_PHASE,
    LOAD_RATIO,
    MU,
    N0,
    N1,
    NORMAL_LOAD,
    PHASE,
    RATIO,
    STIFFNESS,
    Evaluation,
    Receptance,
    System,
)

# Put on the slope of a mean where contacts alone hold a part: once they all slip nothing does, and it stays.
LOOSE = 1e-9


@compiled
def contact_values(system: System, p: float, added: float) -> tuple[Real, Real, Real, Real]:
    """Return the contacts at λ = p: table, load coefficients (nc, 3), and the derivatives of both by λ.

    `added` [N] is put on every mean load (the start-up ladder presses the contacts into full stick).
    """
    out_of_line()
    nc = system.contacts.shape[0]
    table, slope = np.empty((nc, 6)), np.zeros((nc, 6))
    copy_block(table, system.contacts)
    for c in range(nc):
        row, d = table[c], slope[c]
        tied = not math.isnan(row[RATIO])
        if system.active[c] > 0.0:
            if system.kind == NORMAL_LOAD:
                row[N0], d[N0] = p, 1.0
            elif system.kind == LOAD_AMPLITUDE:
                row[N1], d[N1], tied = p, 1.0, False
            elif system.kind == LOAD_RATIO:
                row[RATIO], d[RATIO], tied = p, 1.0, True
            elif system.kind == LOAD_PHASE:
                row[PHASE], d[PHASE] = p, 1.0
            elif system.kind == STIFFNESS:
                row[KT], d[KT] = p, 1.0
            elif system.kind == FRICTION:
                row[MU], d[MU] = p, 1.0
        if tied:
            row[N1] = row[RATIO] * row[N0]
            d[N1] = row[RATIO] * d[N0] + d[RATIO] * row[N0]
    load, dload = np.empty((nc, LOAD_COEFFICIENTS)), np.empty((nc, LOAD_COEFFICIENTS))
    for c in range(nc):
        cosine, sine = math.cos(table[c, PHASE]), math.sin(table[c, PHASE])
        amplitude, turn = table[c, N1], slope[c, PHASE]
        load[c, 0], dload[c, 0] = table[c, N0] + added, slope[c, N0]
        load[c, 1], load[c, 2] = amplitude * cosine, -amplitude * sine
        dload[c, 1] = slope[c, N1] * cosine - amplitude * sine * turn
        dload[c, 2] = -slope[c, N1] * sine - amplitude * cosine * turn
    return table, load, slope, dload


@compiled
def evaluate(system: System, linear: Receptance, u: Real, p: float, added: float, out: Evaluation) -> float:
    """Evaluate the balance at (u, λ = p) for a receptance already filled at p.

    Returns
    -------
    The relative residual: max|r| over the largest |ū|, and |u| and |A F| of harmonics ≥ 1 (NaN if a contact
    failed, or Z is singular).
    """
    out_of_line()
    nc, n = system.contacts.shape[0], coefficient_count(system.ks)
    for i in range(system.ks.size):
        if not math.isfinite(linear.x_linear[0, i].real):
            return np.nan
    table, load, slope, dload = contact_values(system, p, added)
    for c in range(nc):
        U = u[c * n : (c + 1) * n]
        state, count = contact_force(
            U, system.ks, load[c], system.load_ks, table[c, KT], table[c, MU], system.cos_table,
            system.sin_table, out.segments, out.dF_dU[c], out.dF_dkt[c], out.dF_dmu[c], out.dF_dN[c],
            out.F[c],
        )  # fmt: skip
        out.states[c], out.pieces[c] = state, piece_of(out.segments, count)
        if state == FAILED:
            return np.nan
        for i in range(n):
            total = slope[c, KT] * out.dF_dkt[c, i] + slope[c, MU] * out.dF_dmu[c, i]
            for j in range(LOAD_COEFFICIENTS):
                total += out.dF_dN[c, i, j] * dload[c, j]
            out.dF_dp[c, i] = total
    return _assemble(system, linear, u, out)


@compiled
def _assemble(system: System, linear: Receptance, u: Real, out: Evaluation) -> float:
    """Put r, dr/du and dr/dλ together from the contact forces and the receptance."""
    nc, n = system.contacts.shape[0], coefficient_count(system.ks)
    r, J, dr = out.residual, out.jacobian, out.dr_dp
    fill_block(J, 0.0)
    scale, largest_residual = 0.0, 0.0
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        for c in range(nc):
            row = c * n + here
            response, dresponse = complex(0.0), complex(0.0)
            for d in range(nc):
                a, da = linear.A[0, i, c, d], linear.A[1, i, c, d]
                at = d * n + here
                stiffness = system.shift[d]
                fc = out.F[d, here] - stiffness * u[at]
                fs, dfs = 0.0, 0.0
                if has_sine:
                    fs = out.F[d, here + 1] - stiffness * u[at + 1]
                    dfs = out.dF_dp[d, here + 1]
                force, dforce = complex(fc, -fs), complex(out.dF_dp[d, here], -dfs)
                response += a * force
                dresponse += a * dforce + da * force
                _add_block(J, out.dF_dU[d], stiffness, row, d * n, here, a, has_sine)
            free, dfree = linear.u_linear[0, i, c], linear.u_linear[1, i, c]
            scale = max(scale, abs(free))
            if has_sine:
                # The mean of a part that nothing holds may drift without bound: it must not hide a residual.
                scale = max(scale, abs(response), abs(u[row]))
            r[row] = u[row] - free.real + response.real
            dr[row] = -dfree.real + dresponse.real
            J[row, row] += 1.0
            if not has_sine and system.shift[c] > 0.0:
                J[row, row] += LOOSE
            largest_residual = max(largest_residual, abs(r[row]))
            if has_sine:
                r[row + 1] = u[row + 1] + free.imag - response.imag
                dr[row + 1] = dfree.imag - dresponse.imag
                J[row + 1, row + 1] += 1.0
                largest_residual = max(largest_residual, abs(r[row + 1]))
    if scale == 0.0:
        return largest_residual
    return largest_residual / scale


@compiled
def _add_block(
    J: Real, dF_dU: Real, stiffness: float, row: int, column: int, here: int, a: complex, has_sine: bool
) -> None:
    """Add A_k[c, d] ∂F_d/∂U_d to the rows of harmonic k of contact c."""
    n = dF_dU.shape[0]
    real, imag = a.real, a.imag
    if not has_sine:
        for j in range(n):
            J[row, column + j] += real * dF_dU[here, j]
        J[row, column + here] -= real * stiffness
        return
    for j in range(n):
        cosine, sine = dF_dU[here, j], dF_dU[here + 1, j]
        J[row, column + j] += real * cosine + imag * sine
        J[row + 1, column + j] += real * sine - imag * cosine
    J[row, column + here] -= real * stiffness
    J[row, column + here + 1] -= imag * stiffness
    J[row + 1, column + here + 1] -= real * stiffness
    J[row + 1, column + here] += imag * stiffness
