"""The record of everything known of a response at one (u, ω, p); see
`solver.continuation.extrema.kernels.amplitude_hessian`."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from solver.contacts.kernels.stick_slip_events import SEGMENT, segment_capacity
from solver.contacts.kernels.system import (
    Evaluation,
    Receptance,
    System,
    new_whole_evaluation,
    receptance_over,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count
from solver.jit.kernel_records import Records, referenced
from solver.linear.kernels.receptance import Jets, new_jets

# Entries of `Summit.numbers`.
NORM, AMPLITUDE, G, DA_DP, CURVE, DG_DP, TAU, DTAU, SIGN, CORNER, DRIFT, RATE = range(12)
SPENT = 12  # evaluations of the balance since it was set to 0
NUMBERS = 13


class Summit(NamedTuple):
    """Everything at one (u, ω, p); nt unknowns, ne elements with nc ports in all, n coefficients each."""

    jets: Jets
    linear: Receptance  # the first two orders of the jets
    point: Evaluation  # what the factors of the condensed Jacobian are made of
    F: Real  # (nc, n) forces less shift · u
    dF_dU: Real  # (blocks, n, n) slopes of the forces themselves; those of `point`
    dF_dp: Real  # (nc, n)
    seconds: Integer  # (ne,) numbers of the kernels of second derivatives; Jenkins elements need none
    dF_dN: Real  # (ne, n, 1 + 2 K) of the Jenkins elements, likewise the five below
    dF_dkt: Real  # (ne, n)
    dF_dmu: Real  # (ne, n)
    states: Integer  # (ne,)
    counts: Integer  # (ne,) segments of each
    segments: Records  # (ne, capacity)
    table: Real  # (ne, ·) contacts at p, their loads, and both differentiated by p
    load: Real  # (ne, 3)
    slope: Real  # (ne, ·)
    dload: Real  # (ne, 3)
    rhs: Real  # (3, nt) the solutions of J x = r, dr/dω, dr/dp
    adjoint: Real  # (nt,) λ
    h: Real  # (nt,) change of g by u
    x: Real  # (n,) observed motion
    dx: Real  # (n,) its derivative by ω along the response
    along: Real  # (nc, n) derivative of F along the response
    z: Real  # (ORDERS, nc, n) weights of the forces
    numbers: Real  # (NUMBERS,)


_new: Callable[..., Summit] = referenced("Summit", __name__, Summit._fields)


@compiled
def new_summit(system: System) -> Summit:
    """Return empty arrays for `system`; the numbers of the second derivatives are not in place yet."""
    ne, nc, n = system.laws.size, system.shift.size, coefficient_count(system.ks)
    nt, m, columns = nc * n, coefficient_count(system.load_ks), system.contacts.shape[1]
    capacity = segment_capacity(max(system.ks[-1], system.load_ks[-1]))
    jets, point = new_jets(system), new_whole_evaluation(system)
    linear = receptance_over(jets.A, jets.u_linear, jets.B, jets.x_linear)
    return _new(
        jets, linear, point, np.zeros((nc, n)), point.dF_dU, np.zeros((nc, n)), np.full(ne, -1, np.int64),
        np.zeros((ne, n, m)), np.zeros((ne, n)), np.zeros((ne, n)), np.zeros(ne, np.int64),
        np.zeros(ne, np.int64), np.zeros((ne, capacity), SEGMENT), np.zeros((ne, columns)),
        np.zeros((ne, m)), np.zeros((ne, columns)), np.zeros((ne, m)), np.zeros((3, nt)), np.zeros(nt),
        np.zeros(nt), np.zeros(n), np.zeros(n), np.zeros((nc, n)), np.zeros((5, nc, n)), np.zeros(NUMBERS),
    )  # fmt: skip


@compiled
def summit_numbers(at: Summit) -> Real:
    """Return the numbers of a summit as Python can read them (a view)."""
    return at.numbers


@compiled
def summit_seconds(at: Summit) -> Integer:
    """Return the numbers of the second derivatives of a summit as Python can set them (a view)."""
    return at.seconds


@compiled
def summit_step(at: Summit) -> Real:
    """Return the Newton step of a summit as Python can read it (a view)."""
    return at.rhs[0]
