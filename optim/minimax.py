"""Trust-region search for the design whose highest peak is least, subject to a limit on the band.

Each step solves the convex subproblem of `optim.subproblem` at the present design: every competing peak is a
row, so an exchange of the highest peak is nothing special; a damped BFGS matrix of the Lagrangian gives the
curvature between exchanges. Reference: Conn, Gould, Toint, Trust-Region Methods (SIAM 2000), chapter 14, and
Powell's damping (Math. Program. 14 (1978) 224).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from optim.criteria import Criteria
from optim.scaling import Real, Variable
from optim.subproblem import ROWS, SLACK_WEIGHT, Step, Subproblem

Evaluate = Callable[[Mapping[str, float]], Criteria]

FIRST_RADIUS = 0.1
LARGEST_RADIUS = 0.5
SMALLEST_RADIUS = 1e-9
STATIONARY = 1e-11  # predicted relative decrease below which a design is optimal
COLLAPSED_RADIUS = 1e-4  # a radius below this says that the model was wrong, not that a step is useless
SNAP = 1e-7  # scaled distance within which a variable is put on its bound
ACTIVE = 1e-6  # relative distance from the highest peak within which a peak is active
KKT_TOLERANCE = 1e-3  # relative peak per scaled variable
FLAT_SLOPE = 1e-9  # relative peak per scaled variable below which there is nothing to choose
MOST_STEPS = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Local:
    """Where a local search ended.

    Attributes
    ----------
    criteria : Criteria
        The best design.
    settled : bool
        No further decrease is possible to first order; otherwise the steps were used up or failed.
    optimality : float
        Norm of the projected gradient of the Lagrangian.
    peak_multipliers : (m,) array
        Of the peaks of `criteria`.
    """

    criteria: Criteria
    settled: bool
    optimality: float
    peak_multipliers: Real


@dataclass(frozen=True, slots=True, kw_only=True)
class _Model:
    """First-order model of the criteria in scaled variables, peaks relative to `scale`."""

    heights: Real
    slopes: Real
    band: float
    band_slope: Real

    def merit(self) -> float:
        """Highest peak plus the exact penalty on the band."""
        return float(self.heights.max()) + SLACK_WEIGHT * max(self.band, 0.0)


def local_search(
    evaluate: Evaluate, variables: tuple[Variable, ...], begin: Criteria, max_band_hz: float | None
) -> Local:
    """Improve a design until no first-order decrease is left.

    Parameters
    ----------
    evaluate : the criteria of a design, with gradients.
    variables : the design variables.
    begin : a good evaluation to start from.
    max_band_hz : limit on the band [Hz], or None.
    """
    n = len(variables)
    problem = Subproblem(n, limited_band=max_band_hz is not None)
    scale = begin.peaks[0].value
    here, model = begin, _model(begin, variables, scale, max_band_hz)
    z = _scaled(begin, variables)
    hessian, radius = np.zeros((n, n)), FIRST_RADIUS
    for _ in range(MOST_STEPS):
        low, high = np.maximum(-z, -radius), np.minimum(1.0 - z, radius)
        step = problem.solve(
            model.heights, model.slopes, _root(hessian), low, high, model.band, model.band_slope
        )
        if step is None:
            break
        decrease = model.merit() - step.predicted
        if decrease <= STATIONARY * model.merit() or radius <= SMALLEST_RADIUS:
            return _ended(here, model, z, radius <= COLLAPSED_RADIUS)
        trial_z = _snapped(z + step.step)
        trial = evaluate(_values(trial_z, variables))
        if not trial.good:
            radius *= 0.25
            continue
        fresh = _model(trial, variables, scale, max_band_hz)
        ratio = (model.merit() - fresh.merit()) / decrease
        if np.all(np.isfinite(fresh.slopes)):
            hessian = _update(hessian, trial_z - z, _gradient(fresh, step) - _gradient(model, step))
        size = float(np.abs(step.step).max())
        if ratio > 0.75 and size > 0.9 * radius:
            radius = min(2.0 * radius, LARGEST_RADIUS)
        elif ratio < 0.25:
            radius = 0.5 * size if ratio > 0.0 else 0.25 * size
        if ratio > 1e-4 and np.all(np.isfinite(fresh.slopes)):
            here, model, z = trial, fresh, trial_z
    return _ended(here, model, z, True)


def _ended(here: Criteria, model: _Model, z: Real, collapsed: bool) -> Local:
    """Return the end of a search, judged by the first-order conditions themselves."""
    multipliers, optimality = first_order(model, z)
    return Local(
        criteria=here, settled=not collapsed or optimality <= KKT_TOLERANCE, optimality=optimality,
        peak_multipliers=multipliers,
    )  # fmt: skip


def first_order(model: _Model, z: Real) -> tuple[Real, float]:
    """Return multipliers of the active peaks and the norm of the Lagrangian's gradient they leave.

    Non-negative least squares for Σ λᵢ gᵢ + λᵦ gᵦ + bounds = 0 with Σ λᵢ = 1, over the peaks within
    `ACTIVE` of the highest, the band row where it is at its limit, and the bounds that hold.
    """
    n = z.size
    active = np.flatnonzero(model.heights >= model.heights.max() * (1.0 - ACTIVE))
    columns = [model.slopes[i] for i in active]
    if abs(model.band) <= ACTIVE and np.any(model.band_slope):
        columns.append(model.band_slope)
    for i in range(n):
        for at_bound, sign in ((z[i] <= 1e-12, -1.0), (z[i] >= 1.0 - 1e-12, 1.0)):
            if at_bound:
                columns.append(sign * np.eye(n)[i])
    matrix = np.array(columns).T
    weight = 1e3 * max(1.0, np.abs(matrix).max())
    sums = np.zeros(matrix.shape[1])
    sums[: active.size] = weight
    solution, _ = nnls(np.vstack([matrix, sums]), np.append(np.zeros(n), weight))
    multipliers = np.zeros(model.heights.size)
    multipliers[active] = solution[: active.size]
    return multipliers, float(np.abs(matrix @ solution).max())


def is_flat(criteria: Criteria, variables: tuple[Variable, ...]) -> bool:
    """Return whether no competing peak depends on any variable."""
    slopes = _model(criteria, variables, criteria.peaks[0].value, None).slopes
    return bool(np.all(np.abs(slopes) <= FLAT_SLOPE))


def _model(
    criteria: Criteria, variables: tuple[Variable, ...], scale: float, max_band_hz: float | None
) -> _Model:
    slope = np.array([variable.slope(criteria.values[variable.path]) for variable in variables])
    peaks = criteria.peaks[:ROWS]
    band, band_slope = 0.0, np.zeros(len(variables))
    if max_band_hz is not None and criteria.band is not None:
        band = (criteria.band.width - max_band_hz) / max_band_hz
        band_slope = criteria.band.gradient * slope / max_band_hz
    return _Model(
        heights=np.array([peak.value for peak in peaks]) / scale,
        slopes=np.array([peak.gradient * slope for peak in peaks]) / scale,
        band=band,
        band_slope=band_slope,
    )


def _gradient(model: _Model, step: Step) -> Real:
    """Return the gradient of the Lagrangian with the multipliers of a step, peaks matched by rank."""
    weights = np.zeros(model.heights.size)
    shared = min(weights.size, step.peak_multipliers.size)
    weights[:shared] = step.peak_multipliers[:shared]
    weights = weights / weights.sum() if weights.sum() > 0.0 else weights
    gradient: Real = weights @ model.slopes + step.band_multiplier * model.band_slope
    return gradient


def _update(hessian: Real, s: Real, y: Real) -> Real:
    """Return the damped BFGS update; the first one scales the matrix."""
    curvature = float(s @ y)
    if not np.any(hessian):
        if curvature <= 0.0:
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


def _snapped(z: Real) -> Real:
    """Return scaled variables within their bounds; the conic solver stops a hair's breadth inside them."""
    inside = np.clip(z, 0.0, 1.0)
    inside[inside <= SNAP] = 0.0
    inside[inside >= 1.0 - SNAP] = 1.0
    return inside


def _root(hessian: Real) -> Real:
    """Return R with RᵀR = hessian."""
    values, vectors = np.linalg.eigh(hessian)
    root: Real = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return root


def _scaled(criteria: Criteria, variables: tuple[Variable, ...]) -> Real:
    return np.array([variable.inside(criteria.values[variable.path]) for variable in variables])


def _values(z: Real, variables: tuple[Variable, ...]) -> dict[str, float]:
    return {variable.path: variable.outside(float(x)) for variable, x in zip(variables, z, strict=True)}
