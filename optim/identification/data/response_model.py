"""The model of a response: point after point from the last solution of each, on the branch the data are on.

Where every frequency has one response (`solver.continuation.branches.point_by_point.is_unique`) Newton's
method from a neighbour or from the last parameters is enough. Elsewhere the branch is followed once through
its folds, and of the solutions at a measured frequency that nearest to the data is taken; from there it is
followed over the parameters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from optim.identification.data.measured import Model, Predicted
from optim.problem.variables import Real
from solver.balance.balance import build
from solver.balance.simplifications import Effects, even_harmonics_reason
from solver.continuation.branches.point_by_point import is_unique
from solver.continuation.branches.sweep import sweep
from solver.scene.scene import Scene
from solver.sensitivity.observed import TWO_PI, Observed, ObservedSensitivities, Quantity

NOT_REACHED = -1


class ResponseModel(Model):
    """A response at given frequencies over parameter values.

    Parameters
    ----------
    scene : with the measured DOF observed.
    conditions : parameter paths and values of the run.
    paths : by which derivatives are wanted.
    frequency_hz : (m,) in the order of the sweep.
    quantity, harmonic : what was measured.
    harmonics : highest harmonic of the balance.
    near : (m, parts) measured values, by which branches are told apart; NaN where there are none.
    """

    def __init__(
        self, scene: Scene, conditions: Mapping[str, float], paths: Sequence[str], *, frequency_hz: Real,
        quantity: Quantity, harmonic: int, harmonics: int, near: Real,
    ) -> None:  # fmt: skip
        self._scene, self._conditions, self._paths = scene, dict(conditions), tuple(paths)
        self._hertz, self._quantity, self._harmonic = frequency_hz, quantity, harmonic
        self._harmonics, self._near = max(harmonics, harmonic), near
        self._effects = Effects(even_harmonics=even_harmonics_reason(scene, self._paths) is not None)
        self._solutions: list[Real | None] = [None] * frequency_hz.size

    def forget(self) -> None:
        """As the base says."""
        self._solutions = [None] * self._hertz.size

    def evaluate(self, values: Mapping[str, float]) -> Predicted:
        """As the base says."""
        here = self._scene.with_values({**values, **self._conditions})
        balance = build(here, harmonics=self._harmonics, effects=self._effects)
        seen = ObservedSensitivities(balance, self._paths)
        if all(known is None for known in self._solutions) and not is_unique(balance):
            self.unique = False
            self._choose_branches(here, seen)
        parts = self._near.shape[1]
        found_values = np.full((self._hertz.size, parts), np.nan)
        slopes = np.full((self._hertz.size, parts, len(self._paths)), np.nan)
        states = np.full((self._hertz.size, len(balance.scene.contacts)), NOT_REACHED)
        before: Real | None = None
        for i, hertz in enumerate(self._hertz.tolist()):
            found, before = self._point(seen, i, hertz, before)
            if found is not None:
                found_values[i], slopes[i], states[i] = found.values, found.slopes, found.states
        reached = np.isfinite(slopes).all(axis=(1, 2)) & np.isfinite(found_values).all(axis=1)
        names = [contact.name for contact in balance.scene.contacts]
        return Predicted(
            values=found_values.ravel(), slopes=slopes.reshape(-1, len(self._paths)),
            reached=np.repeat(reached, parts), states={name: states[:, c] for c, name in enumerate(names)},
        )  # fmt: skip

    def _point(
        self, seen: ObservedSensitivities, i: int, hertz: float, before: Real | None
    ) -> tuple[Observed | None, Real | None]:
        """Return what is measured at a point, and its solution (the one before where there is none)."""
        size = seen.balance.n_unknowns
        guesses = tuple(u for u in (self._solutions[i], before) if u is not None and u.size == size)
        solution = seen.solve(hertz, guesses)
        if not solution.converged:
            return None, before
        self._solutions[i] = solution.u
        return seen.observed(solution.u, hertz, self._quantity, self._harmonic), solution.u

    def _choose_branches(self, scene: Scene, seen: ObservedSensitivities) -> None:
        """Keep the solution nearest to the data of those the branch has at each frequency."""
        low, high = float(self._hertz.min()), float(self._hertz.max())
        branch = sweep(scene, start=low, stop=high, harmonics=self._harmonics, effects=self._effects)
        points = branch.solutions
        for i, hertz in enumerate(self._hertz.tolist()):
            ahead = points[:, -1] - TWO_PI * hertz
            crossed = np.flatnonzero(ahead[:-1] * ahead[1:] <= 0.0)
            best = np.inf
            for k in crossed.tolist():
                share = ahead[k] / (ahead[k] - ahead[k + 1]) if ahead[k] != ahead[k + 1] else 0.0
                guess = (1.0 - share) * points[k, :-1] + share * points[k + 1, :-1]
                found = seen.workspace.solve_from(TWO_PI * hertz, np.ascontiguousarray(guess))
                distance = self._distance(seen, found.u, i, hertz) if found.converged else np.inf
                if distance < best:
                    best, self._solutions[i] = distance, found.u

    def _distance(self, seen: ObservedSensitivities, u: Real, i: int, hertz: float) -> float:
        """Return how far a solution is from what was measured; of nothing measured the highest is nearest."""
        found = seen.observed(u, hertz, self._quantity, self._harmonic)
        if found is None:
            return np.inf
        if np.isnan(self._near[i]).any():
            return -float(np.linalg.norm(found.values))
        return float(np.linalg.norm(found.values - self._near[i]))
