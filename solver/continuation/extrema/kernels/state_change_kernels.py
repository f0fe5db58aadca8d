"""Where a contact changes the piece of its law between two points of a branch: both sides of that, solved.

A law is smooth piece by piece (`solver.contacts.kernels.stick_slip_events.piece_of`). Where a contact changes
its piece, slopes jump or turn within a small share of the interval, which the cubic through its ends does not
show: a contact that begins to slip lets go the mean force that sticking had kept in it, and what it took off
a resonance changes at once.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.locate import measured_on_plane
from solver.balance.kernels.newton import arc_newton, newton
from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, PIECE, piece
from solver.balance.kernels.residual import contact_values, element
from solver.contacts.kernels.columns import KT, MU
from solver.contacts.kernels.state_durations import find_segments
from solver.contacts.kernels.stick_slip_events import piece_of
from solver.contacts.kernels.system import SIZE, Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count
from solver.jit.lapack import copy_to
from solver.jit.separate import apart
from solver.linear.kernels.receptance import receptance

_FORETOLD = 5  # halvings of the interpolated motion: the cubic is no better than their result
_BEYOND = 0.1  # share of a step between two solutions by which the next one goes beyond the change foretold
_LARGE = 100  # unknowns from which steps are tried first for which old factors may serve
_NEAREST = 1e-3  # share of the interval left next to an end


@compiled
def _interpolated(rows: Real, ways: Real, t: float, u: Real) -> None:
    """Fill `u` with the cubic at the share t of the way between two solutions; see `locate_change`."""
    n, r = u.size, 1.0 - t
    width = rows[1, n] - rows[0, n]
    a, b = (1.0 + 2.0 * t) * r * r, t * t * (3.0 - 2.0 * t)
    da, db = t * r * r * width, -t * t * r * width
    for i in range(n):
        u[i] = a * rows[0, i] + da * ways[0, i] + b * rows[1, i] + db * ways[1, i]


@apart
def _find_pieces(system: System, u: Real, p: float, asked: Integer, point: Evaluation) -> None:
    """Fill `point.pieces` of the elements asked for (1) from the motions u at λ = p."""
    n = coefficient_count(system.ks)
    table, load, slope, dload = contact_values(system, p, 0.0)
    for e in range(system.laws.size):
        if asked[e] == 0:
            continue
        if system.jenkins[e] == 0 or system.samples > 0:
            element(system, e, u, table[e], load[e], slope[e], dload[e], True, point)
            continue
        c = system.first_port[e]
        _, count = find_segments(
            u[c * n : (c + 1) * n], system.ks, load[e], system.load_ks, table[e, KT], table[e, MU],
            system.cos_table, system.sin_table, point.segments,
        )  # fmt: skip
        point.pieces[e] = piece_of(point.segments, count)


@compiled
def _changing(system: System, rows: Real, pieces: Integer, asked: Integer, point: Evaluation) -> None:
    """Fill `pieces` (ne,) with those at the first of two solutions; keep of `asked` (1) where they change."""
    n = rows.shape[1] - 1
    _find_pieces(system, rows[0, :n], rows[0, n], asked, point)
    for e in range(pieces.size):
        pieces[e] = point.pieces[e]
    _find_pieces(system, rows[1, :n], rows[1, n], asked, point)
    for e in range(pieces.size):
        asked[e] = 1 if point.pieces[e] != pieces[e] else 0


@compiled
def _foretold(
    system: System, point: Evaluation, rows: Real, ways: Real, pieces: Integer, asked: Integer, u: Real
) -> float:
    """Return the λ at which a piece changes if the motion between two solutions is a cubic."""
    n = u.size
    before, after = 0.0, 1.0
    for _ in range(_FORETOLD):
        t = 0.5 * (before + after)
        _interpolated(rows, ways, t, u)
        _find_pieces(system, u, rows[0, n] + t * (rows[1, n] - rows[0, n]), asked, point)
        changed = False
        for e in range(pieces.size):
            changed = changed or (asked[e] == 1 and point.pieces[e] != pieces[e])
        if changed:
            after = t
        else:
            before = t
    return rows[0, n] + 0.5 * (before + after) * (rows[1, n] - rows[0, n])


@compiled
def _settled(measures: Real, width: float, allowed: float) -> bool:
    """Return whether between two solutions whose λ are `width` apart the slope merely jumps.

    Then the chord is between both slopes. Another piece between them, in which the curves rise or fall more,
    is told by the step it leaves.
    """
    for c in range(2):
        value, slope = (HIGH, HIGH_SLOPE) if c == 0 else (LOW, LOW_SLOPE)
        before, after = measures[0, slope] * width, measures[1, slope] * width
        chord = measures[1, value] - measures[0, value]
        if not min(before, after) - allowed <= chord <= max(before, after) + allowed:
            return False
    return True


@apart
def locate_change(
    system: System, linear: Receptance, point: Evaluation, found: Real, ways: Real, x: Real, measures: Real,
    states: Integer, allowed: float, trials: int, most: int, sides: Integer,
) -> int:  # fmt: skip
    """Close in on the first change of a contact's piece between two points of a branch.

    Parameters
    ----------
    found : (2, nt + 1) both points, λ last; ways : (2, nt + 1) the slopes by λ there; x : (2, n) observed;
        measures : (2, MEASURES) with slopes by λ; states : (2, ne). They become those of the
        nearest solutions before and behind the change.
    allowed : amplitude [m] up to which a maximum between both sides does not matter.
    trials : solutions at most; most : Newton iterations of each.
    sides : (2,) 1 where such a solution was found, else 0; filled.

    Returns
    -------
    Newton iterations.
    """
    n = found.shape[1] - 1
    row, way, at, out = np.empty(n + 1), np.empty(n + 1), np.empty(x.shape[1]), np.empty(measures.shape[1])
    onward = np.zeros(n + 1)
    onward[n] = 1.0
    last, behind, total = 0.0, False, 0
    pieces, asked = np.empty(states.shape[1], np.int64), np.ones(states.shape[1], np.int64)
    _changing(system, found, pieces, asked, point)
    sides[0], sides[1] = 0, 0
    for _ in range(trials):
        lo, hi = found[0, n], found[1, n]
        p = _foretold(system, point, found, ways, pieces, asked, row[:n])
        if sides[0] + sides[1] > 0:
            beyond = max(_BEYOND * abs(p - last), abs(hi - lo) * 0.5**_FORETOLD)
            p += math.copysign(beyond, (hi - lo) * (-1.0 if behind else 1.0))
        margin = _NEAREST * (hi - lo)
        p = lo + margin if (p - lo) * (hi - lo) < margin * (hi - lo) else p
        p = hi - margin if (hi - p) * (hi - lo) < margin * (hi - lo) else p
        good, share = False, (p - lo) / (hi - lo)
        if point.counts[SIZE] >= _LARGE:
            _interpolated(found, ways, share, row[:n])
            good, iterations, _, norm = arc_newton(
                system, linear, row[:n], p, row, p, onward, 0.0, 1.0, point, most
            )
            total += iterations
        if not good:
            _interpolated(found, ways, share, row[:n])
            receptance(system, p, linear)
            good, iterations, norm = newton(system, linear, row[:n], p, 0.0, point)
            total += iterations
        row[n] = p
        good = good and measured_on_plane(
            system, linear, point, onward, 0.0, 1.0, False, norm, row, way, at, out
        )
        if not (good and math.isfinite(out[HIGH] + out[LOW] + out[HIGH_SLOPE] + out[LOW_SLOPE])):
            break
        behind = piece(point) != measures[0, PIECE]
        side, last = (1 if behind else 0), p
        copy_to(found[side], row)
        copy_to(ways[side], way)
        copy_to(x[side], at)
        copy_to(measures[side], out)
        for e in range(states.shape[1]):
            states[side, e] = point.states[e]
        sides[side] = 1
        if sides[0] + sides[1] == 2 and _settled(measures, found[1, n] - found[0, n], allowed):
            break
    return total
