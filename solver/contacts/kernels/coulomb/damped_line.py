"""Friction along one line of an element whose spring has a dashpot beside it, both behind one slider.

Where it sticks F = kt u + c u' + constant, and nothing but the sum counts: it is the element without dashpot
of the motion u + (c/kt) u', whose coefficients are (1 + ikω c/kt) times those of u.
"""

from __future__ import annotations

from solver.contacts.kernels.columns import C_STICK, KT, OMEGA
from solver.contacts.kernels.coulomb.line_law import coulomb_line
from solver.jit.fourier import Integer, Real, cosine_position
from solver.jit.kernel_records import Records
from solver.jit.separate import apart


@apart
def damped_line(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the friction, and its derivatives by the motion, the parameters and the frequency."""
    lead = row[OMEGA] * row[C_STICK] / row[KT]
    d_lead = (slope[OMEGA] * row[C_STICK] + row[OMEGA] * slope[C_STICK] - lead * slope[KT]) / row[KT]
    felt = U.copy()
    for h in range(ks.size):
        if ks[h] > 0:
            i, k = cosine_position(ks, h), ks[h]
            felt[0, i] += lead * k * U[0, i + 1]
            felt[0, i + 1] -= lead * k * U[0, i]
    found = coulomb_line(
        felt, ks, load, load_ks, row, slope, dload, cos_table, sin_table, segments, F, dF_dU, dF_dp
    )
    for h in range(ks.size):
        if ks[h] > 0:
            i, k = cosine_position(ks, h), ks[h]
            for a in range(U.shape[1]):
                by_cosine, by_sine = dF_dU[0, a, i], dF_dU[0, a, i + 1]
                dF_dp[0, a] += d_lead * k * (by_cosine * U[0, i + 1] - by_sine * U[0, i])
                dF_dU[0, a, i] = by_cosine - lead * k * by_sine
                dF_dU[0, a, i + 1] = by_sine + lead * k * by_cosine
    return found
