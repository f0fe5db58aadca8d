"""What acts along one direction between two events: friction, a spring on one side, powers of the motion.

Stick: f = kt (u − w). Slip in direction ξ: f = ξΛ, Λ = μN, N = N0 + N1 cos(τ + φ) + kn v, and kn v presses.
A stick lasts while |f| < Λ, a slip while ξ kt u' > Λ', contact while N > 0. Where a slip ends, w = u − ξΛ/kt,
and its rate ξ kt u' − Λ' is 0 there, so that

    δw = δu − ξ (μ kn/kt) δv,

whatever the change of that instant. Where N rises through 0 the slider is where the part is, w = u, at an
instant that moves by δτ = −kn δv/N':

    δw = δu − (u' kn/N') δv.

Forces never jump, so that nothing else does: the saltation matrices (R. I. Leine, H. Nijmeijer, Dynamics and
Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7, doi:10.1007/978-3-540-44398-8) act on sliders
alone. At the instant N becomes 0 nothing is remembered any longer.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeVar

import numpy as np

from solver.contacts.fields import Real
from solver.contacts.kernels.state_durations import find_segments
from solver.contacts.kernels.stick_slip_events import AFTER_SLIP, FAILED, SLIP, UNLOADED, new_segments
from solver.contacts.laws.contact_parts import ContactMotion, Slider
from solver.contacts.pieces.piece import SHORTEST, TURN, Rates, StateEntry, StatePiece, spring, steady
from solver.errors import SettingError
from solver.jit import fourier
from solver.jit.kernel_records import Row
from solver.jit.trig_polynomial import grid_size, grid_tables

STICK, FREE = 0, 2  # of a slider; one that slips has its direction, +1 or -1
_Line = TypeVar("_Line", float, Real)  # numbers, values over time, or rows over what they are made of


def line_force(does: int, kt: float, u: _Line, held: _Line, limit: _Line) -> _Line:
    """Return the force of a slider whose spring is held at w, under its limit Λ [N]."""
    if does == STICK:
        return kt * (u - held)
    return (0 if does == FREE else does) * limit


def line_lasts(
    does: int, kt: float, force: _Line, limit: _Line, rate: _Line, limit_rate: _Line
) -> tuple[_Line, ...]:
    """Return what is positive as long as a slider does what it does; rigid, it slips as it moves."""
    if does == STICK:
        return limit - force, limit + force
    if does == FREE:
        return ()
    return (does * rate if math.isinf(kt) else does * kt * rate - limit_rate,)


def line_left(direction: Any, kt: float, u: _Line, limit: _Line) -> _Line:
    """Return where a slip leaves the slider that it moves, w = u − ξΛ/kt."""
    left: _Line = u - direction * limit / kt
    return left


class Segments(NamedTuple):
    """What a contact does over a period, see `solver.contacts.kernels.stick_slip_events`."""

    state: int
    rows: np.recarray[Any, Any]  # (count,) `solver.contacts.kernels.stick_slip_events.SEGMENT`


class Shares(NamedTuple):
    """Shares of the period a contact spends in each motion; they add up to 1."""

    stick: float
    slip: float
    separation: float


def segments_of(slider: Slider, slip: Real, load: Real) -> Segments:
    """Return the segments for full coefficients of slip motion [m] and normal load [N]."""
    ks, load_ks = (fourier.all_harmonics((q.size - 1) // 2) for q in (slip, load))
    top = max(int(ks[-1]), int(load_ks[-1]), 1)
    rows = new_segments(top)
    tables = grid_tables(grid_size(top), top)
    state, count = find_segments(slip, ks, load, load_ks, float(slider.kt), float(slider.mu), *tables, rows)
    return Segments(state=int(state), rows=rows[:count].copy().view(np.recarray))


def closed_where(motion: Real, gap: float) -> Segments:
    """Return when a spring on one side is closed: u − gap > 0 is the load of what does not slide."""
    opening = motion.copy()
    opening[0] -= gap
    return segments_of(Slider(kt=1.0, mu=1.0), np.zeros(opening.size), opening)


def shares_of(*found: Segments) -> Shares:
    """Return the shares of one slider, or of several under one load: they slip where any of them does."""
    edges = {0.0, 1.0}
    for each in found:
        edges |= {float(share) for share in np.concatenate([each.rows.begin, each.rows.end]) / TURN % 1.0}
    ends = np.array(sorted(edges))
    middles, lengths = 0.5 * (ends[1:] + ends[:-1]), np.diff(ends)
    touching, slipping = np.zeros(middles.size, bool), np.zeros(middles.size, bool)
    for each in found:
        for row in each.rows:
            inside = (middles - row.begin / TURN) % 1.0 < (row.end - row.begin) / TURN
            touching |= inside
            slipping |= inside & (row.motion == SLIP)
    slip, contact = float(lengths[slipping].sum()), float(lengths[touching].sum())
    return Shares(stick=contact - slip, slip=slip, separation=1.0 - contact)


def motion_at(found: Segments, tau: Real) -> list[ContactMotion]:
    """Return what a slider does at every angle."""
    motion = np.full(tau.size, ContactMotion.SEPARATION)
    for row in found.rows:
        motion[_inside(row, tau)] = ContactMotion.SLIP if row.motion == SLIP else ContactMotion.STICK
    return motion.tolist()


def force_by_segments(slider: Slider, slip: Real, load: Real, tau: Real) -> Real:
    """Return a friction force [N] at the angles `tau` in [0, 2π), segment by segment.

    Parameters
    ----------
    slip, load : full coefficients [m], [N].
    """
    force, limit = np.zeros(tau.size), slider.limit(load)
    for row in segments_of(slider, slip, load).rows:
        inside, onset = _inside(row, tau), np.array([row.onset])
        held = np.zeros(1) if row.began == UNLOADED else values_at(slip, onset)
        if row.began == AFTER_SLIP:
            held = line_left(row.direction, slider.kt, held, values_at(limit, onset))
        here = tau[inside]
        force[inside] = line_force(_does(row), slider.kt, values_at(slip, here), held, values_at(limit, here))
    return force


def friction_pieces(
    slider: Slider, slip: Real, load: Real, *, presses: bool = True
) -> tuple[StatePiece, ...]:
    """Return the states of friction in one direction.

    Parameters
    ----------
    slip : full coefficients of u [m]; load : of N, what the normal motion adds included [N].
    presses : whether the normal force itself belongs to it, where the load moves with a second motion v.

    Raises
    ------
    SettingError
        A motion that cannot be followed.
    """
    moves, kt = slider.normal_port is not None, slider.kt
    if moves:
        _presses_or_opens(load)
    found = segments_of(slider, slip, load)
    if found.state == FAILED:
        raise SettingError("solution", "motion", "must be one of every contact that can be followed")
    # Rows over (u, v, w).
    u, w, limit = np.eye(3)[0], np.eye(3)[2], slider.limit_rise * np.eye(3)[1]
    pressed = np.eye(3)[1] * (slider.normal_stiffness if presses else 0.0)
    m = 2 if moves else 1
    pieces = []
    for row in found.rows:
        begin, end = float(row.begin), float(row.end)
        if end - begin <= SHORTEST:
            continue
        does = _does(row) if slider.limit(1.0) > 0.0 else FREE
        follows = np.stack([line_force(does, kt, u, w, limit), pressed])[:m]
        if does != STICK:
            pieces.append(spring(begin, end, follows[:, :m]))
            continue
        left = line_left(row.direction, kt, u, limit)
        if row.began != AFTER_SLIP and slider.normal_stiffness > 0.0 and end - begin < TURN - SHORTEST:
            left = u - slider.normal_stiffness * _slope(slip, begin) / _slope(load, begin) * np.eye(3)[1]
        always = end - begin >= TURN - SHORTEST
        entry = None if always else StateEntry(left[None, :m], None)
        rates = steady(follows[:, :m], follows[:, 2:])
        pieces.append(StatePiece(begin=begin, end=end, rates=rates, entry=entry, carried=np.eye(1, m)))
    return tuple(pieces)


def _does(row: Row) -> int:
    return int(row.direction) if row.motion == SLIP else STICK


def _inside(row: Row, tau: Real) -> Any:
    """Return at which angles a segment lasts; it may reach beyond the period it began in."""
    return (tau - row.begin) % TURN <= row.end - row.begin


def _presses_or_opens(load: Real) -> None:
    """Raise SettingError where a contact touches all the time without a force."""
    if not np.any(load):
        wanted = "must press or open every contact: what touches without a force is stiff to one side alone"
        raise SettingError("solution", "motion", wanted)


def values_at(coefficients: Real, tau: Real) -> Real:
    """Return the values (..., t) of full coefficients (..., 2H + 1) at angles (t,)."""
    return np.asarray(coefficients @ fourier.basis(tau, (coefficients.shape[-1] - 1) // 2).T)


def _slope(coefficients: Real, tau: float) -> float:
    """Return the derivative by τ of full coefficients."""
    return float(values_at(fourier.derivative(coefficients), np.array([tau]))[0])


def gap_pieces(motion: Real, stiffness: float, gap: float) -> tuple[StatePiece, ...]:
    """Return when a spring on one side is closed; the force is continuous, so that nothing jumps."""
    _presses_or_opens(np.append(motion[0] - gap, motion[1:]))
    closed = ((float(row.begin), float(row.end)) for row in closed_where(motion, gap).rows)
    return tuple(spring(*when, np.array([[stiffness]])) for when in closed if when[1] - when[0] > SHORTEST)


def polynomial_pieces(motion: Real, powers: tuple[float, ...]) -> tuple[StatePiece, ...]:
    """Return the one state of a spring with the force Σ a_j u^j, its stiffness Σ j a_j u^(j−1)."""
    slopes = [j * a for j, a in enumerate(powers, start=1)]
    if not any(slopes[1:]):
        return (spring(0.0, TURN, np.array([[slopes[0]]])),)

    def rates(tau: Real) -> Rates:
        u = values_at(motion, tau)
        stiffness = np.asarray(np.polynomial.polynomial.polyval(u, slopes), dtype=np.float64)
        none = np.zeros((len(tau), 0, 1))
        return Rates(stiffness[:, None, None], none.swapaxes(1, 2), none, none, none[:, :, :0])

    edges = tuple(k * TURN / 8.0 for k in range(1, 8))
    return (StatePiece(begin=0.0, end=TURN, rates=rates, carried=np.zeros((0, 1)), edges=edges),)
