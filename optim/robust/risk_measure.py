"""What a robust search decreases: the worst, the mean or a quantile of what is minimised over scenarios.

Each is a model for the minimax search (`optim.criteria.linearised.Model`) of an evaluation over all its
scenarios:

- worst case: every row of every scenario competes with all others;
- mean: the rows of a scenario compete, and the maxima of the scenarios are added (the sample average);
- quantile q of N samples, the k-th smallest with k = ⌈q N⌉: the rows of the k lowest scenarios compete. The
  largest of these k is the order statistic itself here, and nowhere below it; so a step that lowers it lowers
  the quantile (majorise and minimise: Lange, Hunter, Yang, J. Comput. Graph. Stat. 9 (2000) 1). It is the
  quantile itself that falls, not a smoothed one or the CVaR above it, and its slope at a smooth point is the
  exact one of the order statistic.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from optim.criteria.criterion import Criterion
from optim.criteria.linearised import PENALTY, Model, model_of
from optim.criteria.rows import Evaluation
from optim.problem.variables import Variable
from optim.problem.words import Aim
from optim.robust.scenarios import number_of

Scales = Mapping[Criterion, float]


def aim_model(
    aim: Aim, quantile: float, count: int, variables: Sequence[Variable], scale: float, scales: Scales
) -> Callable[[Evaluation], Model]:
    """Return the model of an aim over `count` scenarios; see `optim.criteria.linearised.model_of` for the
    rest."""

    def worst(evaluation: Evaluation) -> Model:
        return model_of(evaluation, variables, scale, scales)

    def mean(evaluation: Evaluation) -> Model:
        model = worst(evaluation)
        numbers = np.array([number_of(row) for row in model.rows], dtype=np.float64)
        return replace(
            model, heights=model.heights / count, slopes=model.slopes / count, unit=model.unit * count,
            groups=numbers * len(scales) + model.groups,
        )  # fmt: skip

    def order_statistic(evaluation: Evaluation) -> Model:
        merits = merits_of(evaluation, count, scale, scales)
        kept = set((np.argsort(merits, kind="stable")[: rank_of(quantile, count)] + 1).tolist())
        return worst(replace(evaluation, rows=tuple(r for r in evaluation.rows if number_of(r) in kept)))

    return {Aim.WORST_CASE: worst, Aim.MEAN: mean, Aim.QUANTILE: order_statistic}[aim]


def rank_of(quantile: float, count: int) -> int:
    """Return k such that the k-th smallest of `count` samples is the quantile."""
    return min(max(math.ceil(quantile * count - 1e-9), 1), count)


def merits_of(evaluation: Evaluation, count: int, scale: float, scales: Scales) -> list[float]:
    """Return the merit of every scenario of an evaluation: its objective and the penalty on its limits."""
    rows: list[list[object]] = [[] for _ in range(count)]
    for row in evaluation.rows:
        rows[number_of(row) - 1].append(row)
    merits = []
    for mine in rows:
        one = replace(evaluation, rows=tuple(mine))  # type: ignore[arg-type]
        merits.append(one.objective / scale + PENALTY * max(one.violation(scales), 0.0))
    return merits
