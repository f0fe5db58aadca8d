"""The coarse stage: designs over the whole range, from the best of which the local searches begin.

With several variables it is made with half the harmonics: it only has to rank designs, and none of its
numbers is kept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.stats import qmc

from optim.evaluator import Search
from optim.local import is_flat
from optim.problem import Problem
from optim.rows import Evaluation
from optim.variables import scaled, unscaled

COARSE_ONE = 9  # designs of the coarse stage with one variable
COARSE_EACH = 6  # and for each variable with more
FEWEST = 3  # harmonics of a coarse stage with several variables, at least
APART = 0.15  # scaled distance of the designs that several local searches begin from
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


def first_designs(search: Search) -> tuple[list[Evaluation], bool]:
    """Run the coarse stage.

    Returns
    -------
    The designs to begin local searches from, the best first, and whether nothing depends on any variable.
    """
    if len(search.variables) == 1:
        for values in coarse(search.problem):
            search(values)
        for values in between(search):
            search(values)
        good = search.good()
        return _minima(search, good), _flat(search, good)
    found = _scouted(search)
    if found is None:
        for values in coarse(search.problem):
            search(values)
        found = _apart(search, search.good()), _flat(search, search.good())
    return found


def _scouted(search: Search) -> tuple[list[Evaluation], bool] | None:
    """Run the coarse stage with half the harmonics; None if that leads to no design that can be evaluated."""
    few = max(FEWEST, (search.problem.harmonics + 1) // 2)
    if few >= search.problem.harmonics:
        return None
    scout = search.scout(few)
    try:
        for values in coarse(search.problem):
            scout(values)
    finally:
        search.scouting_done(scout)
    chosen = [search(evaluation.values) for evaluation in _apart(scout, scout.good())]
    good = [evaluation for evaluation in chosen if evaluation.good]
    return (good, _flat(scout, scout.good()) and _flat(search, good)) if good else None


def _flat(search: Search, good: Sequence[Evaluation]) -> bool:
    """Return whether no design depends on any variable."""
    return bool(good) and all(is_flat(search.model(evaluation)) for evaluation in good)


def _apart(search: Search, good: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the best designs, each some way from those before it."""
    chosen: list[Evaluation] = []
    for evaluation in sorted(good, key=search.merit):
        z = scaled(search.variables, evaluation.values)
        near = [np.abs(z - scaled(search.variables, other.values)).max() for other in chosen]
        if len(chosen) < search.problem.basins and min(near, default=np.inf) >= APART:
            chosen.append(evaluation)
    return chosen


def _minima(search: Search, good: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the local minima along one variable, the best first."""
    name = search.variables[0].name
    along = sorted(good, key=lambda evaluation: evaluation.values[name])
    merits = [math.inf, *(search.merit(evaluation) for evaluation in along), math.inf]
    minima = [e for i, e in enumerate(along) if merits[i] >= merits[i + 1] <= merits[i + 2]]
    return sorted(minima, key=search.merit)[: search.problem.basins]
