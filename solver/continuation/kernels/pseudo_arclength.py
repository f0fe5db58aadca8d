"""Continuation: pseudo-arc-length steps along r(u, λ) = 0, with folds passed and kinks stepped over.

Orientation. At a kink the branch turns, and the turn may exceed a right angle. Across a facet between two
smooth pieces the sign of det [dr/du dr/dλ; tᵀ] stays the same for tangents t that cross the facet in the same
direction (Eaves, Scarf, Math. Oper. Res. 1 (1976) 1, for piecewise linear paths), so a sharp turn is oriented
by that sign. At a branch point of a smooth branch the sign does flip: there, all contacts still on the same
piece of their law and the branch all but straight, the angle decides.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.broyden import frozen_arc
from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.linearised_contacts import fill_springs
from solver.balance.kernels.newton import ACCEPTED, DEAR_FORCES_BELOW, arc_newton, newton
from solver.balance.kernels.output import RESIDUAL, measure, piece
from solver.balance.kernels.residual import evaluate
from solver.contacts.kernels.system import AT_BRANCH_POINT, SIZE, Evaluation, Receptance, System
from solver.continuation.kernels.predictor import foreseen_step, predict
from solver.continuation.kernels.walk_state import (
    COUNT,
    CUBIC,
    FINISHED,
    FRESH,
    FROZEN,
    ITERATIONS,
    LEFT_RANGE,
    NO_START,
    NORM,
    NUMBERS,
    ORIENTATION,
    PIECE,
    REJECTED,
    ROUGH,
    RUNNING,
    SMOOTH,
    STALLED,
    STEP,
    STEPPED_OVER,
    Control,
    P,
    Walk,
    accept,
    distance,
    new_walk,
    turned_back,
    undo,
    weights,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real
from solver.jit.lapack import copy_to, set_to
from solver.jit.separate import apart
from solver.linear.kernels.receptance import receptance

_TINY = 64.0  # smallest steps: a step as short as this may turn as it likes
_SHARP = 2.0**-8  # of the first step: a step longer than this does not turn back
STRAIGHT_ON = 0.98  # cosine of the turn at a branch point; more than that is a step across a sharp peak
CLEARLY = 0.1  # share of the accepted residual below which a point is more than nearly a solution
TOO_LONG = -1  # of a step: a shorter one is to be tried
FROZEN_FROM = 150  # size from which old factors beat new ones (measured) where forces are not dear


@apart
def begin_walk(
    system: System, linear: Receptance, point: Evaluation, control: Control, u: Real
) -> tuple[int, Walk]:
    """Begin a branch at a solution `u` for the start of the range: its first point and tangent."""
    nt, p = u.size, control.start
    rows = np.zeros((5, nt + 1))
    walk = new_walk(np.zeros(nt), rows[0], rows[1], rows[2], rows[3], rows[4], np.zeros(NUMBERS))
    copy_to(walk.u, u)
    walk.numbers[P] = p
    walk.numbers[STEP] = control.first_step
    walk.tangent[nt] = 1.0 if control.stop >= control.start else -1.0
    receptance(system, p, linear)
    walk.numbers[NORM], walk.numbers[FRESH] = evaluate(system, linear, walk.u, p, 0.0, point), 1.0
    if not _turn(system, linear, point, control, walk):
        return NO_START, walk
    set_to(walk.before[:nt], walk.u, -control.first_step, walk.tangent)
    walk.before[nt] = p - control.first_step * walk.tangent[nt]
    return RUNNING, walk


@apart
def _turn(system: System, linear: Receptance, point: Evaluation, control: Control, walk: Walk) -> bool:
    """Replace the tangent by the one at the new point (`point` is evaluated there), oriented onward."""
    n = walk.u.size
    weight_u, weight_p = weights(system, walk, control)
    rhs = np.zeros(n + 1)
    rhs[n] = 1.0
    sign = factorise(system, linear, point, walk.tangent, weight_u, weight_p)
    if sign == 0.0:
        return False
    step_back(system, point, rhs)
    if not math.isfinite(rhs[n]):
        return False
    point.counts[AT_BRANCH_POINT] = 1
    old = weight_p * walk.tangent[n] ** 2
    new = weight_p * rhs[n] ** 2
    for i in range(n):
        old += weight_u * walk.tangent[i] ** 2
        new += weight_u * rhs[i] ** 2
    length = math.sqrt(new)
    if walk.numbers[ORIENTATION] == 0.0:
        walk.numbers[ORIENTATION] = sign
    elif sign != walk.numbers[ORIENTATION]:
        if piece(point) == walk.numbers[PIECE] and 1.0 / (length * math.sqrt(old)) > STRAIGHT_ON:
            walk.numbers[ORIENTATION] = sign
        else:
            length = -length
    smooth = piece(point) == walk.numbers[PIECE]
    walk.numbers[SMOOTH] = min(walk.numbers[SMOOTH] + 1.0, walk.numbers[COUNT]) if smooth else 0.0
    walk.numbers[PIECE] = piece(point)
    for i in range(n + 1):
        walk.tangent[i] = rhs[i] / length
    return True


@apart
def _correct(
    system: System, linear: Receptance, point: Evaluation, control: Control, walk: Walk, guess: Real,
    p_guess: float, trial: Real, weight_u: float, weight_p: float,
) -> tuple[bool, int, float, float]:  # fmt: skip
    """Correct the guess into `trial`: with the factors of the last point if that pays, else Newton's method.

    Returns
    -------
    (converged, iterations as far as the step control is concerned, λ, relative residual).
    """
    copy_to(trial, guess)
    p = p_guess
    least = FROZEN_FROM if system.alone.sum() == 0 else DEAR_FORCES_BELOW
    if point.counts[AT_BRANCH_POINT] == 1 and point.counts[SIZE] >= least:
        good, solves, p, norm = frozen_arc(
            system, linear, trial, p_guess, walk.tangent, weight_u, weight_p, point
        )
        walk.numbers[FROZEN] += solves
        if good:
            return True, (solves + 1) // 2, p, norm
        # What is a solution but for a stall is where Newton's method goes on.
        if not norm <= ACCEPTED:
            copy_to(trial, guess)
            p = p_guess
    good, iterations, p, norm = arc_newton(
        system, linear, trial, p, guess, p_guess, walk.tangent, weight_u, weight_p, point,
        control.most_iterations,
    )  # fmt: skip
    walk.numbers[ITERATIONS] += iterations
    return good, iterations, p, norm


@apart
def _to_the_end(
    system: System, linear: Receptance, point: Evaluation, control: Control, walk: Walk, guess: Real,
    p_beyond: float, trial: Real,
) -> tuple[bool, int, float]:  # fmt: skip
    """Solve at the end itself into `trial`, from between here and `guess`, found or predicted beyond it."""
    share = (control.stop - walk.numbers[P]) / (p_beyond - walk.numbers[P])
    for i in range(guess.size):
        guess[i] = walk.u[i] + share * (guess[i] - walk.u[i])
    copy_to(trial, guess)
    receptance(system, control.stop, linear)
    good, iterations, norm = newton(system, linear, trial, control.stop, 0.0, point)
    walk.numbers[ITERATIONS] += iterations
    return good, iterations, norm


@apart
def _step(system: System, linear: Receptance, point: Evaluation, control: Control, walk: Walk) -> int:
    """Make one step; return RUNNING, FINISHED, STALLED or LEFT_RANGE."""
    n = walk.u.size
    guess, trial = np.empty(n), np.empty(n)
    forward = 1.0 if control.stop >= control.start else -1.0
    weight_u, weight_p = weights(system, walk, control)
    while walk.numbers[STEP] >= control.smallest_step:
        step = walk.numbers[STEP] = foreseen_step(system, walk, control, walk.numbers[STEP])
        p_guess = predict(system, walk, control, step, guess)
        last = (p_guess - control.stop) * forward >= 0.0
        good, iterations, p, norm = False, 0, p_guess, np.inf
        if not last:
            good, iterations, p, norm = _correct(
                system, linear, point, control, walk, guess, p_guess, trial, weight_u, weight_p
            )
            if good and (p - control.stop) * forward > 0.0:
                # A solution far from where it was looked for need not be on this branch.
                good = distance(trial, p, guess, p_guess, weight_u, weight_p) <= control.largest_turn * step
                if good:
                    last, p_guess = True, p
                    copy_to(guess, trial)
        if last:
            step *= (control.stop - walk.numbers[P]) / (p_guess - walk.numbers[P])
            good, iterations, norm = _to_the_end(system, linear, point, control, walk, guess, p_guess, trial)
            p = p_guess = control.stop
        if good:
            off = distance(trial, p, guess, p_guess, weight_u, weight_p)
            turned = off / (step + 1e-300)
            if turned > control.largest_turn and step > _TINY * control.smallest_step:
                good = False
        if not good:
            walk.numbers[REJECTED] += 1
            # The first retry keeps the length and trusts the tangent alone: the cubic may reach over a kink.
            smooth = control.predictor == CUBIC and walk.numbers[ROUGH] == 0.0
            walk.numbers[STEP] *= 0.75 if smooth else 0.5
            walk.numbers[ROUGH] = 1.0
            continue
        growth = (control.wanted_iterations + 0.5) / (iterations + 0.5)
        growth = min(growth, math.sqrt(0.3 * control.largest_turn / (turned + 1e-12)))
        walk.numbers[STEP] = (
            min(control.largest_step, step * min(max(growth, 0.5), 2.0)) if not last else step
        )
        if (p - control.start) * forward < -1e-9 * abs(control.stop - control.start):
            return LEFT_RANGE
        accept(walk, trial, p, norm)
        if last:
            _turn(system, linear, point, control, walk)
            return FINISHED
        went = _onward(system, linear, point, control, walk, step)
        if went != TOO_LONG:
            return went
    return STALLED


@apart
def _onward(
    system: System, linear: Receptance, point: Evaluation, control: Control, walk: Walk, step: float
) -> int:
    """Turn the tangent at the point accepted; return RUNNING, STALLED, or TOO_LONG for a step taken back.

    A determinant that changes its sign turns the tangent: at a fold or a corner rightly, at a branch point
    passed in the same step wrongly. A shorter step tells them apart.
    """
    orientation, before = walk.numbers[ORIENTATION], walk.numbers[PIECE]
    if not _turn(system, linear, point, control, walk):
        return STALLED
    if not turned_back(system, control, walk):
        return RUNNING
    if step <= _TINY * control.smallest_step:
        undo(walk, orientation, before)
        return STALLED
    if step <= _SHARP * control.first_step:
        return RUNNING
    undo(walk, orientation, before)
    point.counts[AT_BRANCH_POINT] = 0  # the factors belong to the point not taken
    walk.numbers[STEP] = 0.5 * step
    return TOO_LONG


@apart
def _step_over(system: System, linear: Receptance, point: Evaluation, control: Control, walk: Walk) -> int:
    """Get past a kink: look for a solution a little further in λ, where the tangent points."""
    n = walk.u.size
    span = control.stop - control.start
    forward = math.copysign(1.0, span)
    direction = math.copysign(1.0, walk.tangent[n])
    trial = np.empty(n)
    # Where a part may ratchet there is a stretch of λ without a periodic motion: it is not passed over.
    furthest = (0.05 if system.loose.shape[0] == 0 else 1e-4) * abs(span)
    for rung in range(24):
        away = direction * abs(span) * 1e-7 * 2.0**rung
        p = walk.numbers[P] + away
        last = (p - control.stop) * forward >= 0.0
        if last:
            p = control.stop
        if (p - control.start) * forward < 0.0 or abs(away) > furthest:
            break
        receptance(system, p, linear)
        copy_to(trial, walk.u)
        good, iterations, norm = newton(system, linear, trial, p, 0.0, point)
        walk.numbers[ITERATIONS] += iterations
        # Just beyond a fold the tip of the branch is a solution to the tolerance: it leads nowhere.
        if not good or norm > CLEARLY * ACCEPTED:
            continue
        weight_u, weight_p = weights(system, walk, control)
        if distance(trial, p, walk.u, walk.numbers[P], weight_u, weight_p) > 4.0 * control.largest_step:
            continue
        walk.numbers[STEPPED_OVER] += 1
        accept(walk, trial, p, norm)
        for i in range(n):
            walk.tangent[i] = walk.u[i] - walk.before[i]
        walk.tangent[n] = p - walk.before[n]
        walk.numbers[ORIENTATION], walk.numbers[ROUGH] = 0.0, 1.0
        walk.numbers[STEP] = max(control.first_step * 0.1, 256.0 * control.smallest_step)
        turned = _turn(system, linear, point, control, walk)
        if last:
            return FINISHED
        return RUNNING if turned else STALLED
    return STALLED


@apart
def _turn_over(system: System, linear: Receptance, point: Evaluation, control: Control, walk: Walk) -> int:
    """Get past a kink that is a fold: look for the other piece a little back in λ, where u goes on."""
    n = walk.u.size
    span, t = abs(control.stop - control.start), walk.tangent[n]
    if t == 0.0:
        return STALLED
    trial = np.empty(n)
    furthest = (0.05 if system.loose.shape[0] == 0 else 1e-4) * span
    for rung in range(14):
        share = span * 1e-8 * 4.0**rung / abs(t)
        p = walk.numbers[P] - share * t
        if share * abs(t) > furthest or (p - control.start) * (control.stop - control.start) < 0.0:
            break
        receptance(system, p, linear)
        set_to(trial, walk.u, share, walk.tangent)
        good, iterations, norm = newton(system, linear, trial, p, 0.0, point)
        walk.numbers[ITERATIONS] += iterations
        if not good:
            continue
        # The piece one came on passes through λ = p as well: it is told by the distance to its line.
        weight_u, _ = weights(system, walk, control)
        off, along = 0.0, 0.0
        for i in range(n):
            off += weight_u * (trial[i] - walk.u[i] + share * walk.tangent[i]) ** 2
            along += weight_u * (share * walk.tangent[i]) ** 2
        if off <= 0.01 * along or off > (4.0 * control.largest_step) ** 2:
            continue
        orientation, before = walk.numbers[ORIENTATION], walk.numbers[PIECE]
        accept(walk, trial, p, norm)
        walk.numbers[ROUGH] = 1.0
        walk.numbers[STEP] = max(control.first_step * 0.1, 256.0 * control.smallest_step)
        if not _turn(system, linear, point, control, walk):
            return STALLED
        if not turned_back(system, control, walk):
            walk.numbers[STEPPED_OVER] += 1
            return RUNNING
        undo(walk, orientation, before)
    return STALLED


@compiled
def walk_on(
    system: System, linear: Receptance, point: Evaluation, control: Control, walk: Walk,
    most_points: int, points: Real, tangents: Real, states: Integer, observed: Real, measures: Real,
    springs: Complex,
) -> tuple[int, int]:  # fmt: skip
    """Append up to `most_points` converged points of the branch.

    Parameters
    ----------
    points, tangents : (most_points, nt + 1), λ last; states : (most_points, nc); observed : (most_points, n)
        coefficients of the observed DOF; measures : (most_points, MEASURES), slopes along it; filled.
    springs : (most_points, nk, blocks) the contacts as springs, filled; or of no row where nobody asks.

    Returns
    -------
    (RUNNING or how it ended, number of points appended).
    """
    count = 0
    status = RUNNING
    while status == RUNNING and count < most_points:
        if walk.numbers[FRESH] == 0.0:
            status = _step(system, linear, point, control, walk)
            if status == STALLED:
                status = _step_over(system, linear, point, control, walk)
            if status == STALLED:
                status = _turn_over(system, linear, point, control, walk)
        if walk.numbers[FRESH] > 0.0:
            _record(system, linear, point, walk, count, points, tangents, states, observed, measures)
            if springs.shape[0] > 0:
                fill_springs(system, point, springs[count])
            walk.numbers[FRESH] = 0.0
            count += 1
    return status, count


@apart
def _record(
    system: System, linear: Receptance, point: Evaluation, walk: Walk, row: int,
    points: Real, tangents: Real, states: Integer, observed: Real, measures: Real,
) -> None:  # fmt: skip
    """Write the walk's present point, with what is observed there, into one row of the result."""
    n = walk.u.size
    copy_to(points[row, :n], walk.u)
    points[row, n] = walk.numbers[P]
    copy_to(tangents[row], walk.tangent)
    for c in range(point.states.size):
        states[row, c] = point.states[c]
    measure(system, linear, walk.u, point, walk.tangent[:n], walk.tangent[n], observed[row], measures[row])
    measures[row, RESIDUAL] = walk.numbers[NORM]
