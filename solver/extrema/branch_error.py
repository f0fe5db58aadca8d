"""How far off the highest peak of a branch is: the estimate of the peak found, and what would stand above it.

With few harmonics the highest peak may be another one: where k ω meets a resonance and harmonic k was left
out, the branch shows nothing of it. The contact forces that drive it are there, in closed form, beyond the
harmonics kept. They are evaluated at some points of the branch and change little between these; every
resonance of the structure with its contacts (`solver.extrema.closed_loop_poles`) that such a harmonic meets
is driven by them, and the motion it adds follows without a further solution. Where that, or several times
that, would reach above the peak found, the response near it is followed with enough harmonics, and its peak
counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solver.balance.balance import Balance
from solver.balance.kernels.output import MAX_ABS
from solver.balance.kernels.residual import evaluate
from solver.balance.more_harmonics import more_harmonics, pad
from solver.balance.parameter import Kind
from solver.balance.workspace import Workspace
from solver.contacts.kernels.columns import COULOMB
from solver.contacts.kernels.system import DENSE, MODES, evaluation_by_value
from solver.contacts.slopes import amplitudes, harmonic_stiffness
from solver.continuation.branch import Peak
from solver.extrema.closed_loop_poles import ClosedLoop
from solver.extrema.error_estimate import SAFETY, ErrorEstimator
from solver.extrema.nodes import Points
from solver.jit.fourier import Complex, Real
from solver.scene.harmonics import spread

# Follows a balance between two λ from a first guess; returns the highest peak there, None without a solution.
Follow = Callable[[Balance, float, float, Real], Peak | None]

_SAMPLES = 16  # points of the branch whose contact forces are looked at
_FEW_SAMPLES = 8  # those that tell whether it is worth while
_NEAR = 1.05  # how far beyond the places of a resonance the amplitude counts
# The motion that a resonance adds changes what the contacts do, and with it the force that drives it: it may
# become so many times what is predicted.
_FEEDBACK = 8.0
_RIVAL, _RIVALS = 0.7, 3  # share of the highest peak, and how many of those above it are judged
_FOLLOWED = 3  # resonances that are followed, at most
_MEET = 4  # rounds in which a resonance and the forces at its place are made to agree
_REACH = 0.02  # least share of a frequency that is followed on either side of a resonance
_WIDTHS = 20.0  # half widths of it that are
_ABOVE = 1.4  # harmonics with which harmonic k is followed, in units of k


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Sample:
    """The contacts at one point of the branch, with the harmonics of the larger balance."""

    at: float
    amplitude: float
    u: Real
    F: Complex  # (nk, nc), less what the shift carries
    stiffness: Complex  # (nk, nc, nc)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Resonance:
    """A resonance that harmonic number `harmonic` of the larger balance meets between two samples."""

    at: float
    half_width: float
    harmonic: int
    added: float  # predicted motion by it [m]
    height: float  # of the amplitude with it [m]
    guess: Real


def branch_error(
    workspace: Workspace, points: Points, peaks: tuple[Peak, ...], follow: Follow | None
) -> float:
    """Estimate the error of the highest peak of a branch [m]; NaN if there is none.

    Parameters
    ----------
    points : of the branch.
    peaks : of the branch, highest first.
    follow : solves near a resonance with more harmonics; None where the caller has no time for it.
    """
    if not peaks:
        return math.nan
    estimator, inside = ErrorEstimator(workspace), workspace.balance.parameter.inside
    errors = [
        estimator.at(peak.solution, float(inside(peak.at)), across=True).max_abs for peak in _rivals(peaks)
    ]
    estimate = errors[0]
    if not math.isfinite(estimate):
        return math.nan
    reached = max(p.value + e for p, e in zip(_rivals(peaks), errors, strict=True) if math.isfinite(e))
    over_frequency = workspace.balance.parameter.kind is Kind.FREQUENCY
    if follow is not None and over_frequency and workspace.balance.n_unknowns > 0:
        look = _Look(workspace.balance, estimator.larger, points)
        for one in look.above(reached)[:_FOLLOWED]:
            reached = max(reached, look.followed(one, follow))
    return max(estimate, reached - peaks[0].value)


def _rivals(peaks: tuple[Peak, ...]) -> tuple[Peak, ...]:
    """Return the highest peak and those that may be the highest of all when the errors are mended."""
    near = [peak for peak in peaks[1:] if peak.value >= _RIVAL * peaks[0].value]
    return (peaks[0], *near[:_RIVALS])


class _Look:
    """Looks for resonances that the harmonics left out meet, between samples of a branch."""

    def __init__(self, balance: Balance, larger: Workspace, points: Points) -> None:
        self._kept, self._larger, self._points = balance, larger, points
        self._loop = ClosedLoop(larger.balance)
        self._samples: list[_Sample] = []
        ks = larger.balance.system.ks
        self._beyond = np.flatnonzero(~np.isin(ks, balance.system.ks))

    def _sample(self, points: Points, i: int) -> _Sample | None:
        larger, row = self._larger, points.solutions[i]
        u = pad(row[:-1], self._kept, larger.balance)
        evaluate(larger.system, larger.linear, u, float(row[-1]), 0.0, larger.point)
        point, system = evaluation_by_value(larger.point), larger.balance.system
        if not (np.all(np.isfinite(point.F)) and np.all(np.isfinite(point.dF_dU))):
            return None
        F = point.F - system.shift[:, None] * u.reshape(point.F.shape)
        return _Sample(
            at=float(row[-1]), amplitude=float(points.measures[i, MAX_ABS]), u=u,
            F=amplitudes(F, system), stiffness=harmonic_stiffness(system, point),
        )  # fmt: skip

    def above(self, reached: float) -> list[_Resonance]:
        """Return the resonances at which the amplitude would be above `reached`, the highest first."""
        suspects = self._suspects(reached)
        if not suspects:
            return []
        chosen = _chosen(self._points, _SAMPLES)
        self._samples = [s for i in chosen if (s := self._sample(self._points, i)) is not None]
        found = []
        at = np.array([sample.at for sample in self._samples])
        for i in suspects:
            stiffness = np.array([sample.stiffness[i] for sample in self._samples])
            poles = self._loop.of_harmonic(stiffness, int(i), at)
            order = np.argsort(poles.at, axis=1)
            ahead = np.take_along_axis(poles.at, order, axis=1) - at[:, None]
            widths = np.take_along_axis(poles.half_width, order, axis=1)
            meets = (ahead[:-1] > 0.0) != (ahead[1:] > 0.0)
            for j, m in zip(*np.nonzero(meets), strict=True):
                left, right = self._samples[j], self._samples[j + 1]
                width = min(widths[j, m], widths[j + 1, m])
                amplitude = max(left.amplitude, right.amplitude)
                if amplitude + _FEEDBACK * self._bound(left, right, int(i), float(width)) <= reached:
                    continue
                one = self._met(left, right, int(i), int(m), ahead[j, m] / (ahead[j, m] - ahead[j + 1, m]))
                if one.height + (_FEEDBACK - 1.0) * one.added > reached:
                    found.append(one)
        return sorted(found, key=lambda one: -(one.height + _FEEDBACK * one.added))

    def _suspects(self, reached: float) -> list[int]:
        """Return the numbers of the harmonics that may reach above `reached` at a resonance.

        Contacts that are springs between nothing and full stick move the m-th resonance at most from its
        place with all contacts free to that with all stuck (Weyl's inequalities), and do not narrow it.
        """
        system, points = self._loop.system, self._points
        if system.form == DENSE or not bool(np.all(system.laws == COULOMB)):
            return [int(i) for i in self._beyond]
        chosen = _chosen(points, _FEW_SAMPLES)
        F = self._forces(chosen)
        at, amplitude = points.solutions[:, -1], points.measures[:, MAX_ABS]
        low, high, suspects = float(at.min()), float(at.max()), []
        for i in self._beyond:
            k, s = float(system.ks[i]), int(system.which[i])
            free, stuck = self._loop.free[s], self._loop.stuck[s]
            begin, end = free.at / k, np.maximum(stuck.at, free.at) / k
            width = np.minimum(free.half_width, stuck.half_width) / k
            driven = float(np.linalg.norm(F[i] @ system.contact_duals[s], axis=1).max(initial=0.0))
            seen = float(np.linalg.norm(system.observe_modes[s]))
            for m in np.flatnonzero((begin <= high) & (end >= low)):
                near = amplitude[(at >= begin[m] / _NEAR) & (at <= end[m] * _NEAR)]
                slow = 2.0 * k * max(float(begin[m]), low) if system.form == MODES else 1.0
                narrow = slow * k * float(width[m])
                added = seen * driven / narrow if narrow > 0.0 else math.inf
                if float(near.max(initial=float(amplitude.min()))) + _FEEDBACK * added > reached:
                    suspects.append(int(i))
                    break
        return suspects

    def _forces(self, chosen: list[int]) -> Complex:
        """Return the contact forces (nk, P, nc) at points of the branch."""
        larger, kept, rows = self._larger, self._kept, self._points.solutions[chosen]
        narrow = rows[:, :-1].reshape(len(chosen), kept.n_ports, -1)
        U = spread(narrow, kept.system.ks, larger.balance.system.ks)
        forces = np.zeros_like(U)
        for u, row, F in zip(U, rows, forces, strict=True):
            evaluate(larger.system, larger.linear, u.reshape(-1), float(row[-1]), 0.0, larger.point)
            F[:] = evaluation_by_value(larger.point).F
        return amplitudes(np.nan_to_num(forces), larger.balance.system)

    def _bound(self, left: _Sample, right: _Sample, i: int, width: float) -> float:
        """Return what a resonance of some half width in ω can add at most [m]; infinite without modes."""
        system = self._loop.system
        if system.form == DENSE or width <= 0.0:
            return math.inf
        s, k = int(system.which[i]), float(system.ks[i])
        driven = max(float(np.linalg.norm(sample.F[i] @ system.contact_duals[s])) for sample in (left, right))
        seen = float(np.linalg.norm(system.observe_modes[s]))
        slow = 2.0 * k * min(left.at, right.at) if system.form == MODES else 1.0
        return seen * driven / (slow * k * width)

    def _met(self, left: _Sample, right: _Sample, i: int, m: int, share: float) -> _Resonance:
        """Return the resonance where the contacts are those at its own place, with the motion it adds."""
        half_width = 0.0
        for _ in range(_MEET):
            at = (1.0 - share) * left.at + share * right.at
            stiffness = (1.0 - share) * left.stiffness[i] + share * right.stiffness[i]
            poles = self._loop.of_harmonic(stiffness[None], i, np.array([at]))
            order = np.argsort(poles.at[0])
            pole, half_width = float(poles.at[0][order[m]]), float(poles.half_width[0][order[m]])
            moved = (pole - left.at) / (right.at - left.at) if right.at != left.at else share
            share = min(max(moved, 0.0), 1.0)
        at = (1.0 - share) * left.at + share * right.at
        linear = self._larger.receptance(at)
        F = (1.0 - share) * left.F[i] + share * right.F[i]
        stiffness = (1.0 - share) * left.stiffness[i] + share * right.stiffness[i]
        A, B = linear.A[0, i], linear.B[0, i]
        moved_stiffness = stiffness - np.diag(self._loop.system.shift)
        change = -np.linalg.lstsq(np.eye(A.shape[0]) + A @ moved_stiffness, A @ F, rcond=None)[0]
        added = float(abs(B @ (F + moved_stiffness @ change)))
        amplitude = (1.0 - share) * left.amplitude + share * right.amplitude
        guess = (1.0 - share) * left.u + share * right.u
        return _Resonance(
            at=at, half_width=half_width, harmonic=i, added=added, height=amplitude + added, guess=guess
        )

    def followed(self, one: _Resonance, follow: Follow) -> float:
        """Return what the amplitude near a resonance may reach: its peak with more harmonics, and its error.

        Where no solution is found there the motion predicted counts.
        """
        k = int(self._loop.system.ks[one.harmonic])
        top = max(math.ceil(_ABOVE * k), self._larger.balance.n_harmonics)
        wide = more_harmonics(self._kept, top)
        reach = max(_REACH * one.at, _WIDTHS * one.half_width)
        guess = pad(one.guess, self._larger.balance, wide)
        peak = follow(wide, one.at - reach, one.at + reach, guess)
        if peak is None:
            return one.height
        error = ErrorEstimator(Workspace.of(wide)).at(
            peak.solution, float(wide.parameter.inside(peak.at)), across=True
        )  # fmt: skip
        return peak.value + (error.max_abs if math.isfinite(error.max_abs) else SAFETY * peak.value)


def _chosen(points: Points, count: int) -> list[int]:
    """Return the points looked at, evenly along the curve of the amplitude over λ."""
    at, amplitude = points.solutions[:, -1], points.measures[:, MAX_ABS]
    if at.size <= count:
        return list(range(at.size))
    span = max(float(np.ptp(at)), 1e-300)
    steps = np.abs(np.diff(at)) / span + np.abs(np.diff(amplitude)) / max(float(np.ptp(amplitude)), 1e-300)
    along = np.append(0.0, np.cumsum(steps))
    wanted = np.searchsorted(along, np.linspace(0.0, along[-1], count))
    return [int(i) for i in np.unique(np.minimum(wanted, at.size - 1))]
