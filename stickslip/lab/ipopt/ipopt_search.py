"""The design problem as a nonlinear programme for IPOPT, with the solver as a CasADi callback.

    minimise   Σ t_g
    subject to t_g(i) − aᵢ(z) ≥ 0    every competing row i of what is minimised, in groups g
               bⱼ(z) ≤ 0             every limited row j, as relative excess over its bound
               0 ≤ z ≤ 1             scaled variables, near the start

A programme has a fixed number of smooth rows, a response any number of peaks: every row keeps its place by
quantity, case and frequency, the places follow their peaks from one design to the next, a peak without a
place of its own counts in the nearest one, and a place whose peak has vanished is empty. What that leaves out
is found by starting again from where IPOPT ended. Reference: Wächter, Biegler, Math. Program. 106 (2006) 25,
doi:10.1007/s10107-004-0559-y.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation, nearest
from optim.criteria.criterion import CriterionRow
from optim.methods.linearised import KKT_TOLERANCE, Evaluate, Local, Model, ModelOf, ended
from optim.problem.variables import SNAP, BoundedVariable, Real, snapped, unscaled

Second = Callable[[], Real | None]

ROUNDS = 8  # programmes, each from where the last one ended
REGION = 0.1  # scaled distance from its start that a programme covers: far away other peaks compete
MOST_ITERATIONS = 25
TOLERANCE = 1e-9
NEGLIGIBLE = 1e-10  # relative gain of a programme below which the next one covers less
NOTHING = 1e-12  # multipliers below it do not count
VANISHED = 0.9  # share of the highest row at which a place without one stands
EMPTY = -1.0  # excess of a limited place without a row
_OPTIONS: dict[str, Any] = {
    "print_time": False, "error_on_fail": False, "calc_lam_p": False,
    "ipopt": {
        "print_level": 0, "sb": "yes", "tol": TOLERANCE, "max_iter": MOST_ITERATIONS,
        "hessian_approximation": "limited-memory", "bound_relax_factor": 0.0, "mu_init": 1e-3,
        "acceptable_tol": 1e-7, "acceptable_iter": 5, "honor_original_bounds": "yes",
    },
}  # fmt: skip


def ipopt_search(
    evaluate: Evaluate, variables: tuple[BoundedVariable, ...], begin: DesignEvaluation, model_of: ModelOf
) -> Local:
    """Improve a design with IPOPT; the arguments are those of `optim.methods.minimax.minimax_search`.

    A design whose response cannot be computed is NaN to IPOPT, which then takes a shorter step.
    """
    best, model, region = begin, model_of(begin), REGION
    for _ in range(ROUNDS):
        rows = _Rows(evaluate, variables, model, model_of)
        rows.seen(best, model)
        before = model.merit
        n, m, groups = model.z.size, model.heights.size, rows.unique
        functions = _Programme(rows, n, len(groups))
        z, t = casadi.MX.sym("z", n), casadi.MX.sym("t", len(groups))
        numbers = functions.numbers(z)
        which = [int(np.flatnonzero(groups == g)[0]) for g in model.groups]
        parts = [t[g] - numbers[i] for i, g in enumerate(which)] + [-numbers[j] for j in range(m, rows.count)]
        constraints = casadi.vertcat(*parts)
        programme: dict[str, Any] = {"x": casadi.vertcat(z, t), "f": casadi.sum1(t), "g": constraints}
        options, exact = _OPTIONS, all(row.second is not None for row in (*model.rows, *model.limited))
        if exact:
            ipopt = {**_OPTIONS["ipopt"], "hessian_approximation": "exact"}
            options = {**_OPTIONS, "ipopt": ipopt, "hess_lag": functions.hessian}
        solver = casadi.nlpsol("design", "ipopt", programme, options)
        tops = [model.heights[model.groups == g].max() for g in groups]
        solver(
            x0=np.concatenate([model.z, tops]),
            lbx=np.append(np.maximum(model.z - region, 0.0), np.full(len(groups), -np.inf)),
            ubx=np.append(np.minimum(model.z + region, 1.0), np.full(len(groups), np.inf)),
            lbg=0.0, ubg=np.inf,
        )  # fmt: skip
        if functions.failure is not None:
            raise functions.failure
        best, model = rows.best, model_of(rows.best)
        on_bounds = snapped(model.z)
        if np.any(on_bounds != model.z):
            trial = evaluate(unscaled(variables, on_bounds))
            if trial.good and model_of(trial).merit <= model.merit * (1.0 + SNAP):
                best, model = trial, model_of(trial)
        local = ended(best, model, variables)
        if local.settled and local.conditions.residual <= 1e-2 * KKT_TOLERANCE:
            break
        if before - model.merit <= NEGLIGIBLE * abs(before):
            region *= 0.2
    return ended(best, model, variables)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Values:
    """Heights and excesses of all places with their derivatives by z; the second ones when asked for."""

    numbers: Real
    slopes: Real
    seconds: list[Second]

    def lagrangian(self, multipliers: Real) -> Real:
        """Return Σ multiplier · second derivatives; a row at a corner of the response has none: 0."""
        total = np.zeros((self.slopes.shape[1],) * 2)
        for multiplier, second in zip(multipliers, self.seconds, strict=True):
            found = second() if abs(multiplier) > NOTHING else None
            if found is not None:
                total += multiplier * found
        return total


class _Rows:
    """Evaluates designs for the programme, with every row in its place."""

    def __init__(
        self, evaluate: Evaluate, variables: tuple[BoundedVariable, ...], model: Model, model_of: ModelOf
    ) -> None:
        self.groups = model.groups
        self.unique = np.unique(model.groups)
        self._variables = variables
        self._evaluate, self._model_of = evaluate, model_of
        self._places: list[CriterionRow] = list(model.rows)
        self._limited: list[CriterionRow] = list(model.limited)
        self._known: dict[bytes, _Values] = {}
        self.best: DesignEvaluation
        self._merit = math.inf

    @property
    def count(self) -> int:
        """Numbers of one design."""
        return len(self._places) + len(self._limited)

    def seen(self, evaluation: DesignEvaluation, model: Model) -> None:
        """Keep an evaluation, and the best."""
        self._known[model.z.tobytes()] = self._values(model)
        if model.merit < self._merit:
            self.best, self._merit = evaluation, model.merit

    def at(self, z: Real) -> _Values:
        """Return all numbers at a design; NaN if it cannot be evaluated."""
        key = z.tobytes()
        if key not in self._known:
            evaluation = self._evaluate(unscaled(self._variables, z))
            if evaluation.good:
                model = self._model_of(evaluation)
                self.seen(evaluation, model)
                self._known[key] = self._values(model)
            else:
                shape = (self.count, z.size)
                self._known[key] = _unknown(*shape)
        return self._known[key]

    def _values(self, model: Model) -> _Values:
        m, n = len(self._places), model.z.size
        numbers, slopes = np.full(self.count, EMPTY), np.zeros((self.count, n))
        rows = _fill(self._places, model.rows, model.heights, model.slopes, numbers[:m], slopes[:m])
        limits = _fill(
            self._limited, model.limited, model.excess, model.excess_slopes, numbers[m:], slopes[m:]
        )
        seconds = [_second(model.second, i) for i in rows] + [
            _second(model.limited_second, j) for j in limits
        ]
        for i, group in enumerate(self.groups):
            if rows[i] is None:
                # An interior-point method needs a slack that does not jump: a vanished peak is a low one.
                numbers[i] = VANISHED * model.heights[model.groups == group].max()
        return _Values(numbers=numbers, slopes=slopes, seconds=seconds)


def _second(of: Callable[[int], Real | None], index: int | None) -> Second:
    return lambda: None if index is None else of(index)


def _unknown(count: int, n: int) -> _Values:
    """Return the values of a design that cannot be evaluated."""
    return _Values(
        numbers=np.full(count, np.nan), slopes=np.full((count, n), np.nan), seconds=[lambda: None] * count
    )


def _fill(
    places: list[CriterionRow],
    rows: Sequence[CriterionRow],
    values: Real,
    by_z: Real,
    numbers: Real,
    slopes: Real,
) -> list[int | None]:
    """Put each row in its place: the nearest in frequency of the same quantity and case; the largest wins."""
    fresh = list(places)
    taken: list[int | None] = [None] * len(places)
    for i, (row, value, slope) in enumerate(zip(rows, values, by_z, strict=True)):
        place = nearest(row, places)
        if place is not None and value > numbers[place]:
            numbers[place], slopes[place], fresh[place], taken[place] = value, slope, row, i
    places[:] = fresh
    return taken


class _Function(casadi.Callback):
    """A function of columns as CasADi calls it, with its Jacobian if it is given one."""

    def __init__(
        self, name: str, sizes: Sequence[int], out: casadi.Sparsity, of: Callable[..., Any],
        jacobian: Callable[[str], casadi.Function] | None = None,
    ) -> None:  # fmt: skip
        casadi.Callback.__init__(self)
        self._sizes, self._out, self._of, self._jacobian = sizes, out, of, jacobian
        self.construct(name, {})

    def get_n_in(self) -> int:
        return len(self._sizes)

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, which: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self._sizes[which], 1)

    def get_sparsity_out(self, _: int) -> casadi.Sparsity:
        return self._out

    def eval(self, arguments: Any) -> list[Any]:
        return [self._of(*(np.array(one, dtype=np.float64).reshape(-1) for one in arguments))]

    def has_jacobian(self) -> bool:
        return self._jacobian is not None

    def get_jacobian(
        self, name: str, inames: Sequence[str], onames: Sequence[str], opts: Any
    ) -> casadi.Function:
        if self._jacobian is None:
            return super().get_jacobian(name, inames, onames, opts)
        self._made = self._jacobian(name)  # CasADi holds no reference of its own
        return self._made


class _Programme:
    """The functions of a programme: numbers of all places, their derivatives, the Hessian."""

    def __init__(self, rows: _Rows, n: int, tops: int) -> None:
        self._rows, self._n, self._tops = rows, n, tops
        self.failure: BaseException | None = None
        self.numbers = _Function(
            "rows", (n,), casadi.Sparsity.dense(rows.count, 1), lambda z: self._values(z).numbers,
            self._derivatives,
        )  # fmt: skip
        whole = casadi.Sparsity.upper(n + tops)
        self.hessian = _Function("hess_lag", (n + tops, 0, 1, rows.count), whole, self._lagrangian)

    def _values(self, z: Real) -> _Values:
        """Return the numbers; what stops the search is kept, for IPOPT would swallow it."""
        try:
            if self.failure is None:
                return self._rows.at(z)
        except Exception as failure:  # noqa: BLE001 — raised again by `_run` once IPOPT has let go
            self.failure = failure
        return _unknown(self._rows.count, self._n)

    def _derivatives(self, name: str) -> casadi.Function:
        """Return the derivatives as a function of z (and the numbers there)."""
        count, n = self._rows.count, self._n
        dense = casadi.Sparsity.dense(count, n)
        return _Function(name, (n, count), dense, lambda z, _: self._values(z).slopes)

    def _lagrangian(self, x: Real, _p: Real, _factor: Real, multipliers: Real) -> casadi.DM:
        """Return the upper triangle of the Hessian of the Lagrangian by x = (z, t)."""
        n, upper = self._n, casadi.Sparsity.upper(self._n + self._tops)
        whole = np.zeros(upper.shape)
        # Every row stands in the programme with a minus sign.
        whole[:n, :n] = self._values(x[:n]).lagrangian(-multipliers)
        return casadi.DM(upper, casadi.DM(whole)[upper].nonzeros())
