"""The contact laws behind one contract: a function of one element, which may have several relative motions.

    law(U, ks, load, load_ks, row, slope, dload, cos_table, sin_table, segments, F, dF_dU, dF_dp)
        → (state, piece)

An element has m ports, each a relative motion with n coefficients: U and F are (m, n), dF_dU is (m·m, n, n)
with ∂F_a/∂U_b in block a·m + b. `row` holds the parameters in the columns of the contact table and `load` the
given normal load; `slope` and `dload` are their derivatives by λ, and dF_dp (m, n) the force's. The state is
one of `solver.contacts.kernels.stick_slip_events` or of those below; the piece numbers the smooth piece of
the law.

Columns beyond those of the elastic Coulomb law: each law has its own meaning for them.
"""

from __future__ import annotations

import numpy as np

from solver.contacts.kernels.columns import (
    A_1,
    COULOMB,
    COULOMB_BOX,
    COULOMB_PLANE,
    ELASTIC_NORMAL,
    GAP,
    GAP_SPRING,
    K_GAP,
    KN,
    KT,
    MU,
    POLYNOMIAL,
)
from solver.contacts.kernels.coulomb import contact_force
from solver.contacts.kernels.elastic_normal import elastic_normal
from solver.contacts.kernels.planar import coulomb_plane
from solver.contacts.kernels.springs import gap_spring, polynomial_spring
from solver.contacts.kernels.stick_slip_events import FAILED, LIFTING, SEPARATED, SLIPPING, STUCK, piece_of
from solver.contacts.kernels.system import N0
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real
from solver.jit.lapack import fill_block
from solver.jit.separate import apart


@apart
def law_force(
    law: int, U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Real, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Evaluate any law; see the module for the arguments. An unknown number is FAILED."""
    if law in (COULOMB, COULOMB_BOX):
        return _coulomb_ports(
            U, ks, load, load_ks, row, slope, dload, cos_table, sin_table, segments, F, dF_dU, dF_dp
        )
    if law == ELASTIC_NORMAL:
        return elastic_normal(
            U, ks, load, load_ks, row, slope, dload, cos_table, sin_table, segments, F, dF_dU, dF_dp
        )
    if law == GAP_SPRING:
        return gap_spring(U, ks, row, slope, cos_table, sin_table, F, dF_dU, dF_dp)
    if law == POLYNOMIAL:
        return polynomial_spring(U, ks, row, slope, F, dF_dU, dF_dp)
    if law == COULOMB_PLANE:
        return coulomb_plane(U, ks, load, load_ks, row, slope, dload, F, dF_dU, dF_dp)
    return FAILED, int(law)


@compiled
def is_friction(law: int) -> bool:
    """Return whether a law has a friction limit, beyond which a larger load would hold it."""
    return law not in (GAP_SPRING, POLYNOMIAL)


@compiled
def held_stiffness(law: int, row: Real, port: int) -> float:
    """Return the stiffness [N/m] a port begins with: closed and stuck if it presses at rest, else open."""
    if law == ELASTIC_NORMAL:
        if row[N0] <= 0.0:
            return 0.0
        return float(row[KN] if port > 0 else row[KT])
    if law == GAP_SPRING:
        return float(row[K_GAP] if row[GAP] < 0.0 else 0.0)
    if law == POLYNOMIAL:
        return float(row[A_1])
    return float(row[KT])


@apart
def _coulomb_ports(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Real, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Elastic Coulomb with a given load, each direction on its own: one port, or two with a square limit."""
    m, n = U.shape
    dF_dkt, dF_dmu, dF_dN = np.empty(n), np.empty(n), np.empty((n, load.size))
    stuck, lifting, separated, piece = True, False, True, 0
    for a in range(m):
        for b in range(m):
            if b != a:
                fill_block(dF_dU[a * m + b], 0.0)
        state, count = contact_force(
            U[a], ks, load, load_ks, row[KT], row[MU], cos_table, sin_table, segments, dF_dU[a * m + a],
            dF_dkt, dF_dmu, dF_dN, F[a],
        )  # fmt: skip
        if state == FAILED:
            return FAILED, piece
        stuck = stuck and state == STUCK
        lifting = lifting or state == LIFTING
        separated = separated and state == SEPARATED
        piece = 1_000_003 * piece + piece_of(segments, count)
        for i in range(n):
            total = slope[KT] * dF_dkt[i] + slope[MU] * dF_dmu[i]
            for j in range(load.size):
                total += dload[j] * dF_dN[i, j]
            dF_dp[a, i] = total
    if separated:
        return SEPARATED, piece
    if stuck:
        return STUCK, piece
    return (LIFTING if lifting else SLIPPING), piece
