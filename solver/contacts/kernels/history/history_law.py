"""The force of a law that follows the history of its motion, behind the contract of the laws.

The law starts without history, goes to the motion of the first node, and follows periods until its state
repeats. Where that takes many, the state that repeats is found by Newton's method on the map of a period,
whose derivative Φ comes with the derivatives of the state. Those of the periodic force follow from it too:
with D₁ = D_forced + Φ D₀ after a period, D₀ = D₀ + (1 − Φ)⁻¹ (D₁ − D₀) is what repeats. A state that a period
leaves as it was (Φ = 1, an element that nothing moves) keeps what the way to the first node gave it.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.columns import (
    DEFORMING,
    HISTORY_FORM,
    HISTORY_LAW,
    HISTORY_STATES,
    HISTORY_WAY,
    MOST_OWN,
    NODES,
    OMEGA,
    OWN,
)
from solver.contacts.kernels.history.partials import inputs_of
from solver.contacts.kernels.history.turns import (
    Course,
    carry,
    even_nodes,
    fill_basis,
    fill_motion,
    go_round,
    halves_of,
    most_nodes,
    nodes_between,
    ramp_of,
    reversals,
)
from solver.contacts.kernels.stick_slip_events import FAILED
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count
from solver.jit.kernel_records import Records
from solver.jit.lapack import fill, fill_block
from solver.jit.separate import apart

# Bits of the form of a law.
IN_STEPS, REVERSALS, ALONE = 1, 2, 4
REPEATS = 1e-11  # change of the state over a period, relative to its largest, that counts as none
_PLAIN = 12  # periods that are simply followed before Newton's method
_MOST_TURNS, _MOST_NEWTON = 60, 15
_DIVERGES = -1
_FASTEST = 0.7  # own rate of a state times the step, up to which the steps are accurate and stable
_MOST_NODES = 8192  # to which their number is doubled where the steps are too long
_NEUTRAL = 1e-9  # |1 − Φ| below which a period leaves a state as it was


@compiled
def course_of(
    U: Real, ks: Integer, row: Real, slope: Real, count: int, between: bool, cos_table: Real, sin_table: Real
) -> Course:
    """Return the course of a motion over a period of about `count` nodes."""
    top, form = max(ks[-1], 1), int(row[HISTORY_FORM])
    steps, halves = form & IN_STEPS != 0, halves_of(form & IN_STEPS != 0)
    tau, weight = np.empty(most_nodes(count, top)), np.empty(most_nodes(count, top))
    found, turns = 0, np.empty(2 * top + 2)
    if between:
        found = reversals(U, ks, cos_table, sin_table, turns)
    nodes = nodes_between(turns, found, count, tau, weight) if found > 0 else even_nodes(count, tau, weight)
    points, ns = halves * nodes + 1, int(row[HISTORY_STATES])
    basis, u, v = np.empty((points, coefficient_count(ks))), np.empty(points), np.empty(points)
    fill_basis(ks, tau, nodes, halves, basis)
    fill_motion(U, ks, row[OMEGA], basis, u, v)
    sizes = np.zeros(inputs_of(steps) + ns)
    for j in range(points):
        sizes[0], sizes[1] = max(sizes[0], abs(u[j])), max(sizes[1], abs(v[j]))
    sizes[0], sizes[1] = sizes[0] + 1e-150, sizes[1] + 1e-150
    if steps:
        sizes[2], sizes[3] = sizes[0], 2.0 * math.pi / (nodes * row[OMEGA])
    return Course(
        int(row[HISTORY_LAW]), int(row[HISTORY_WAY]), steps, form & ALONE != 0, row[OWN : OWN + MOST_OWN],
        slope[OWN : OWN + MOST_OWN], row[OMEGA], slope[OMEGA], ks, tau, weight, nodes, basis, u, v, sizes,
    )  # fmt: skip


@apart
def solve_shifted(phi: Real, right: Real) -> None:
    """Replace `right` (states, m) by (1 − Φ)⁻¹ `right`; 0 in directions that Φ leaves as they are."""
    ns, m = right.shape
    A = -phi
    for i in range(ns):
        A[i, i] += 1.0
    for i in range(ns):
        best = i
        for r in range(i + 1, ns):
            if abs(A[r, i]) > abs(A[best, i]):
                best = r
        for q in range(ns):
            A[i, q], A[best, q] = A[best, q], A[i, q]
        for q in range(m):
            right[i, q], right[best, q] = right[best, q], right[i, q]
        if abs(A[i, i]) < _NEUTRAL:
            continue
        for r in range(i + 1, ns):
            share = A[r, i] / A[i, i]
            for q in range(i, ns):
                A[r, q] -= share * A[i, q]
            for q in range(m):
                right[r, q] -= share * right[i, q]
    for i in range(ns - 1, -1, -1):
        for q in range(m):
            if abs(A[i, i]) < _NEUTRAL:
                right[i, q] = 0.0
                continue
            for r in range(i + 1, ns):
                right[i, q] -= A[i, r] * right[r, q]
            right[i, q] /= A[i, i]


@compiled
def keep_sizes(course: Course, tops: Real) -> None:
    """Keep the largest size of every state, for differences."""
    for i in range(tops.size):
        course.sizes[course.sizes.size - tops.size + i] = tops[i] + 1e-150


@apart
def close(course: Course, state: Real, tops: Real) -> int:
    """Fill the state that a period repeats, from no history.

    `tops` becomes the largest size of every state.

    Returns
    -------
    The periods followed; 0 if the state does not repeat, −1 if it does not stay finite.
    """
    ns, nothing = state.size, np.empty(0)
    fill(state, 0.0)
    fill(tops, 0.0)
    if not go_round(ramp_of(course), state, nothing, tops):
        return _DIVERGES
    before, n = np.empty(ns), course.basis.shape[1]
    for turn in range(1, _MOST_TURNS + 1):
        for i in range(ns):
            before[i], tops[i] = state[i], 0.0
        if not go_round(course, state, nothing, tops):
            return _DIVERGES
        change, size = 0.0, 0.0
        for i in range(ns):
            change, size = max(change, abs(state[i] - before[i])), max(size, tops[i])
        if change <= REPEATS * size:
            return turn
        if course.alone or turn < _PLAIN:
            continue
        if turn > _PLAIN + _MOST_NEWTON:
            return 0
        keep_sizes(course, tops)
        D = np.zeros((ns, n + 1 + ns))
        for i in range(ns):
            D[i, n + 1 + i] = 1.0
        missing = np.empty((ns, 1))
        for i in range(ns):
            missing[i, 0], state[i] = state[i] - before[i], before[i]
        carry(course, False, state, D, nothing, np.empty((0, 0)))
        solve_shifted(np.ascontiguousarray(D[:, n + 1 :]), missing)
        moved = False
        for i in range(ns):
            state[i] = before[i] + missing[i, 0]
            moved = moved or state[i] != before[i]
        if not moved:
            return 0  # it drifts: another beginning changes nothing
    return 0


@apart
def _carry_there(course: Course, turns: int, D: Real) -> float:
    """Fill the derivatives `D` (states, n + 1) of states that each follow by itself, after the way there.

    Each forgets all that was before it slips, or never slips: then the way there says what it keeps.

    Returns
    -------
    As `carry`.
    """
    here, nothing, no_rows = np.zeros(D.shape[0]), np.empty(0), np.empty((0, 0))
    fastest = carry(ramp_of(course), True, here, D, nothing, no_rows)
    for _ in range(max(turns - 1, 1)):
        fastest = max(fastest, carry(course, False, here, D, nothing, no_rows))
    return fastest


@apart
def _carry_repeating(course: Course, state: Real, F: Real, dF: Real) -> float:
    """Fill force and derivatives (n, n + 1) over the period that the state repeats; return as `carry`."""
    ns, n, way = state.size, F.size, np.zeros(state.size)
    before = np.zeros((ns, n + 1))
    check = carry(ramp_of(course), True, way, before, np.empty(0), np.empty((0, 0)))
    D, wide = np.zeros((ns, n + 1 + ns)), np.zeros((n, n + 1 + ns))
    for i in range(ns):
        for q in range(n + 1):
            D[i, q] = before[i, q]
        D[i, n + 1 + i] = 1.0
    fastest = carry(course, False, state, D, F, wide)
    missing = D[:, : n + 1] - before
    solve_shifted(np.ascontiguousarray(D[:, n + 1 :]), missing)
    for a in range(n):
        for q in range(n + 1):
            total = wide[a, q]
            for i in range(ns):
                total += wide[a, n + 1 + i] * missing[i, q]
            dF[a, q] = total
    return fastest + 0.0 * check


@apart
def history_law(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the force of a law with a history, its Jacobian and its derivative by λ (as in the contract)."""
    n, count = U.shape[1], int(row[NODES])
    good, fastest = False, 0.0
    while True:
        good, fastest = _at_nodes(U[0], ks, row, slope, count, cos_table, sin_table, F[0], dF_dU[0], dF_dp[0])
        if fastest <= _FASTEST or count >= _MOST_NODES:
            break
        count *= 2
    total = 0.0
    for i in range(n):
        total += F[0, i] + dF_dp[0, i]
        for j in range(n):
            total += dF_dU[0, i, j]
    if not good or fastest > _FASTEST or not math.isfinite(total):
        fill(F[0], np.nan)
        fill_block(dF_dU[0], np.nan)
        fill(dF_dp[0], np.nan)
        return int(np.int64(FAILED)), int(np.int64(0))
    return int(np.int64(DEFORMING)), int(np.int64(1))


