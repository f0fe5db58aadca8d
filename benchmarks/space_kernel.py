"""Force and Jacobian of one contact in space, circular limit: time, and error against many more nodes."""

from __future__ import annotations

import numpy as np

from benchmarks.harness import expect, table, timed
from solver.contacts.kernels.circle.circle_law import KN, KT_SECOND, coulomb_circle
from solver.contacts.kernels.columns import COLUMNS, KT, MU
from solver.contacts.kernels.stick_slip_events import new_segments
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.jit.trig_polynomial import grid_size, grid_tables

HARMONICS, FINER = 11, 8
CALLS = 20  # of a kernel in one run of the clock


def _motion(seed: int) -> Real:
    """Return a motion of all three directions whose harmonics decay with the square of their number."""
    rng = np.random.default_rng(seed)
    U = rng.normal(size=(3, 2 * HARMONICS + 1))
    U[:, 1:] *= np.repeat(np.arange(1, HARMONICS + 1.0) ** -2.0, 2)
    return np.asarray(U * np.array([[4.0], [4.0], [0.3]]))


def _force(U: Real, load: Real) -> tuple[Real, float]:
    """Return the force coefficients and the seconds of one evaluation."""
    m, n = U.shape
    top = (n - 1) // 2
    row = np.zeros(COLUMNS)
    row[[KT, KT_SECOND, MU, KN]] = 1.0, 1.0, 0.5, 1.0
    F, dF_dU, dF_dp = np.empty((m, n)), np.empty((m * m, n, n)), np.empty((m, n))
    ks, load_ks = fourier.all_harmonics(top), fourier.all_harmonics(1)
    tables, nothing = grid_tables(grid_size(top), top), np.zeros(COLUMNS)
    segments = new_segments(top)

    def call() -> None:
        for _ in range(CALLS if top == HARMONICS else 1):
            coulomb_circle(
                U, ks, load, load_ks, row, nothing, np.zeros(3), *tables, segments, F, dF_dU, dF_dp
            )

    _, timing = timed(call, runs=200 if top == HARMONICS else 1)
    return F, timing.cpu / CALLS


def space_kernel() -> None:
    """Print a table of some motions, beside a NumPy solve of 23 × 23."""
    rng = np.random.default_rng(0)
    matrix, right = rng.normal(size=(23, 23)), rng.normal(size=23)
    solve = timed(lambda: [np.linalg.solve(matrix, right) for _ in range(50)], runs=200)[1].cpu / 50
    rows = []
    for seed in range(6):
        U, load = _motion(seed), np.array([2.0, 0.5 * (seed % 2), 0.0])
        F, seconds = _force(U, load)
        more = np.pad(U, ((0, 0), (0, (FINER - 1) * 2 * HARMONICS)))
        fine = _force(more, load)[0][:, : U.shape[1]]
        error = np.abs(F - fine).max() / np.abs(fine).max()
        expect(f"the coefficients are right to 1e-8, not {error:.1e}", error <= 1e-8)
        rows.append((str(seed), f"{1e6 * seconds:.0f}", f"{seconds / solve:.1f}", f"{error:.1e}"))
    table(
        f"one contact in space, circle, H = {HARMONICS}; a 23 × 23 solve takes {1e6 * solve:.1f} µs",
        ("motion", "force and Jacobian [µs]", "solves", f"error against {FINER} times the nodes"),
        rows,
    )
