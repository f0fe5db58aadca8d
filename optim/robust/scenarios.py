"""A design in a scenario: the rows it is judged by, with slopes by design and by uncertainty; all aims."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated

import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.criterion import Criterion, CriterionRow
from optim.criteria.evaluation import effects_of, evaluate, ranges_of, rows_of
from optim.methods.linearised import PENALTY, Model, model_of
from optim.problem.cases import LoadCase
from optim.problem.checks import Aim
from optim.problem.design_problem import Problem
from optim.problem.uncertainty_set import Coordinate, Scenario
from optim.problem.variables import BoundedVariable, Real, parameter_values
from solver.continuation.branches.observation import observing
from solver.continuation.branches.sweep import sweep
from solver.continuation.walk import ContinuationSettings
from solver.results.known import Known, worst_of
from solver.results.watch import ShouldStop
from solver.studies.blades import blade_peaks, blade_rows


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """A design in a scenario."""

    scenario: Annotated[Scenario, "What is the case."]
    rows: Annotated[
        tuple[CriterionRow, ...],
        "What it is judged by, gradients by the variables; empty unless every response covered its range.",
    ]
    by_delta: Annotated[
        Real, "Their derivatives by the δ of the scenario's settings, then of free blades, (n_rows, n)."
    ]
    responses: Annotated[int, "Frequency responses computed."]

    @property
    def good(self) -> bool:
        """Whether every number is known."""
        return bool(self.rows) and all(np.isfinite(row.value) for row in self.rows)

    def highest(self, quantity: Criterion) -> CriterionRow | None:
        """Return the largest row of a quantity."""
        return max((r for r in self.rows if r.quantity is quantity), key=lambda r: r.value, default=None)


def outcome(
    problem: Problem, values: Mapping[str, float], scenario: Scenario, *, gradients: bool = True,
    should_stop: ShouldStop = None,
) -> Outcome:  # fmt: skip
    """Compute what a design is judged by in a scenario.

    Parameters
    ----------
    problem : what is judged.
    values : the design, variable name to value.
    scenario : what is the case.
    gradients : compute them (otherwise they are NaN).
    should_stop : asked while the responses are computed.
    """
    design = parameter_values(problem.variables, values)
    rows: list[CriterionRow] = []
    by_delta: list[Real] = []
    responses = 0
    for case in problem.cases:
        chain = _Chain(problem, scenario, case, design)
        found, count = chain.rows(gradients, should_stop)
        responses += count
        if not found:
            return Outcome(scenario=scenario, rows=(), by_delta=np.zeros((0, 0)), responses=responses)
        for row in found:
            second = None if row.second is None else chain.twice(row.second)
            rows.append(replace(row, gradient=chain.by_variables(row.gradient), second=second))
            by_delta.append(chain.by_delta(row.gradient))
    return Outcome(
        scenario=scenario, rows=tuple(rows), by_delta=np.array(by_delta).reshape(len(rows), -1),
        responses=responses,
    )  # fmt: skip


def known_in(
    problem: Problem, values: Mapping[str, float], scenario: Scenario, should_stop: ShouldStop = None
) -> Known:
    """Return how well the highest peak of a design in a scenario is known: a response for each case.

    Parameters
    ----------
    problem, values, scenario, should_stop : as in `outcome`.
    """
    design = parameter_values(problem.variables, values)
    parts: list[Known] = []
    for case in problem.cases:
        parts += _Chain(problem, scenario, case, design).known(should_stop)
    return worst_of(parts)


class _Chain:
    """The values of all paths in one scenario of one case, and the chain rule through them."""

    def __init__(
        self, problem: Problem, scenario: Scenario, case: LoadCase, design: Mapping[str, float]
    ) -> None:
        self._problem, self._scenario = problem, scenario
        nominal, disk = case.scene.with_values(design), scenario.disk
        uncertain = [path for coordinate, _ in scenario.settings for path in coordinate.paths]
        self._nominal = {path: nominal.value(path) for path in (*design, *uncertain)}
        self._blades = () if disk is None else tuple(disk.paths(nominal))
        self._case = case if disk is None else replace(case, scene=disk.on(case.scene))
        here = self._case.scene
        self._nominal |= {path: here.value(path) for row in self._blades for path in row}
        self._places = {path: i for i, path in enumerate(self._nominal)}
        self._of: dict[str, tuple[Coordinate, float]] = {
            path: (coordinate, delta) for coordinate, delta in scenario.settings for path in coordinate.paths
        }

    def _values(self) -> dict[str, float]:
        values = dict(self._nominal)
        for path, (coordinate, delta) in self._of.items():
            values[path] = coordinate.value(self._nominal[path], delta)
        return values

    def rows(self, gradients: bool, should_stop: ShouldStop) -> tuple[list[CriterionRow], int]:
        """Return the rows of the case with their gradients by path, and the responses computed."""
        problem, values = self._posed(), self._values()
        if self._of_every_blade(problem):
            # Of a mistuned disk those of the observed DOF in every sector, from one response.
            case = problem.cases[0]
            here = case.scene.with_values(values)
            effects = effects_of(problem, here)
            blade = here.observe.dof.partition("@")[0]
            blades = [f"{blade}@{j}" for j in range(len(blade_rows(here, blade)))]
            ranges = ranges_of(problem, case)
            rows: list[CriterionRow] = []
            for over in ranges:
                start, stop = over.hertz or (None, None)
                branch = sweep(
                    here, start=start, stop=stop, harmonics=problem.harmonics, limit=problem.limit,
                    settings=ContinuationSettings(errors=False), effects=effects, should_stop=should_stop,
                )  # fmt: skip
                if not branch.reached:
                    return [], len(ranges)
                for j, dof in enumerate(blades):
                    seen = branch if j == 0 else observing(branch, dof, limit=problem.limit, errors=False)
                    named = replace(case, name=f"{case.name}, {dof}")
                    found = rows_of(problem, named, seen, over, gradients=gradients)
                    rows += [row for row in found if j == 0 or row.quantity.each_blade]
            return rows, len(ranges)
        evaluation = evaluate(problem, values, gradients=gradients, errors=False, should_stop=should_stop)
        return list(evaluation.rows), evaluation.computed

    def known(self, should_stop: ShouldStop) -> list[Known]:
        """Return how well the peaks of the case are known."""
        problem, values = self._posed(), self._values()
        if self._of_every_blade(problem):
            scene = problem.cases[0].scene.with_values(values)
            peaks = blade_peaks(
                scene, harmonics=problem.harmonics, every_branch=False, should_stop=should_stop
            )  # fmt: skip
            return [peaks.highest]
        evaluation = evaluate(problem, values, gradients=False, should_stop=should_stop)
        return [branch.known for branch in evaluation.over_bands.values()]

    def _posed(self) -> Problem:
        """Return the problem of the case in the scenario, every path a variable."""
        return replace(
            self._problem,
            variables=tuple(
                BoundedVariable(name=path, paths=(path,), low=-np.inf, high=np.inf, logarithmic=False)
                for path in self._values()
            ),
            cases=(self._case,),
        )

    def _of_every_blade(self, problem: Problem) -> bool:
        """Return whether all blades of a mistuned disk count."""
        disk, scene = self._scenario.disk, problem.cases[0].scene
        if disk is None or disk.free:
            return disk is not None
        return scene.structure.has_sectors and "@" not in scene.observe.dof

    def _members(self) -> Real:
        """Return d path / d variable, (n_variables, n_paths); its own derivatives are 0."""
        table = np.zeros((len(self._problem.variables), len(self._places)))
        for i, variable in enumerate(self._problem.variables):
            for path in variable.paths:
                table[i, self._places[path]] = self._by_nominal(path)
        return table

    def by_variables(self, by_path: Real) -> Real:
        """Return a gradient by the variables."""
        return np.asarray(self._members() @ by_path)

    def twice(self, second: Callable[[], Real]) -> Callable[[], Real]:
        """Return what computes second derivatives by the variables from what does so by the paths."""
        return partial(_by_members, self._members(), second)

    def _by_nominal(self, path: str) -> float:
        if path not in self._of:
            return 1.0
        coordinate, delta = self._of[path]
        return coordinate.by_nominal(delta)

    def by_delta(self, by_path: Real) -> Real:
        """Return a gradient by the δ of the scenario's settings, then by the factors of free blades."""
        disk = self._scenario.disk
        factors = () if disk is None else disk.values
        terms: list[tuple[Sequence[str], Callable[[float], float], float]] = [
            (c.paths, c.by_delta, 1.0) for c, _ in self._scenario.settings
        ]
        terms += [(row, float, factor) for row, factor in zip(self._blades, factors, strict=False)]
        return np.array([
            sum(by_path[self._places[p]] * slope(self._nominal[p]) for p in paths) / factor
            for paths, slope, factor in terms
        ])  # fmt: skip