@apart
def _at_nodes(
    U: Real, ks: Integer, row: Real, slope: Real, count: int, cos_table: Real, sin_table: Real, F: Real,
    dF_dU: Real, dF_dp: Real,
) -> tuple[bool, float]:  # fmt: skip
    """Evaluate with about `count` nodes; return whether the law repeats, and its largest own rate · step.

    That is infinite where the state does not stay finite, and 0 where no finer steps would help.
    """
    between = int(row[HISTORY_FORM]) & REVERSALS != 0
    course = course_of(U, ks, row, slope, count, between, cos_table, sin_table)
    n, ns = U.size, int(row[HISTORY_STATES])
    fill(F, 0.0)
    state, dF, fastest, turns = np.zeros(ns), np.zeros((n, n + 1)), 0.0, 1
    if ns > 0:
        tops = np.empty(ns)
        turns = close(course, state, tops)
        if turns <= 0:
            return False, np.inf if turns == _DIVERGES else 0.0
        keep_sizes(course, tops)
    if ns > 0 and not course.alone:
        fastest = _carry_repeating(course, state, F, dF)
    else:
        D = np.zeros((ns, n + 1))
        if ns > 0:
            fastest = _carry_there(course, turns, D)
        fastest = max(fastest, carry(course, False, state, D, F, dF))
    for i in range(n):
        share = 0.5 / math.pi if ks[0] == 0 and i == 0 else 1.0 / math.pi
        F[i] *= share
        dF_dp[i] = share * dF[i, n]
        for j in range(n):
            dF_dU[i, j] = share * dF[i, j]
    return math.isfinite(fastest), fastest if math.isfinite(fastest) else np.inf


@apart
def history_forces(U: Real, ks: Integer, row: Real, count: int, force: Real) -> bool:
    """Fill `force` (count,) with the force at `count` even nodes from τ = 0; False if the law fails."""
    no_table, slope = np.empty((0, 0)), np.zeros(row.size)
    course = course_of(U, ks, row, slope, count, False, no_table, no_table)
    ns = int(row[HISTORY_STATES])
    state, tops, around = np.zeros(ns), np.zeros(ns), np.empty(count + 1)
    if ns > 0 and close(course, state, tops) <= 0:
        return False
    good = go_round(course, state, around, tops)
    for j in range(1, count + 1):
        force[j % count] = around[j]
    return good
