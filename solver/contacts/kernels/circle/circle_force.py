"""Coefficients of the force under a circular limit from its path, without derivatives.

The integrals are those of `circle_gradient`: of sticks in closed form, of slips over
the nodes of their panels.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.circle.circle_adjoint import STUCK_COS, STUCK_SIN
from solver.contacts.kernels.circle.circle_state import SETTLES
from solver.contacts.kernels.circle.panels import Array, X, Y, curves_at
from solver.contacts.kernels.circle.radau import NODES, STAGES, WEIGHTS
from solver.contacts.kernels.coulomb.line_force import add_moments, basis_at, moment_rows, products
from solver.contacts.kernels.stick_slip_events import STICK
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count
from solver.jit.kernel_records import Records, Row
from solver.jit.lapack import fill_block
from solver.jit.separate import apart


@compiled
def pack(wave: Array, ks: Integer, q: Array) -> None:
    """Fill q with the coefficients for `ks` of a curve kept as cosines and sines."""
    here = 0
    for i in range(ks.size):
        q[here] = wave[0, ks[i]]
        here += 1
        if ks[i] > 0:
            q[here] = wave[1, ks[i]]
            here += 1


@apart
def circle_force(
    waves: Real,
    kappa: float,
    ks: Integer,
    all_ks: Integer,
    found: Records,
    pieces: Records,
    panels: Records,
    F: Real,
) -> None:
    """Fill F (2, n); arguments as of `solver.contacts.kernels.circle.circle_gradient.circle_gradient`."""
    n, size, count = F.shape[1], coefficient_count(all_ks), found[0].pieces
    sums, here = np.zeros((2, ks[-1] + all_ks[-1] + 1)), np.empty((2, ks[-1] + all_ks[-1] + 1))
    moment, block, packed = np.empty(n), np.empty((n, size)), np.empty((2, size))
    fill_block(F, 0.0)
    for index in range(count - 1 if found[0].how == SETTLES else 0, count):
        row = pieces[index]
        if row.motion != STICK:
            for p in range(row.first, row.first + row.count):
                _add_panel(waves, ks, panels[p], moment, F)
            continue
        fill_block(here, 0.0)
        add_moments(row.begin, row.end, 1.0, here[0], here[1])
        moment_rows(here[0], here[1], ks, moment)
        for q in range(sums.shape[1]):
            sums[STUCK_COS, q] += here[0, q]
            sums[STUCK_SIN, q] += here[1, q]
        at = curves_at(waves, row.begin)
        offset_x, offset_y = row.tx - at.x, row.ty - at.y / kappa
        for i in range(n):
            F[0, i] += offset_x * moment[i]
            F[1, i] += offset_y * moment[i]
    products(sums[STUCK_COS], sums[STUCK_SIN], ks, all_ks, 1.0, block)
    pack(waves[X], all_ks, packed[X])
    pack(waves[Y], all_ks, packed[Y])
    for i in range(n):
        x, y = 0.0, 0.0
        for j in range(size):
            x += block[i, j] * packed[X, j]
            y += block[i, j] * packed[Y, j]
        F[0, i] += x
        F[1, i] += y / kappa


@compiled
def _add_panel(waves: Real, ks: Integer, panel: Row, e: Real, F: Real) -> None:
    """Add the integrals of L (cos θ, sin θ) over a panel."""
    begin, h = panel.begin, panel.end - panel.begin
    for i in range(STAGES):
        tau, theta = begin + h * NODES[i], panel.theta[i]
        at = curves_at(waves, tau)
        basis_at(tau, ks, e)
        if ks[0] == 0:
            e[0] *= 0.5
        share = h * WEIGHTS[i] * at.limit / math.pi
        along, across = share * math.cos(theta), share * math.sin(theta)
        for j in range(e.size):
            F[0, j] += along * e[j]
            F[1, j] += across * e[j]
