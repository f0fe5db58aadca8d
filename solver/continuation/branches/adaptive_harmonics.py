"""As many harmonics as an asked accuracy takes: grown from the solution at hand, judged by the estimate."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solver.balance.balance import Balance, less_harmonics, more_harmonics, pad
from solver.balance.kernels.output import HALF_RANGE, MAX_ABS
from solver.balance.workspace import PointSolution, Workspace
from solver.continuation.branch import Branch, BranchStatus
from solver.continuation.extrema.error_estimate import ErrorEstimator
from solver.continuation.from_nothing import solve_from_nothing
from solver.errors import SettingError
from solver.jit.fourier import Real

FIRST_HARMONICS = 5
FIRST_TRIES = (FIRST_HARMONICS, 11, 23)  # where the first finds no solution, the next may
MOST_HARMONICS = 255
# Unknowns beyond which no harmonics are added: the estimate solves for twice as many.
_MOST_UNKNOWNS = 1500
# Errors of force laws with kinks fall like 1/H³; a step in H aims a fifth below the goal and stays in limits.
_AIM, _LEAST_GROWTH, _MOST_GROWTH = 1.2, 1.25, 3.0
# On a branch: points looked at beside the peaks, and the share of the highest amplitude below which an error
# is relative to that share (amplitudes near zero have no relative accuracy worth its cost).
_LOOKED_AT = 24
_FLOOR = 0.1
_MOST_SWEEPS = 8
_WORST = 3  # points of a branch at which the harmonics needed are found by trying


@dataclass(frozen=True, slots=True, kw_only=True)
class _Attempt:
    """A solution with some number of harmonics, and its estimated error over the allowed one."""

    workspace: Workspace
    found: PointSolution
    excess: float

    @property
    def harmonics(self) -> int:
        return self.workspace.balance.n_harmonics

    @property
    def good(self) -> bool:
        return self.excess <= 1.0


def check_accuracy(accuracy: float) -> float:
    """Return `accuracy` as a float; SettingError if it is no number above 0 and below 1."""
    good = isinstance(accuracy, (int, float, np.number)) and not isinstance(accuracy, bool)
    if not good or not 0.0 < accuracy < 1.0:
        raise SettingError("accuracy", accuracy, "must be a relative error > 0 and < 1")
    return float(accuracy)


def limit_of(balance: Balance) -> int:
    """Return the highest harmonic an answer to an asked accuracy may have."""
    ports = max(balance.n_unknowns // max(balance.n_coefficients, 1), 1)
    return max(3 * FIRST_HARMONICS, min(MOST_HARMONICS, _MOST_UNKNOWNS // (2 * ports)))


def solve_to(
    build_with: Callable[[int], Balance], p: float, accuracy: float
) -> tuple[Workspace, PointSolution, bool]:
    """Solve at λ = `p` (inside unit) with the fewest harmonics whose estimated error is small enough.

    Parameters
    ----------
    build_with : returns the balance with a given number of harmonics.
    accuracy : error of the amplitude relative to it.

    Returns
    -------
    (workspace, solution, whether the accuracy is met); where no try converged, the last of them.
    """
    check_accuracy(accuracy)
    for harmonics in FIRST_TRIES:
        workspace = Workspace.of(build_with(harmonics))
        found = solve_from_nothing(workspace, p)
        if found.converged:
            break
    if not found.converged:
        return workspace, found, False
    best = _fewest(_judged(workspace, found, p, accuracy), p, accuracy)
    return best.workspace, best.found, best.good


def _judged(
    workspace: Workspace, found: PointSolution, p: float, accuracy: float, size: float | None = None
) -> _Attempt:
    """Return a solution with its estimated error over `accuracy` times its amplitude (or `size`)."""
    measures = workspace.measure(found.u, p)
    estimate = ErrorEstimator(workspace).at(found.u, p, across=size is not None)
    if measures is None:
        return _Attempt(workspace=workspace, found=found, excess=math.inf)
    # A part that only contacts hold may have no mean: its range is what can be accurate.
    loose = bool(np.any(workspace.balance.system.shift > 0.0))
    error = estimate.half_peak_to_peak if loose else estimate.max_abs
    amplitude = float(measures.values[HALF_RANGE if loose else MAX_ABS]) if size is None else size
    excess = error / (accuracy * amplitude) if amplitude > 0.0 else 0.0 if error == 0.0 else math.inf
    return _Attempt(workspace=workspace, found=found, excess=excess if math.isfinite(excess) else math.inf)


def _fewest(first: _Attempt, p: float, accuracy: float, size: float | None = None) -> _Attempt:
    """Return the attempt with the fewest harmonics that is good, or with the most if none is."""
    limit = limit_of(first.workspace.balance)
    low, high = first, first
    while not high.good:
        if high.harmonics >= limit:
            return high
        count = min(next_harmonics(high.harmonics, high.excess), limit)
        grown = _with(high, count, p, accuracy, size)
        if grown is None:
            return high
        low, high = high, grown
    while not low.good and high.harmonics - low.harmonics > 1:
        middle = _with(high, (low.harmonics + high.harmonics) // 2, p, accuracy, size)
        if middle is None:
            return high
        low, high = (low, middle) if middle.good else (middle, high)
    return high


def next_harmonics(harmonics: int, excess: float) -> int:
    """Return how many harmonics to try where the error is `excess` times the allowed one."""
    growth = (_AIM * excess) ** (1.0 / 3.0) if math.isfinite(excess) else _MOST_GROWTH
    return math.ceil(harmonics * min(max(growth, _LEAST_GROWTH), _MOST_GROWTH))


def _with(like: _Attempt, harmonics: int, p: float, accuracy: float, size: float | None) -> _Attempt | None:
    """Return the same response with another number of harmonics; None where Newton's method fails."""
    known = like.workspace.balance
    other = more_harmonics if harmonics >= known.n_harmonics else less_harmonics
    workspace = Workspace.of(other(known, harmonics))
    found = workspace.solve(p, pad(like.found.u, known, workspace.balance))
    if not found.converged:
        return None
    spent = like.found.iterations + found.iterations
    total = PointSolution(converged=True, u=found.u, iterations=spent, residual=found.residual)
    return _judged(workspace, total, p, accuracy, size)


