"""From a covariance to the key `uncertain` of a robust design: an ellipsoid, or else intervals."""

from __future__ import annotations

from typing import Any

import numpy as np

from optim.errors import DesignError
from optim.identification.unknowns import Unknowns
from optim.problem.uncertainty_input import CONFIDENCE, read_uncertain
from optim.problem.variables import Real
from solver.errors import SceneError, SettingError
from solver.scene.scene import Scene


def uncertain_table(
    scene: Scene, unknowns: Unknowns, values: Real, covariance: Real, intervals: Real, *, told: bool
) -> dict[str, Any]:
    """Return what a robust design takes as not known.

    Parameters
    ----------
    scene : with the estimates.
    values, covariance : (n,), (n, n) in the units of the parameters.
    intervals : (n, 2) of 95 %, for where the ellipsoid leaves what the parameters may have.
    told : whether the data tell every unknown; else intervals.
    """
    names = list(unknowns.names)
    centre = {name: float(value) for name, value in zip(names, values, strict=True)}
    ellipsoid = {"centre": centre, "covariance": covariance.tolist(), "confidence": CONFIDENCE}
    if told:
        try:
            read_uncertain(scene, (), ellipsoid)
        except (DesignError, SettingError, SceneError):
            pass  # it reaches beyond what a parameter may have: intervals do not
        else:
            return ellipsoid
    return {name: [float(low), float(high)] for name, (low, high) in zip(names, intervals, strict=True)}


def clipped(unknowns: Unknowns, intervals: Real) -> Real:
    """Return intervals within the bounds, and of some width."""
    low = np.array([variable.low for variable in unknowns.variables])
    high = np.array([variable.high for variable in unknowns.variables])
    found = np.column_stack([np.clip(intervals[:, 0], low, high), np.clip(intervals[:, 1], low, high)])
    flat = found[:, 1] <= found[:, 0]
    found[flat] = np.column_stack([low, high])[flat]
    return np.asarray(found)
