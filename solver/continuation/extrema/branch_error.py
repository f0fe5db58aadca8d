"""How far off the highest peak of a branch is: the estimate of the peak found, and what would stand above it.

With few harmonics the highest peak may be another one: where k ω meets a resonance and harmonic k was left
out, the branch shows nothing of it. The contact forces that drive it are there, in closed form, beyond the
harmonics kept. They are evaluated at some points of the branch and change little between these; every
resonance of the structure with its contacts (`solver.balance.closed_loop_poles`) that such a harmonic meets
is driven by them, and the motion it adds follows without a further solution. Where that, or several times
that, would reach above the peak found, the response near it is followed with enough harmonics, and its peak
counts.

Most resonances are left out by a bound of what the forces can drive between two points (`may_exceed`).
There λ = ω, the forces and the contacts' answer to small changes are taken as linear in
t ∈ [−1, 1]. The motion that the forces F of harmonic k add is x = o D⁻¹ f with f = Yᵀ F and, in the words of
`solver.balance.closed_loop_poles`,

    modes:  D = diag(ω_m² − (kω)² + ikω c_m) + Yᵀ ĝ X,     poles:  D = diag(ikω − s_m) + Yᵀ ĝ X,

so D = D_c + t E − t² e with numbers e. With R = D_c⁻¹, y = R f and a = o R the Neumann series gives

    |x| ≤ |o y| + |a E_t y| + ‖a E_t‖ ‖R E_t y‖ / (1 − ‖R E_t‖),     E_t = t E − t² e,

wherever ‖R E_t‖ < 1. Each term is bounded for all t by the triangle inequality, and the norm of a matrix by
the least of √(Σ|·|²) and √(‖·‖₁ ‖·‖∞). No eigenvalue is needed, and an inverse costs far less than they do.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.balance.balance import Balance, Kind, more_harmonics, pad
from solver.balance.closed_loop_poles import MOST_MODES, coupled
from solver.balance.kernels.linearised_contacts import forces_at
from solver.balance.kernels.output import MAX_ABS
from solver.balance.kernels.residual import evaluate
from solver.balance.rounding import observed_rounding
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import DENSE, MODES, System
from solver.continuation.branch import Peak, Points
from solver.continuation.extrema.error_estimate import SAFETY, ErrorEstimator
from solver.continuation.extrema.kernels.suspects import find_reaching
from solver.jit.fourier import Complex, Flags, Integer, Real
from solver.linear.kernels.receptance import receptance
from solver.scene.scene_harmonics import among, spread

_MOST_HALVINGS = 2  # of the way between two points: more would cost what the eigenvalues do
_MOST_ENTRIES = 1_000_000  # of the matrices that are looked at together

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
class Way:
    """Ways between two points each, S of them, for one harmonic each."""

    numbers: Annotated[Integer, "(S,) of the harmonics in `System.ks`, not the mean."]
    at: Annotated[Real, "(S, 2) ω at both ends [rad/s]."]
    stiffness: Annotated[
        Complex, "(S, 2, nc, nc) of the contacts against small changes of the harmonic [N/m]."
    ]
    forces: Annotated[Complex, "(S, 2, nc) amplitudes of it [N], less what the shift carries."]

    def only(self, some: Integer | Flags) -> Way:
        """Return some of them."""
        return Way(
            numbers=self.numbers[some], at=self.at[some], stiffness=self.stiffness[some],
            forces=self.forces[some],
        )  # fmt: skip


def may_exceed(system: System, way: Way, allowed: Real) -> Flags:
    """Return whether the observed motion may exceed `allowed` (S,) [m]; True where it is not told."""
    may = np.ones(len(allowed), bool)
    if system.form == DENSE or system.eigenvalues.shape[1] > MOST_MODES:
        return may
    rows = np.arange(len(allowed))
    most = max(1, _MOST_ENTRIES // system.eigenvalues.shape[1] ** 2)
    for some in np.split(rows, range(most, rows.size, most)):
        may[some] = _may_exceed(system, way.only(some), allowed[some])
    return may


def _may_exceed(system: System, way: Way, allowed: Real) -> Flags:
    """Return the same of ways that are looked at together: those not told are halved."""
    s = np.zeros(1, np.int64) if system.eigenvalues.shape[0] == 1 else system.which[way.numbers]
    X, Y = system.contact_modes[s], system.contact_duals[s]
    nothing = np.zeros((1, X.shape[2]), np.complex128)
    springs = np.stack(
        [coupled(nothing, None, X, Y, way.stiffness[:, end] - np.diag(system.shift)) for end in (0, 1)],
        axis=1,
    )
    driven = way.forces @ Y
    may = np.zeros(len(allowed), bool)
    pieces = [(np.arange(len(allowed)), 0.0, 1.0)]
    for _ in range(_MOST_HALVINGS + 1):
        left = []
        for rows, begin, end in pieces:
            known = _bound(system, way.numbers[rows], *(
                (1.0 - part) * x[rows, 0] + part * x[rows, 1]
                for x in (way.at, springs, driven) for part in (begin, end)
            )) <= allowed[rows]  # fmt: skip
            middle = 0.5 * (begin + end)
            left += [(rows[~known], begin, middle), (rows[~known], middle, end)]
        pieces = left
    for rows, *_ in pieces:
        may[rows] = True
    return may


def _bound(
    system: System, numbers: Integer, begin: Real, end: Real, left: Complex, right: Complex, f_left: Complex,
    f_right: Complex,
) -> Real:  # fmt: skip
    """Return the bound (S,) on ways from ω = `begin` to `end`, with Yᵀ ĝ X and f at both ends."""
    s, k = system.which[numbers], system.ks[numbers].astype(np.float64)[:, None]
    middle, half = 0.5 * k * (begin + end)[:, None], 0.5 * k * (end - begin)[:, None]
    values, o = system.eigenvalues[s], system.observe_modes[s]
    if system.form == MODES:
        dampings = system.dampings[s]
        here, slope = values - middle**2 + 1j * middle * dampings, -2.0 * middle * half + 1j * half * dampings
        bend: Real = np.square(half[:, 0])
    else:
        here, slope, bend = 1j * middle - values, 1j * half + 0.0 * values, np.zeros(len(k))
    D, E = 0.5 * (left + right), 0.5 * (right - left)
    diagonal = np.arange(values.shape[1])
    D[:, diagonal, diagonal] += here
    E[:, diagonal, diagonal] += slope
    try:
        R = np.asarray(np.linalg.inv(D), np.complex128)
    except np.linalg.LinAlgError:
        return np.full(len(k), np.inf)  # exactly at a resonance
    RE = np.asarray(R @ E, np.complex128)
    far: Real = np.asarray(_norm(RE) + bend * _norm(R))
    f = np.stack([0.5 * (f_left + f_right), 0.5 * (f_right - f_left)], axis=2)
    y, a = R @ f, (o[:, None, :] @ R)[:, 0]
    aE = (o[:, None, :] @ RE)[:, 0]
    direct = np.abs(np.einsum("sm,smj->sj", o, y)).sum(axis=1)
    first = np.abs(np.einsum("sm,smj->sj", aE, y)).sum(axis=1)
    first += bend * np.abs(np.einsum("sm,smj->sj", a, y)).sum(axis=1)
    moved = np.linalg.norm(RE @ y, axis=1).sum(axis=1) + bend * np.linalg.norm(R @ y, axis=1).sum(axis=1)
    more = (np.linalg.norm(aE, axis=1) + bend * np.linalg.norm(a, axis=1)) * moved
    return np.where(far < 1.0, direct + first + more / np.maximum(1.0 - far, 1e-300), np.inf)


def _norm(matrices: Complex) -> Real:
    """Return a bound (S,) of the largest singular values."""
    sizes = np.abs(matrices)
    across = sizes.sum(axis=1).max(axis=1, initial=0.0) * sizes.sum(axis=2).max(axis=1, initial=0.0)
    found: Real = np.sqrt(np.minimum(across, np.square(sizes).sum(axis=(1, 2))))
    return found


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
    if estimate >= peaks[0].value and nothing_damps(workspace, points, peaks[0]):
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


def nothing_damps(workspace: Workspace, points: Points, peak: Peak) -> bool:
    """Return whether no digit of a maximum over the frequency is more than rounding, beside which there are.

    Where there are none beside it either, what is observed does not move.
    """
    parameter = workspace.balance.parameter
    if not peak.interior or parameter.kind is not Kind.FREQUENCY:
        return False
    ends = (
        (points.solutions[i, :-1], float(points.solutions[i, -1]), float(np.abs(points.observed[i]).max()))
        for i in (0, -1)
    )
    at_peak = _is_rounding(workspace, peak.solution, float(parameter.inside(peak.at)), peak.value)
    return at_peak and not all(_is_rounding(workspace, *end) for end in ends)


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
