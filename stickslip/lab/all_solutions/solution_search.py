"""The search for the solutions of a balance at one frequency.

Newton's method starts from many motions, and again with the solutions known so far deflated: with

    m(u) = Π_i (1 + σ²/|u − u_i|²),

m r has no root at them, and a step of it is that of r divided by 1 + ∇mᵀ δ/m (P. E. Farrell, Á. Birkisson,
S. W. Funke, SIAM J. Sci. Comput. 37 (2015) A2026, doi:10.1137/140984798). What is found is followed over the
frequency both ways: a branch that folds comes back, and others leave it at branch points.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from solver.balance.balance import Balance
from solver.scene.scene_harmonics import breaks_symmetry
from solver.balance.workspace import PointSolution, Workspace
from solver.continuation.branch import BranchStatus, Points
from solver.continuation.branches.sweep import walk_branch
from solver.continuation.branch import MarkKind
from solver.continuation.stretches import Stretch, joined
from solver.continuation.walk import ContinuationSettings
from solver.jit.fourier import Real, from_full, to_full
from solver.response.stability.bifurcations import BranchSigns
from solver.response.stability.bifurcations import leaving

SAME = 1e-5  # relative difference of two motions below which they are one
_DEFLATED_STEPS = 40
_FARTHEST = 3.0  # times the size of the motion, the longest step of a deflated iteration
_CLOSE = 1e-6  # relative residual from which plain Newton goes on
_ASIDE = 1e-3  # relative, how far on the other side of the frequency a branch begins to be followed
_FARTHEST_RATIO = 4.0  # of the frequency, how far it is followed
_MOST_POINTS, _MOST_FOLLOWED, _MOST_SWITCHED = 400, 12, 8


@dataclass(slots=True)
class KnownSolution:
    """A solution with what led to it."""

    point: PointSolution
    found_by: str
    times: int = 1


class SolutionSearch:
    """The solutions of a balance at one frequency, as far as they are known."""

    def __init__(self, balance: Balance, omega: float) -> None:
        self.balance, self.omega = balance, omega
        self.workspace = Workspace.of(balance)
        self.known: list[KnownSolution] = []
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
        self.known.append(KnownSolution(found, by))

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

    def _mirror(self, known: KnownSolution) -> None:
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
        along = BranchSigns(self.balance, found)
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
        for stretch in walk_branch(self.workspace, begin, stop, ContinuationSettings(), u):
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
        return whole

    def sign(self, u: Real) -> int:
        """Return the sign of the determinant of dr/du."""
        _, point = self.workspace.evaluate(u, self.omega)
        return int(np.linalg.slogdet(point.jacobian)[0])

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
                step = np.asarray(np.linalg.solve(point.jacobian, point.residual), dtype=np.float64)
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
