"""The arrays one run works in, and the operations on a single point that everything else is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.balance import Balance
from solver.fourier import Real
from solver.kernels.newton import newton, start
from solver.kernels.observe import MEASURES
from solver.kernels.receptance import receptance
from solver.kernels.refine import slope_by_parameter
from solver.kernels.residual import evaluate
from solver.kernels.system import (
    Evaluation,
    Receptance,
    System,
    by_reference,
    evaluation_by_value,
    new_evaluation,
    new_receptance,
    receptance_by_value,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PointSolution:
    """One attempt to solve the balance at one value of λ.

    Attributes
    ----------
    converged : bool
        Whether `u` satisfies the balance.
    u : (n_unknowns,) array
        Slip motions [m], contact after contact.
    iterations : int
        Newton iterations spent, the start-up ladder included.
    residual : float
        Relative residual at `u`.
    """

    converged: bool
    u: Real
    iterations: int
    residual: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PointMeasures:
    """What is observed at a solution, with slopes by λ (inside unit).

    Attributes
    ----------
    observed : (n,) array
        Coefficients of the observed DOF [m].
    values : (MEASURES,) array
        Indexed by the column names of `solver.kernels.observe`.
    """

    observed: Real
    values: Real


@dataclass(frozen=True, slots=True)
class Workspace:
    """A balance with the scratch arrays of the compiled loops; not for two threads at once."""

    balance: Balance
    system: System
    linear: Receptance
    point: Evaluation

    @classmethod
    def of(cls, balance: Balance) -> Workspace:
        """Return a fresh workspace for a balance."""
        system = by_reference(balance.system)
        return cls(balance, system, new_receptance(system), new_evaluation(system))

    def solve(self, p: float, guess: Real | None = None) -> PointSolution:
        """Solve at λ = `p` (inside unit), from `guess` if it is given and good, else from the ladder."""
        if guess is not None:
            u = guess.copy()
            receptance(self.system, p, self.linear)
            good, spent, norm = newton(self.system, self.linear, u, p, 0.0, self.point)
            if good:
                return PointSolution(converged=True, u=u, iterations=spent, residual=norm)
        u = np.zeros(self.balance.n_unknowns)
        good, spent, norm = start(self.system, self.linear, u, p, self.point)
        return PointSolution(converged=bool(good), u=u, iterations=int(spent), residual=float(norm))

    def evaluate(self, u: Real, p: float) -> tuple[float, Evaluation]:
        """Return the relative residual at (u, p) and everything evaluated there (views of scratch arrays)."""
        receptance(self.system, p, self.linear)
        norm = evaluate(self.system, self.linear, u, p, 0.0, self.point)
        return float(norm), evaluation_by_value(self.point)

    def receptance(self, p: float) -> Receptance:
        """Return the condensed linear part at λ = `p` (views of scratch arrays)."""
        receptance(self.system, p, self.linear)
        return receptance_by_value(self.linear)

    def measure(self, u: Real, p: float) -> PointMeasures | None:
        """Return what is observed at the solution (u, p) with slopes by λ; None where dr/du is singular."""
        self.evaluate(u, p)
        observed, values = np.zeros(self.balance.n_coefficients), np.zeros(MEASURES)
        good = slope_by_parameter(self.system, self.linear, u, self.point, observed, values)
        return PointMeasures(observed=observed, values=values) if good else None
