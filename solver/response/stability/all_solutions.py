"""All periodic responses that can be found at one frequency, with their stability and what history may leave.

Newton's method starts from many motions, and again with the solutions known so far deflated: with

    m(u) = Π_i (1 + σ²/|u − u_i|²),

m r has no root at them, and a step of it is that of r divided by 1 + ∇mᵀ δ/m (P. E. Farrell, Á. Birkisson,
S. W. Funke, SIAM J. Sci. Comput. 37 (2015) A2026, doi:10.1137/140984798). What is found is followed over the
frequency both ways: a branch that folds comes back, and others leave it at branch points. Nothing of this finds every
solution for certain: the list is complete only where the response is proven to be the only one.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import ClassVar

import numpy as np

from solver.balance.balance import Balance, build, check_frequency
from solver.balance.simplifications import Effects, breaks_symmetry
from solver.balance.workspace import PointSolution, Workspace
from solver.branches.sweep import walk
from solver.continuation.branch import BranchStatus
from solver.continuation.segment import Stretch, joined
from solver.continuation.settings import ContinuationSettings
from solver.errors import SettingError
from solver.extrema.nodes import Points
from solver.jit.fourier import Real, from_full, to_full
from solver.response.solution import Solution
from solver.response.solve import describe
from solver.response.stability.bifurcations import Along, MarkKind
from solver.response.stability.floquet import Stability, stability
from solver.response.stability.residual_forces import AmplitudeRange, amplitude_range
from solver.response.stability.switching import leaving
from solver.response.stability.uniqueness import Uniqueness, uniqueness
from solver.results.told import Piece
from solver.scene.scene import Scene

SAME = 1e-5  # relative difference of two motions below which they are one
MOST_STARTS = 10_000
_DEFLATED_STEPS = 40
_FARTHEST = 3.0  # times the size of the motion, the longest step of a deflated iteration
_CLOSE = 1e-6  # relative residual from which plain Newton goes on
_ASIDE = 1e-3  # relative, how far on the other side of the frequency a branch begins to be followed
_FARTHEST_RATIO = 4.0  # of the frequency, how far it is followed
_MOST_POINTS, _MOST_FOLLOWED, _MOST_SWITCHED = 400, 12, 8
INCOMPLETE = "The list may be incomplete: no search finds every solution for certain."
MISSING = (
    "By the signs of the determinants at least {} more should exist: more starts may find them. " + INCOMPLETE
)
COMPLETE = "The list is complete: the response is proven to be the only one."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class FoundSolution(Piece):
    """One of the solutions found.

    Attributes
    ----------
    solution : Solution
        As `solve` gives it.
    stability : Stability or None
        Its Floquet multipliers; None where a law does not say how it is perturbed.
    sign : int
        Of the determinant of dr/du: −1 where an odd number of real perturbations grows.
    found_by : str
        What led to it first: ``solve``, ``start`` (a random motion), ``deflation``, or ``branch`` (that of
        another solution, followed through its folds and branch points).
    times : int
        How often the search came to it.
    residual_forces : AmplitudeRange or None
        What forces left in contacts that stick all the time may do to it; None where none sticks.
    """

    solution: Solution
    stability: Stability | None
    sign: int
    found_by: str
    times: int
    residual_forces: AmplitudeRange | None

    def to_json(self) -> dict[str, object]:
        """Return it as one JSON object."""
        left = self.residual_forces
        return {
            **self.solution.to_json(),
            "stability": None if self.stability is None else self.stability.to_json(),
            "sign": self.sign,
            "found_by": self.found_by,
            "times": self.times,
            "residual_forces": None if left is None else left.to_json(),
        }


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AllSolutions(Piece):
    """The distinct periodic responses found at one frequency.

    Attributes
    ----------
    solutions : tuple of FoundSolution
        Largest half peak to peak first.
    uniqueness : Uniqueness
        Whether there is one alone, and why.
    starts : int
        How many random starts were made, with and without deflation.
    stopped : bool
        The caller ended the search.
    seconds : float
        What it took.
    """

    UNITS: ClassVar[Mapping[str, str]] = {"seconds": "s"}

    solutions: tuple[FoundSolution, ...]
    uniqueness: Uniqueness
    starts: int
    stopped: bool
    seconds: float

    @property
    def complete(self) -> bool:
        """Whether there is certainly no other, but for residual forces."""
        return self.uniqueness.proven and bool(self.solutions)

    @property
    def missing(self) -> int:
        """How many more there are at least, by the signs of those found.

        The signs of the determinants of all solutions add up to 1, the degree of the map, where forces of
        contacts are bounded or only resist and everything takes out power.
        """
        return abs(1 - sum(found.sign for found in self.solutions))

    @property
    def note(self) -> str:
        """What is to be known of the list."""
        if self.complete:
            return COMPLETE
        return INCOMPLETE if self.missing == 0 else MISSING.format(self.missing)

    def to_json(self) -> dict[str, object]:
        """Return the answer as one JSON object."""
        return {
            "solutions": [found.to_json() for found in self.solutions],
            "unique": self.uniqueness.unique,
            "unique_ground": self.uniqueness.ground,
            "complete": self.complete,
            "missing_by_signs": self.missing,
            "note": self.note,
            "starts": self.starts,
            "stopped": self.stopped,
            "seconds": self.seconds,
        }


def solve_all(
    scene: Scene,
    *,
    frequency_hz: float,
    harmonics: int = 11,
    starts: int = 40,
    seed: int = 0,
    effects: Effects | None = None,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> AllSolutions:
    """Look for all periodic responses at one frequency.

    Parameters
    ----------
    scene : what vibrates.
    frequency_hz : excitation frequency [Hz].
    harmonics : highest harmonic kept; even ones are kept unless the response is proven to be the only one.
    starts : random motions to start from, each without deflation and with.
    seed : of their random numbers.
    effects : what is paid for though the scene does not call for it.
    on_progress : called with the share done and the number of solutions so far.
    should_stop : asked between starts; True ends the search.

    Raises
    ------
    SettingError
        A bad frequency, number of harmonics, of starts or seed.
    """
    begun = time.perf_counter()
    check_frequency("frequency_hz", frequency_hz)
    for name, value, least in (("starts", starts, 0), ("seed", seed, 0)):
        whole = isinstance(value, int) and not isinstance(value, bool)
        if not whole or not least <= value <= (MOST_STARTS if name == "starts" else 2**63 - 1):
            top = MOST_STARTS if name == "starts" else "2^63 - 1"
            raise SettingError(name, value, f"must be a whole number from {least} to {top}")
    only = uniqueness(scene, frequency_hz)
    effects = effects or Effects()
    if not only.proven:
        effects = replace(effects, even_harmonics=True)
    balance = build(scene, harmonics=harmonics, effects=effects)
    search = _Search(balance, 2.0 * math.pi * frequency_hz)
    search.keep(search.workspace.solve(search.omega), "solve")
    stopped = False
    if not only.proven:
        stopped = search.everywhere(starts, np.random.default_rng(seed), on_progress, should_stop)
    found = tuple(search.described(frequency_hz))
    ordered = sorted(found, key=lambda each: -each.solution.half_peak_to_peak)
    return AllSolutions(
        solutions=tuple(ordered), uniqueness=only, starts=0 if only.proven else search.starts,
        stopped=stopped, seconds=time.perf_counter() - begun,
    )  # fmt: skip


@dataclass(slots=True)
class _Known:
    """A solution with what led to it."""

    point: PointSolution
    found_by: str
    times: int = 1


class _Search:
    """The solutions of a balance at one frequency, as far as they are known."""

    def __init__(self, balance: Balance, omega: float) -> None:
        self.balance, self.omega = balance, omega
        self.workspace = Workspace.of(balance)
        self.known: list[_Known] = []
        self.starts = self.switched = 0

    def keep(self, found: PointSolution, by: str) -> None:
        """Add a solution if it is one and a new one."""
        if not found.converged:
            return
        for each in self.known:
            size = max(self._size(each.point.u), self._size(found.u))
            if self._size(found.u - each.point.u) <= SAME * size:
                each.times += 1
                return
        self.known.append(_Known(found, by))

    def _size(self, u: Real) -> float:
        """Return the largest coefficient, but for the means where they are a gauge."""
        if len(self.balance.system.loose) and self.balance.system.ks[0] == 0:
            u = u.reshape(self.balance.n_ports, -1)[:, 1:]
        return float(np.abs(u).max(initial=0.0))

    def everywhere(
        self, starts: int, rng: np.random.Generator, on_progress: Callable[[float, int], None] | None,
        should_stop: Callable[[], bool] | None,
    ) -> bool:  # fmt: skip
        """Start from random motions and follow what is found; return whether the caller ended it."""
        deflates = not len(self.balance.system.loose)
        followed = 0
        for i in range(starts + 1):
            while followed < min(len(self.known), _MOST_FOLLOWED):
                if should_stop is not None and should_stop():
                    return True
                self._mirror(self.known[followed])
                for way in (1.0, -1.0):
                    self._follow(self.known[followed].point.u, way)
                followed += 1
            if i == starts:
                break
            if should_stop is not None and should_stop():
                return True
            guess = self._random(rng)
            self.keep(self.workspace.solve_from(self.omega, guess), "start")
            if deflates:
                self.keep(self._deflated(guess), "deflation")
            self.starts += 1
            if on_progress is not None:
                on_progress((i + 1) / starts, len(self.known))
        return False

    def _mirror(self, known: _Known) -> None:
        """Keep the mirror image half a period later, where that is a response too."""
        ks, balance = self.balance.system.ks, self.balance
        if breaks_symmetry(balance.scene, ("frequency",)) or ks[0] != 0:
            return
        full = to_full(known.point.u.reshape(balance.n_ports, -1), ks, balance.highest_harmonic)
        full[:, 0] *= -1.0
        full[:, 3::4] *= -1.0
        full[:, 4::4] *= -1.0
        self.keep(self.workspace.solve_from(self.omega, from_full(full, ks).reshape(-1)), known.found_by)

    def _follow(self, u: Real, way: float) -> None:
        """Follow a solution to higher or lower frequencies, through folds and to branches that leave.

        From a little on the other side: where the branch comes back it then passes the frequency.
        """
        hertz = self.omega / (2.0 * math.pi)
        begin, stop = hertz * (1.0 - _ASIDE * way), hertz * _FARTHEST_RATIO**way
        near = self.workspace.solve_from(2.0 * math.pi * begin, u)
        if not near.converged:
            return
        found = self._walked(begin, stop, near.u)
        if found is None:
            return
        along = Along(self.balance, found)
        for mark in along.by_determinant():
            if mark.kind is not MarkKind.BRANCH_POINT or self.switched >= _MOST_SWITCHED:
                continue
            self.switched += 1
            span = 2.0 * math.pi * abs(stop - begin)
            for beside in leaving(self.balance, mark, found.tangents[mark.after], span).beside:
                far = hertz / _FARTHEST_RATIO if mark.at > hertz else hertz * _FARTHEST_RATIO
                self._walked(float(beside[-1]) / (2.0 * math.pi), far, beside[:-1].copy())

    def _walked(self, begin: float, stop: float, u: Real) -> Points | None:
        """Follow from one frequency [Hz] to another and keep what passes; None without two points."""
        stretches: list[Stretch] = []
        for stretch in walk(self.workspace, begin, stop, ContinuationSettings(), u):
            stretches.append(stretch)
            if sum(len(each.solutions) for each in stretches) >= _MOST_POINTS:
                break
        whole = joined(stretches)
        rows = whole.solutions
        for left, right in pairwise(rows):
            if (left[-1] - self.omega) * (right[-1] - self.omega) > 0.0:
                continue
            step = right[-1] - left[-1]
            share = (self.omega - left[-1]) / step if step else 0.0
            guess = left[:-1] + share * (right[:-1] - left[:-1])
            self.keep(self.workspace.solve_from(self.omega, guess), "branch")
        if len(rows) < 2:
            return None
        if whole.status is BranchStatus.TURNED_BACK and whole.tangents[-1, -1] != 0.0:
            # It came back, and its last step led out of the range, maybe over the frequency.
            last, way = rows[-1], whole.tangents[-1]
            guess = last[:-1] + (self.omega - last[-1]) / way[-1] * way[:-1]
            self.keep(self.workspace.solve_from(self.omega, guess), "branch")
        return Points(
            solutions=rows, tangents=whole.tangents, measures=whole.measures, observed=whole.observed,
            states=whole.states,
        )  # fmt: skip

    def _random(self, rng: np.random.Generator) -> Real:
        """Return a motion around the size of what is known, or of what moves without contacts."""
        balance = self.balance
        free = self.workspace.receptance(self.omega).u_linear[0]
        sizes = [self._size(each.point.u) for each in self.known] or [float(np.abs(free).max())]
        size = float(rng.choice(sizes)) * 10.0 ** rng.uniform(-1.0, 1.0)
        guess = np.zeros((balance.n_ports, balance.n_coefficients))
        means = int(balance.system.ks[0] == 0)
        guess[:, means : means + 2] = rng.normal(size=(balance.n_ports, 2))
        if means:
            guess[:, 0] = rng.normal(size=balance.n_ports)
        guess[:, means + 2 :] = 0.1 * rng.normal(size=guess[:, means + 2 :].shape)
        return np.asarray(size * guess.reshape(-1))

    def _deflated(self, start: Real) -> PointSolution:
        """Iterate on the deflated residual from a start."""
        u, size = start.copy(), max((self._size(each.point.u) for each in self.known), default=0.0)
        size = max(size, self._size(start))
        for _ in range(_DEFLATED_STEPS):
            norm, point = self.workspace.evaluate(u, self.omega)
            if norm <= _CLOSE:
                return self.workspace.solve_from(self.omega, u)
            try:
                step = np.linalg.solve(point.jacobian, point.residual)
            except np.linalg.LinAlgError:
                break
            along = 1.0 + self._deflation_slope(u, step, size)
            step = step / along if along != 0.0 else step
            longest = float(np.abs(step).max())
            if not math.isfinite(longest):
                break
            u = u - step * min(1.0, _FARTHEST * size / longest) if longest > 0.0 else u
        return PointSolution(converged=False, u=u, iterations=_DEFLATED_STEPS, residual=math.inf)

    def _deflation_slope(self, u: Real, step: Real, size: float) -> float:
        """Return ∇mᵀ δ/m of the solutions known; δ is what a step takes away."""
        total = 0.0
        for each in self.known:
            away = u - each.point.u
            square = float(away @ away)
            if square > 0.0:
                pull = size**2 / square
                total += -2.0 * pull / (1.0 + pull) * float(away @ step) / square
        return total

    def _sign(self, u: Real) -> int:
        _, point = self.workspace.evaluate(u, self.omega)
        return int(np.linalg.slogdet(point.jacobian)[0])

    def described(self, frequency_hz: float) -> list[FoundSolution]:
        """Return what is known as solutions."""
        found = []
        for each in self.known:
            solution = describe(self.workspace, each.point, frequency_hz, time.perf_counter())
            if not solution.converged:
                continue
            try:
                stable = stability(solution)
            except SettingError:
                stable = None
            found.append(
                FoundSolution(
                    solution=solution, stability=stable, sign=self._sign(each.point.u), found_by=each.found_by, times=each.times,
                    residual_forces=amplitude_range(solution, self.balance.effects),
                )
            )  # fmt: skip
        return found
