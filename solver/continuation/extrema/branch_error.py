"""How far off the highest peak of a branch is: the estimate of the peak found, and what would stand above it.

With few harmonics the highest peak may be another one: where k ω meets a resonance and harmonic k was left
out, the branch shows nothing of it. The contact forces that drive it are there, in closed form, beyond the
harmonics kept. They are evaluated at some points of the branch and change little between these; every
resonance of the structure with its contacts (`solver.balance.closed_loop_poles`) that such a harmonic meets
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
from solver.balance.kernels.linearised_contacts import forces_at
from solver.balance.kernels.output import MAX_ABS
from solver.balance.kernels.residual import evaluate
from solver.balance.more_harmonics import more_harmonics, pad
from solver.balance.parameter import Kind
from solver.balance.rounding import observed_rounding
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import DENSE, MODES
from solver.continuation.branch import Points
from solver.continuation.extrema.driven import Way, may_exceed
from solver.continuation.extrema.error_estimate import SAFETY, ErrorEstimator
from solver.continuation.extrema.kernels.suspects import find_reaching
from solver.continuation.peak import Peak
from solver.jit.fourier import Complex, Flags, Real
from solver.linear.kernels.receptance import receptance
from solver.scene.scene_harmonics import among, spread

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
_LEAST = 0.1  # of its frequency, from which a resonance is followed at least
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

    It is infinite where rounding alone may be as much as the peak: nothing that is known damps it.

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
        # At an end of the branch nothing moves along: the error is that at a fixed λ.
        estimator.at(peak.solution, float(inside(peak.at)), across=peak.interior).max_abs
        for peak in _rivals(peaks)
    ]
    estimate = errors[0]
    if estimate >= peaks[0].value and _nothing_damps(workspace, points, peaks[0]):
        return math.inf
    if not math.isfinite(estimate):
        return math.nan
    reached = max(p.value + e for p, e in zip(_rivals(peaks), errors, strict=True) if math.isfinite(e))
    over_frequency = workspace.balance.parameter.kind is Kind.FREQUENCY
    if follow is not None and over_frequency and workspace.balance.n_unknowns > 0:
        look = _Look(workspace.balance, estimator.larger, points)
        for one in look.above(reached)[:_FOLLOWED]:
            reached = max(reached, look.followed(one, follow))
    return max(estimate, reached - peaks[0].value)


def _nothing_damps(workspace: Workspace, points: Points, peak: Peak) -> bool:
    """Return whether no digit of a maximum over the frequency is more than rounding, beside which there are.

    Where there are none beside it either, what is observed does not move.
    """
    parameter = workspace.balance.parameter
    if not peak.interior or parameter.kind is not Kind.FREQUENCY:
        return False
    every = [(peak.solution, float(parameter.inside(peak.at)), peak.value)]
    every += [
        (points.solutions[i, :-1], float(points.solutions[i, -1]), float(np.abs(points.observed[i]).max()))
        for i in (0, -1)
    ]
    at_peak, *at_ends = (_is_rounding(workspace, *one) for one in every)
    return at_peak and not all(at_ends)


def _is_rounding(workspace: Workspace, solution: Real, p: float, value: float) -> bool:
    receptance(workspace.system, p, workspace.linear)
    evaluate(workspace.system, workspace.linear, solution, p, 0.0, workspace.point)
    return not observed_rounding(workspace, solution, p, across=True) < value


def _rivals(peaks: tuple[Peak, ...]) -> tuple[Peak, ...]:
    """Return the highest peak and those that may be the highest of all when the errors are mended."""
    near = [peak for peak in peaks[1:] if peak.value >= _RIVAL * peaks[0].value]
    return (peaks[0], *near[:_RIVALS])


class _Look:
    """Looks for resonances that the harmonics left out meet, between samples of a branch."""

    def __init__(self, balance: Balance, larger: Workspace, points: Points) -> None:
        self._kept, self._larger, self._points = balance, larger, points
        self._loop = larger.loop
        self._samples: list[_Sample] = []
        ks = larger.balance.system.ks
        self._beyond = np.flatnonzero(~among(balance.system.ks, ks))

    def _sampled(self) -> list[_Sample]:
        """Return points all along the branch, without those where the contacts have no force."""
        larger = self._larger
        chosen = _chosen(self._points, _SAMPLES)
        rows = self._wide_rows(chosen)
        ks, nc = larger.balance.system.ks, larger.balance.n_ports
        forces = np.empty((len(chosen), ks.size, nc), np.complex128)
        stiffness = np.empty((len(chosen), ks.size, nc, nc), np.complex128)
        forces_at(larger.system, larger.point, rows, forces, stiffness)
        return [
            _Sample(
                at=float(rows[j, -1]), amplitude=float(self._points.measures[i, MAX_ABS]), u=rows[j, :-1],
                F=forces[j], stiffness=stiffness[j],
            )
            for j, i in enumerate(chosen)
            if np.all(np.isfinite(forces[j])) and np.all(np.isfinite(stiffness[j]))
        ]  # fmt: skip

    def _wide_rows(self, chosen: list[int]) -> Real:
        """Return points of the branch with the harmonics of the larger balance, λ last."""
        kept, rows = self._kept, self._points.solutions[chosen]
        narrow = rows[:, :-1].reshape(len(chosen), kept.n_ports, -1)
        wide = spread(narrow, kept.system.ks, self._larger.balance.system.ks)
        return np.hstack([wide.reshape(len(chosen), -1), rows[:, -1:]])

    def above(self, reached: float) -> list[_Resonance]:
        """Return the resonances at which the amplitude would be above `reached`, the highest first."""
        suspects = self._suspects(reached)
        if not suspects:
            return []
        self._samples = self._sampled()
        found = []
        for i, may in zip(suspects, self._may_reach(suspects, reached), strict=True):
            needed = np.append(may, False) | np.append(False, may)
            if not needed.any():
                continue
            at = np.array([sample.at for sample in self._samples])
            stiffness = np.array([sample.stiffness[i] for sample in self._samples])[needed]
            poles = self._loop.of_harmonics(stiffness, np.full(len(stiffness), i), at[needed])
            order = np.argsort(poles.at, axis=1)
            ahead = np.full((at.size, order.shape[1]), np.nan)
            ahead[needed] = np.take_along_axis(poles.at, order, axis=1) - at[needed, None]
            widths = np.full(ahead.shape, np.nan)
            widths[needed] = np.take_along_axis(poles.half_width, order, axis=1)
            meets = ((ahead[:-1] > 0.0) != (ahead[1:] > 0.0)) & may[:, None]
            for j, m in zip(*np.nonzero(meets), strict=True):
                left, right = self._samples[j], self._samples[j + 1]
                width = min(widths[j, m], widths[j + 1, m])
                amplitude = max(left.amplitude, right.amplitude)
                if amplitude + _FEEDBACK * self._bound(left, right, i, float(width)) <= reached:
                    continue
                one = self._met(left, right, i, int(m), ahead[j, m] / (ahead[j, m] - ahead[j + 1, m]))
                if one.height + (_FEEDBACK - 1.0) * one.added > reached:
                    found.append(one)
        return sorted(found, key=lambda one: -(one.height + _FEEDBACK * one.added))

    def _may_reach(self, suspects: list[int], reached: float) -> Flags:
        """Return where the amplitude may be above `reached`: (suspects, ways from sample to sample).

        What is left out here is what `above` would leave out when it knew the motion.
        """
        samples, count = self._samples, len(self._samples) - 1
        if count < 1:
            return np.zeros((len(suspects), 0), bool)
        amplitude = np.array([sample.amplitude for sample in samples])
        allowed = (reached - np.maximum(amplitude[:-1], amplitude[1:])) / _FEEDBACK
        ends = np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)
        at = np.array([sample.at for sample in samples])[ends]
        stiffness = np.array([sample.stiffness[suspects] for sample in samples])[ends]
        forces = np.array([sample.F[suspects] for sample in samples])[ends]
        nc, size = forces.shape[-1], len(suspects)
        way = Way(
            numbers=np.repeat(suspects, count), at=np.tile(at, (size, 1)),
            stiffness=np.moveaxis(stiffness, 2, 0).reshape(size * count, 2, nc, nc),
            forces=np.moveaxis(forces, 2, 0).reshape(size * count, 2, nc),
        )  # fmt: skip
        return may_exceed(self._loop.system, way, np.tile(allowed, size)).reshape(size, count)

    def _suspects(self, reached: float) -> list[int]:
        """Return the numbers of the harmonics that may reach above `reached` at a resonance."""
        system, points = self._loop.system, self._points
        if system.form == DENSE or not bool(np.all(system.jenkins == 1)):
            return [int(i) for i in self._beyond]
        larger, nc = self._larger, self._larger.balance.n_ports
        rows = self._wide_rows(_chosen(points, _FEW_SAMPLES))
        forces = np.empty((len(rows), system.ks.size, nc), np.complex128)
        nothing = np.empty((0, system.ks.size, nc, nc), np.complex128)
        forces_at(larger.system, larger.point, rows, forces, nothing)
        may = np.empty(self._beyond.size, bool)
        find_reaching(
            larger.system, *self._loop.range, points.solutions, points.measures[:, MAX_ABS], forces,
            self._beyond, _NEAR, _FEEDBACK, reached, may,
        )  # fmt: skip
        return [int(i) for i in self._beyond[may]]

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
            poles = self._loop.of_harmonics(stiffness[None], np.array([i]), np.array([at]))
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
        # A resonance with much damping is wider than its frequency is high.
        peak = follow(wide, max(one.at - reach, _LEAST * one.at), one.at + reach, guess)
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
    wanted = np.searchsorted(along, along[-1] / (count - 1) * np.arange(count))
    return sorted(set(np.minimum(wanted, at.size - 1).tolist()))
