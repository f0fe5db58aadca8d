"""The kernel of the circular limit finds the force alone as it does with all derivatives."""

import numpy as np
import pytest

from solver.contacts.kernels.circle.circle_law import coulomb_circle
from solver.contacts.kernels.columns import COLUMNS, KN, KT, KT_SECOND, MU
from solver.contacts.kernels.stick_slip_events import (
    LIFTING,
    SEPARATED,
    SLIPPING,
    STUCK,
    new_segments,
)
from solver.jit import fourier
from solver.jit.trig_polynomial import grid_size, grid_tables

TOP = 5


@pytest.mark.parametrize("ports", [2, 3])
@pytest.mark.parametrize(
    ("size", "N0", "state"),
    [(0.1, 5.0, STUCK), (4.0, 3.0, SLIPPING), (4.0, -50.0, SEPARATED), (4.0, 0.4, LIFTING)],
    ids=["stuck", "slipping", "separated", "lifting"],
)
def test_the_force_is_the_same(ports: int, size: float, N0: float, state: int) -> None:
    rng = np.random.default_rng(4)
    n = 2 * TOP + 1
    U = size * rng.normal(size=(ports, n))
    U[:, 1:] *= np.repeat(np.arange(1, TOP + 1.0) ** -2.0, 2)
    U[2:] *= 0.1
    load = np.array([N0, 1.0 if state == LIFTING else 0.2, 0.0])
    row = np.zeros(COLUMNS)
    row[[KT, KT_SECOND, MU, KN]] = 1.0, 0.8, 0.5, 1.0 if ports == 3 else 0.0
    tables = grid_tables(grid_size(TOP), TOP)
    forces = []
    for blocks in (ports * ports, 0):
        F, dF_dU, dF_dp = np.full((ports, n), np.nan), np.empty((blocks, n, n)), np.empty((ports, n))
        segments = new_segments(TOP)
        found = coulomb_circle(
            U, fourier.all_harmonics(TOP), load, fourier.all_harmonics(1), row, np.zeros(COLUMNS),
            np.zeros(3), *tables, segments, F, dF_dU, dF_dp,
        )  # fmt: skip
        assert found[0] == state
        forces.append((found, F, segments))
    assert forces[0][0] == forces[1][0]
    np.testing.assert_allclose(forces[1][1], forces[0][1], rtol=0.0, atol=1e-13 * (1.0 + np.abs(U).max()))
    np.testing.assert_array_equal(forces[1][2], forces[0][2])
