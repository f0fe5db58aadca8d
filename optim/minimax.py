"""Trust-region search for the design whose largest row is least, subject to limits on others.

Each step solves the convex subproblem of `optim.subproblem` at the present design: every competing peak,
every band is a row, so an exchange of the highest peak is nothing special; a damped BFGS matrix of the
Lagrangian gives the curvature between exchanges. Reference: Conn, Gould, Toint, Trust-Region Methods (SIAM
2000), chapter 14, and Powell's damping (Math. Program. 14 (1978) 224).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from optim.local import Evaluate, Local, ModelOf, ended
from optim.model import Model
from optim.rows import Evaluation, Row, nearest
from optim.subproblem import Step, solve_subproblem
from optim.variables import Real, Variable, snapped, unscaled

FIRST_RADIUS = 0.1
LARGEST_RADIUS = 0.5
SMALLEST_RADIUS = 1e-9
STATIONARY = 1e-11  # predicted relative decrease below which a design is optimal
MOST_STEPS = 40
NOTHING = 1e-9  # multipliers below it are rounding of the conic solver


def minimax_search(
    evaluate: Evaluate, variables: tuple[Variable, ...], begin: Evaluation, model_of: ModelOf
) -> Local:
    """Improve a design until no first-order decrease is left.

    Parameters
    ----------
    evaluate : the rows of a design, with gradients.
    variables : the design variables.
    begin : a good evaluation to start from.
    model_of : the model of an evaluation.
    """
    n = len(variables)
    here, model = begin, model_of(begin)
    hessian, radius = np.zeros((n, n)), FIRST_RADIUS
    for _ in range(MOST_STEPS):
        low, high = np.maximum(-model.z, -radius), np.minimum(1.0 - model.z, radius)
        step = solve_subproblem(model, _root(hessian), low, high)
        if step is None:
            break
        decrease = model.merit - step.predicted
        if decrease <= STATIONARY * model.merit or radius <= SMALLEST_RADIUS:
            break
        trial = evaluate(unscaled(variables, snapped(model.z + step.step)))
        if not trial.good:
            radius *= 0.25
            continue
        fresh = model_of(trial)
        ratio = (model.merit - fresh.merit) / decrease
        if fresh.smooth:
            pulls = _pulls(model, step)
            hessian = _update(hessian, fresh.z - model.z, _gradient(fresh, pulls) - _gradient(model, pulls))
        size = float(np.abs(step.step).max())
        if ratio > 0.75 and size > 0.9 * radius:
            radius = min(2.0 * radius, LARGEST_RADIUS)
        elif ratio < 0.25:
            radius = 0.5 * size if ratio > 0.0 else 0.25 * size
        if ratio > 1e-4 and fresh.smooth:
            here, model = trial, fresh
    return ended(here, model, variables)


def _gradient(model: Model, pulls: list[tuple[Row, float]]) -> Real:
    """Return the gradient of the Lagrangian whose multipliers belong to rows of another design."""
    total = np.zeros(model.z.size)
    for row, multiplier in pulls:
        near = nearest(row, model.limited if row.weight == 0.0 else model.rows)
        if near is not None:
            total += multiplier * (model.excess_slopes if row.weight == 0.0 else model.slopes)[near]
    return total


def _pulls(model: Model, step: Step) -> list[tuple[Row, float]]:
    """Return the rows that hold a step, with their multipliers."""
    found = [(row, float(x)) for row, x in zip(model.rows, step.multipliers, strict=True) if x > NOTHING]
    limits = zip(model.limited, step.limit_multipliers, strict=True)
    return found + [(replace(row, weight=0.0), float(x)) for row, x in limits if x > NOTHING]


def _update(hessian: Real, s: Real, y: Real) -> Real:
    """Return the damped BFGS update; the first one scales the matrix."""
    curvature = float(s @ y)
    if not np.any(hessian):
        if curvature <= 0.0 or not np.any(s):
            return hessian
        return np.eye(s.size) * curvature / float(s @ s)
    Bs = hessian @ s
    quadratic = float(s @ Bs)
    if quadratic <= 0.0:
        return hessian
    if curvature < 0.2 * quadratic:
        theta = 0.8 * quadratic / (quadratic - curvature)
        y = theta * y + (1.0 - theta) * Bs
        curvature = float(s @ y)
    updated: Real = hessian - np.outer(Bs, Bs) / quadratic + np.outer(y, y) / curvature
    return updated


def _root(hessian: Real) -> Real:
    """Return R with RᵀR = hessian."""
    values, vectors = np.linalg.eigh(hessian)
    root: Real = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return root
