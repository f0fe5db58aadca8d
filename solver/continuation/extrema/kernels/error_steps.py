"""Newton steps of a solution in the balance with more harmonics, and what they change of what is measured."""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.haigh import utilisation
from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.output import extremes, observed_motion
from solver.balance.kernels.residual import evaluate
from solver.contacts.kernels.system import UTILISED, Evaluation, Receptance, System
from solver.continuation.extrema.kernels.suspects import amplitude_in
from solver.jit.decorators import compiled
from solver.jit.fourier import Flags, Real
from solver.jit.lapack import are_finite
from solver.jit.separate import apart
from solver.linear.kernels.receptance import receptance

# The change of the motion at its worst instant counts with this share: max|x| may change little by accident.
_ANYWHERE = 0.1
NEARER, FIRST, SECOND = 0, 1, 2  # rows of what steps change


@apart
def motion_at(
    system: System, linear: Receptance, point: Evaluation, u: Real, p: float, elsewhere: bool, x: Real
) -> bool:
    """Fill `x` with the observed coefficients at (u, λ = p), which is evaluated; False where that failed.

    The receptance is filled at λ = p unless that is where it was filled last (not `elsewhere`).
    """
    if elsewhere:
        receptance(system, p, linear)
    if not math.isfinite(evaluate(system, linear, u, p, 0.0, point)):
        return False
    observed_motion(system, linear, u, point, x)
    return True


@apart
def change_of(system: System, before: Real, after: Real) -> tuple[float, float]:
    """Return the changes of max|x| and of (max x − min x)/2, or twice that of the utilisation.

    They are at least a tenth of those of the motion.
    """
    high, _, low, _ = extremes(system, before)
    high_after, _, low_after, _ = extremes(system, after)
    rise, _, sink, _ = extremes(system, after - before)
    if system.centred == UTILISED:
        used, by_half, by_mean, _, _, _ = utilisation(system.haigh, high, low)
        now, _, _, _, _, _ = utilisation(system.haigh, high_after, low_after)
        least = 0.5 * by_half * (rise - sink) + abs(by_mean) * max(rise, -sink)
        change = max(abs(now - used), _ANYWHERE * least)
        return change, change
    max_abs = abs(max(high_after, -low_after) - max(high, -low))
    half_range = 0.5 * abs(high_after - low_after - high + low)
    return max(max_abs, _ANYWHERE * max(rise, -sink)), max(half_range, 0.5 * _ANYWHERE * (rise - sink))


@compiled
def _largest_motion(system: System, change: Real) -> float:
    """Return the largest amplitude of a harmonic of a change of motions [m], whenever the clock starts."""
    largest = 0.0
    for c in range(system.owner.size):
        for i in range(system.ks.size):
            largest = max(largest, amplitude_in(change, c, system.ks, i))
    return largest


@apart
def step_by(
    system: System, linear: Receptance, point: Evaluation, u: Real, p: float, residual: Real, across: bool,
    x: Real, place: Real, found: Real,
) -> None:  # fmt: skip
    """Take a Newton step from (u, λ = p) with the factors at hand.

    Parameters
    ----------
    residual : (nt,) of the balance; across : whether λ moves too.
    x : (n,) the observed motion before.
    place : (nt + 1,) where the step leads, λ last; filled.
    found : (3,) what it changes, as `change_of`, and its length, the largest change of the contacts' motions
        [m], or of λ; NaN where it leads nowhere; filled.
    """
    n, step, after = u.size, np.zeros(u.size + 1), np.empty(x.size)
    step[:n] = residual
    step_back(system, point, step if across else step[:n])
    for i in range(n):
        place[i] = u[i] - step[i]
    place[n], found[2] = p - step[n], max(_largest_motion(system, step), abs(step[n]))
    found[0], found[1] = math.nan, math.nan
    if are_finite(step) and motion_at(system, linear, point, place[:n], place[n], across, after):
        found[0], found[1] = change_of(system, x, after)


@apart
def steps_beyond(
    system: System, linear: Receptance, point: Evaluation, u: Real, p: float, tangent: Real, nearer: Flags,
    across: bool, x: Real, found: Real,
) -> bool:  # fmt: skip
    """Take steps in the balance with more harmonics from a solution that was evaluated there last.

    Parameters
    ----------
    tangent : (nt + 1,) of the branch, λ last, across which the steps go if `across`.
    nearer : (n,) which coefficients are not of the farthest of the harmonics added.
    x : (n,) the observed motion without these harmonics.
    found : (3, 3) of the step by the residual of the nearer harmonics, of that by the whole one and of a
        second one behind it with the same factors: as `step_by`; filled.

    Returns
    -------
    False where the matrix is singular, or a step leads nowhere.
    """
    n, size, weight_u, weight_p = u.size, 1e-150, 0.0, 0.0
    if across:  # u and λ each count relative to their size
        for i in range(n):
            size = max(size, abs(u[i]))
        weight_u, weight_p = 1.0 / (size * size), 1.0 / (p * p if p != 0.0 else 1.0)
    if factorise(system, linear, point, tangent, weight_u, weight_p) == 0.0:
        return False
    residual, place = point.residual.copy(), np.empty(n + 1)
    part = residual.copy()
    for i in range(n):
        part[i] *= 1.0 if nearer[i % nearer.size] else 0.0
    step_by(system, linear, point, u, p, part, across, x, place, found[NEARER])
    step_by(system, linear, point, u, p, residual, across, x, place, found[FIRST])
    u, p = place[:n].copy(), place[n]
    step_by(system, linear, point, u, p, point.residual.copy(), across, x, place, found[SECOND])
    return are_finite(found[NEARER]) and are_finite(found[FIRST]) and are_finite(found[SECOND])
