"""The coarse stage: designs over the whole range, from the best of which the local searches begin."""

from __future__ import annotations

import math

from scipy.stats import qmc

from optim.evaluator import Search
from optim.problem import Problem
from optim.rows import Evaluation
from optim.variables import unscaled

COARSE_ONE = 9  # designs of the coarse stage with one variable
COARSE_EACH = 6  # and for each variable with more
WORTH_A_LOOK = 1.15  # relative height up to which an interval of the coarse stage is halved


def coarse(problem: Problem) -> list[dict[str, float]]:
    """Return the designs of the coarse stage: even in scaled variables, the start first."""
    n = len(problem.variables)
    if n == 1:
        points = [[i / (COARSE_ONE - 1.0)] for i in range(COARSE_ONE)]
    else:
        points = qmc.Sobol(n, scramble=False).random(2 ** math.ceil(math.log2(COARSE_EACH * n))).tolist()
    designs = [unscaled(problem.variables, point) for point in points]
    start = None if problem.start is None else dict(problem.start)
    return [start, *designs] if start is not None and start not in designs else designs


def between(search: Search) -> list[dict[str, float]]:
    """Return the middles of those coarse intervals in which a design may beat the best one so far."""
    variable = search.variables[0]
    good = sorted(search.good(), key=lambda evaluation: evaluation.values[variable.name])
    merits = [search.merit(evaluation) for evaluation in good]
    places = [variable.inside(evaluation.values[variable.name]) for evaluation in good]
    return [
        {variable.name: variable.outside(0.5 * (places[i] + places[i + 1]))}
        for i in range(len(good) - 1)
        if min(merits[i], merits[i + 1]) <= WORTH_A_LOOK * min(merits)
    ]


def begins(search: Search, good: list[Evaluation]) -> list[Evaluation]:
    """Return the best designs of the coarse stage; with one variable the best of its local minima."""
    ranked = sorted(good, key=search.merit)
    if len(search.variables) > 1:
        return ranked[: search.problem.basins]
    name = search.variables[0].name
    along = sorted(good, key=lambda evaluation: evaluation.values[name])
    merits = [math.inf, *(search.merit(evaluation) for evaluation in along), math.inf]
    minima = [e for i, e in enumerate(along) if merits[i] >= merits[i + 1] <= merits[i + 2]]
    return sorted(minima, key=search.merit)[: search.problem.basins]