def _by_members(members: Real, second: Callable[[], Real]) -> Real:
    return np.asarray(members @ second() @ members.T)


def together(values: Mapping[str, float], outcomes: Sequence[Outcome]) -> DesignEvaluation:
    """Return an evaluation over several scenarios: the rows of all, each case under its scenario's number.

    Without rows if one of the scenarios could not be computed.
    """
    if not all(found.good for found in outcomes):
        return DesignEvaluation(values=dict(values), responses=(), rows=())
    rows = tuple(
        replace(row, case=f"{row.case} [{number}]")
        for number, found in enumerate(outcomes, start=1)
        for row in found.rows
    )
    return DesignEvaluation(values=dict(values), responses=(), rows=rows)


def number_of(row: CriterionRow) -> int:
    """Return the number of the scenario a row of `together` belongs to, from 1 on."""
    return int(row.case.rpartition("[")[2].rstrip("]"))


Scales = Mapping[Criterion, float]


def aim_model(
    aim: Aim, quantile: float, count: int, variables: Sequence[BoundedVariable], scale: float, scales: Scales
) -> Callable[[DesignEvaluation], Model]:
    """Return the model of an aim over `count` scenarios for the minimax search.

    - worst case: every row of every scenario competes with all others;
    - mean: the rows of a scenario compete, and the maxima of the scenarios are added (the sample average);
    - quantile q of N samples, the k-th smallest with k = ⌈q N⌉: the rows of the k lowest scenarios compete.
      The largest of these k is the order statistic itself here, and nowhere below it; so a step that lowers
      it lowers the quantile (majorise and minimise: Lange, Hunter, Yang, J. Comput. Graph. Stat. 9 (2000) 1).
      It is the quantile itself that falls, not a smoothed one or the CVaR above it, and its slope at a smooth
      point is the exact one of the order statistic.

    See `optim.methods.linearised.model_of` for the rest.
    """

    def worst(evaluation: DesignEvaluation) -> Model:
        return model_of(evaluation, variables, scale, scales)

    def mean(evaluation: DesignEvaluation) -> Model:
        model = worst(evaluation)
        numbers = np.array([number_of(row) for row in model.rows], dtype=np.float64)
        return replace(
            model, heights=model.heights / count, slopes=model.slopes / count, unit=model.unit * count,
            groups=numbers * len(scales) + model.groups,
        )  # fmt: skip

    def order_statistic(evaluation: DesignEvaluation) -> Model:
        merits = merits_of(evaluation, count, scale, scales)
        kept = set((np.argsort(merits, kind="stable")[: rank_of(quantile, count)] + 1).tolist())
        return worst(replace(evaluation, rows=tuple(r for r in evaluation.rows if number_of(r) in kept)))

    return {Aim.WORST_CASE: worst, Aim.MEAN: mean, Aim.QUANTILE: order_statistic}[aim]


def rank_of(quantile: float, count: int) -> int:
    """Return k such that the k-th smallest of `count` samples is the quantile."""
    return min(max(math.ceil(quantile * count - 1e-9), 1), count)


def merits_of(evaluation: DesignEvaluation, count: int, scale: float, scales: Scales) -> list[float]:
    """Return the merit of every scenario of an evaluation: its objective and the penalty on its limits."""
    rows: list[list[object]] = [[] for _ in range(count)]
    for row in evaluation.rows:
        rows[number_of(row) - 1].append(row)
    merits = []
    for mine in rows:
        one = replace(evaluation, rows=tuple(mine))  # type: ignore[arg-type]
        merits.append(one.objective / scale + PENALTY * max(one.violation(scales), 0.0))
    return merits