def sweep_to(sweep_with: Callable[[int], Branch], accuracy: float) -> Branch:
    """Return a branch with as many harmonics as `accuracy` takes, see `harmonics_for`.

    Parameters
    ----------
    sweep_with : returns the branch with a given number of harmonics.

    Returns
    -------
    The last branch computed, the iterations and seconds those of all. Its status tells where it did not reach
    the end of the range, or the accuracy.
    """
    check_accuracy(accuracy)
    branch = sweep_with(FIRST_HARMONICS)
    iterations, seconds = branch.newton_iterations, branch.seconds
    met = False
    for _ in range(_MOST_SWEEPS):
        harmonics, limit = branch.balance.n_harmonics, limit_of(branch.balance)
        given_up = not branch.reached and harmonics >= FIRST_TRIES[-1]
        if branch.status is BranchStatus.STOPPED or given_up or harmonics >= limit:
            met = branch.reached and harmonics_for(branch, accuracy) is None
            break
        needed = harmonics_for(branch, accuracy) if branch.reached else min(2 * harmonics + 1, limit)
        if needed is None:
            met = True
            break
        branch = sweep_with(needed)
        iterations += branch.newton_iterations
        seconds += branch.seconds
    status = branch.status if met or not branch.reached else BranchStatus.ACCURACY_NOT_REACHED
    return replace(branch, status=status, newton_iterations=iterations, seconds=seconds)


def harmonics_for(branch: Branch, accuracy: float) -> int | None:
    """Return how many harmonics a branch should have had; None if its own are enough.

    The estimated errors at its peaks and at points all along it, measured across the branch, are held against
    `accuracy` times the amplitude there (a tenth of the highest amplitude at least). At the worst of them the
    harmonics needed are found by trying.
    """
    balance = branch.balance
    workspace = Workspace.of(balance)
    estimator = ErrorEstimator(workspace)
    floor = _FLOOR * float(branch.amplitude.max())
    points = _points(branch)
    excesses = []
    for u, p, amplitude in points:
        error = estimator.at(u, p, across=True).max_abs
        allowed = accuracy * max(amplitude, floor)
        excesses.append(error / allowed if math.isfinite(error) else math.inf)
    # What the whole branch may be wrong by includes peaks that its harmonics do not show.
    hidden = branch.error_estimate / (accuracy * branch.peaks[0].value) if branch.peaks else 0.0
    hidden = hidden if math.isfinite(hidden) else 0.0
    if max(*excesses, hidden) <= 1.0:
        return None
    needed = balance.n_harmonics + 1
    if hidden > max(1.0, *excesses):
        needed = max(needed, next_harmonics(balance.n_harmonics, hidden))
    for index in np.argsort(excesses)[::-1][:_WORST]:
        u, p, amplitude = points[index]
        if excesses[index] <= 1.0:
            break
        found = PointSolution(converged=True, u=u, iterations=0, residual=0.0)
        start = _Attempt(workspace=workspace, found=found, excess=excesses[index])
        best = _fewest(start, p, accuracy, max(amplitude, floor))
        wanted = best.harmonics if best.good else next_harmonics(best.harmonics, best.excess)
        needed = max(needed, wanted)
    return min(needed, limit_of(balance))


def _points(branch: Branch) -> list[tuple[Real, float, float]]:
    """Return (u, λ, amplitude) of the peaks and of points all along a branch."""
    inside = branch.balance.parameter.inside
    points = [(peak.solution, float(inside(peak.at)), peak.value) for peak in branch.interior_peaks]
    stride = max(len(branch.values) // _LOOKED_AT, 1)
    for row, amplitude in zip(branch.solutions[::stride], branch.amplitude[::stride], strict=True):
        points.append((row[:-1], float(row[-1]), float(amplitude)))
    return points
