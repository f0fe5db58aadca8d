"""The arrays one run works in, and the operations on a single point that everything else is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.balance import Balance, fewer_harmonics
from solver.fourier import Real
from solver.kernels.jacobian import fill_jacobian
from solver.kernels.newton import from_stuck, ladder, newton
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

FEWEST_HARMONICS = (
    2  # the mean and the first: with these Newton's method from full stick nearly always ends well
)


_LEAST_RISE = 1e-3  # share of the excitation below which it is raised no further


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
        """Solve at λ = `p` (inside unit): from `guess` if given, else from nothing.

        From nothing, Newton starts at the fully stuck response; if that fails, the harmonics are added
        little by little, beginning with the first alone; if that fails too, the load is walked down rung by
        rung from full stick, and at last the excitation is raised from nothing.
        """
        system, linear, point = self.system, self.linear, self.point
        u, spent = np.zeros(self.balance.n_unknowns), 0
        if guess is not None:
            good, spent, norm = self._newton(guess, u, p)
            if good:
                return PointSolution(converged=True, u=u, iterations=spent, residual=norm)
        good, more, norm = from_stuck(system, linear, u, p, point)
        spent += more
        if not good:
            coarse = self._with_fewer_harmonics(p)
            spent += coarse.iterations
            if coarse.converged:
                good, more, norm = self._newton(self._padded(coarse.u), u, p)
                spent += more
        if not good:
            good, more, norm = ladder(system, linear, u, p, point)
            spent += more
        if not good:
            good, more, norm = self._by_level(u, p)
            spent += more
        return PointSolution(converged=bool(good), u=u, iterations=int(spent), residual=float(norm))

    def _by_level(self, u: Real, p: float) -> tuple[bool, int, float]:
        """Raise the excitation from nothing, the result in `u`; as `newton`."""
        reached, step, spent, norm = 0.0, 0.1, 0, np.inf
        kept = np.zeros(u.size)
        while reached < 1.0 and step > _LEAST_RISE:
            level = min(1.0, reached + step)
            u[:] = kept * (level / reached) if reached > 0.0 else kept
            receptance(self.system, p, self.linear)
            linear = receptance_by_value(self.linear)
            linear.u_linear[...] *= level
            linear.x_linear[...] *= level
            good, more, norm = newton(self.system, self.linear, u, p, 0.0, self.point)
            spent += more
            if good:
                kept, reached, step = u.copy(), level, 1.5 * step
            else:
                step *= 0.5
        receptance(self.system, p, self.linear)
        return reached == 1.0, spent, norm

    def _with_fewer_harmonics(self, p: float) -> PointSolution:
        """Solve with about two thirds of the harmonics, found in the same way from still fewer."""
        count = self.balance.system.ks.size
        fewer = max(2 * count // 3, FEWEST_HARMONICS)
        if fewer >= count:
            nothing = np.zeros(self.balance.n_unknowns)
            return PointSolution(converged=False, u=nothing, iterations=0, residual=np.inf)
        smaller = Workspace.of(fewer_harmonics(self.balance, fewer))
        coarse = smaller._with_fewer_harmonics(p)
        u, good, norm, spent = np.zeros(smaller.balance.n_unknowns), False, np.inf, coarse.iterations
        if coarse.converged:
            good, more, norm = smaller._newton(smaller._padded(coarse.u), u, p)
            spent += more
        if not good:
            good, more, norm = from_stuck(smaller.system, smaller.linear, u, p, smaller.point)
            spent += more
        return PointSolution(converged=bool(good), u=u, iterations=int(spent), residual=float(norm))

    def _newton(self, guess: Real, u: Real, p: float) -> tuple[bool, int, float]:
        """Run Newton's method from `guess`, the result in `u`."""
        u[:] = guess
        receptance(self.system, p, self.linear)
        return newton(self.system, self.linear, u, p, 0.0, self.point)

    def _padded(self, u: Real) -> Real:
        """Return a solution with fewer harmonics, filled up with zeros."""
        kept = u.reshape(self.balance.n_ports, -1)
        full = np.zeros((self.balance.n_ports, self.balance.n_coefficients))
        full[:, : kept.shape[1]] = kept
        return full.reshape(-1)

    def evaluate(self, u: Real, p: float) -> tuple[float, Evaluation]:
        """Return the relative residual at (u, p) and everything evaluated there (views of scratch arrays)."""
        receptance(self.system, p, self.linear)
        norm = evaluate(self.system, self.linear, u, p, 0.0, self.point)
        fill_jacobian(self.system, self.linear, self.point)
        return float(norm), evaluation_by_value(self.point)

    def receptance(self, p: float) -> Receptance:
        """Return the condensed linear part at λ = `p` (views of scratch arrays)."""
        receptance(self.system, p, self.linear)
        return receptance_by_value(self.linear)

    def measure(self, u: Real, p: float) -> PointMeasures | None:
        """Return what is observed at the solution (u, p) with slopes by λ; None where dr/du is singular."""
        receptance(self.system, p, self.linear)
        evaluate(self.system, self.linear, u, p, 0.0, self.point)
        observed, values = np.zeros(self.balance.n_coefficients), np.zeros(MEASURES)
        good = slope_by_parameter(self.system, self.linear, u, self.point, observed, values)
        return PointMeasures(observed=observed, values=values) if good else None
