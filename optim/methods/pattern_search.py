"""A pattern search: where slopes are of no use, steps along directions, shorter after each that fails."""

from __future__ import annotations

import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation
from optim.methods.evaluator import DesignSearch
from optim.methods.kkt import Local, ended, standing
from optim.problem.variables import Real, scaled, snapped, unscaled

FIRST_STEP = 0.01  # scaled
LAST_STEP = 1e-7
MOST = 40  # designs for each variable
SMALLER = 0.35


def polished(search: DesignSearch, local: Local) -> Local:
    """Return the end of a pattern search from where a local search was stuck."""
    n = len(search.variables)
    rng = np.random.default_rng(0)
    here, step, left = local.evaluation, FIRST_STEP, MOST * n
    best = local.standing
    lead: Real | None = None
    while step >= LAST_STEP and left > 0:
        z = scaled(search.variables, here.values)
        moved = False
        for direction in _directions(n, rng, lead):
            place = snapped(z + step * direction)
            if left <= 0 or np.array_equal(place, z):
                continue
            left -= 1
            trial = search(unscaled(search.variables, place))
            if trial.good and _standing(search, trial) < best:
                here, best, lead, moved = trial, _standing(search, trial), direction, True
                break
        step *= 1.0 / SMALLER if moved else SMALLER
        lead = lead if moved else None
    return ended(here, search.model(here), search.variables)


def _standing(search: DesignSearch, evaluation: DesignEvaluation) -> tuple[float, float]:
    return standing(search.model(evaluation))


def _directions(n: int, rng: np.random.Generator, lead: Real | None) -> list[Real]:
    """Return the directions to try: the last that succeeded, both ways along an orthogonal basis."""
    basis = np.eye(n) if n == 1 or rng.random() < 0.5 else np.linalg.qr(rng.normal(size=(n, n)))[0]
    return ([] if lead is None else [lead]) + [sign * column for column in basis.T for sign in (1.0, -1.0)]
