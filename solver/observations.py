"""The response of another degree of freedom on a branch that is already known."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from solver.accuracy import peak_error
from solver.balance import build
from solver.branch import Branch
from solver.fourier import Real, to_full
from solver.kernels.observe import measure
from solver.kernels.receptance import receptance
from solver.kernels.residual import evaluate
from solver.peaks import Points, Survey, band_limit
from solver.savings import Effects
from solver.scene import Observe
from solver.workspace import Workspace


def observing(
    branch: Branch, dof: str, *, limit: float | None = None, effects: Effects | None = None
) -> Branch:
    """Return a frequency response with another DOF observed: the same solutions, its own peaks and band.

    It costs one evaluation a point, no continuation. Between points it is as good as the branch is dense;
    near the top of the new DOF the survey of the peaks adds points of its own.

    Parameters
    ----------
    branch : a completed response over the frequency.
    dof : name of the DOF.
    limit : amplitude [m] above which the band is measured; peak/√2 if left out.
    effects : those the branch was computed with.

    Raises
    ------
    SceneError
        No such DOF.
    """
    begun = time.perf_counter()
    scene = branch.balance.scene
    other = scene.model_copy(update={"observe": Observe(dof=dof, band=scene.observe.band)})
    balance = build(other, "frequency", harmonics=branch.balance.n_harmonics, effects=effects)
    workspace = Workspace.of(balance)
    rows, measures = np.zeros((len(branch.values), balance.n_coefficients)), branch.measures.copy()
    for i, (solution, tangent) in enumerate(zip(branch.solutions, branch.tangents, strict=True)):
        _measure(workspace, solution, tangent, rows[i], measures[i])
    points = Points(solutions=branch.solutions, tangents=branch.tangents, measures=measures)
    survey = Survey(workspace, points)
    at = band_limit(limit, survey.peaks, balance.parameter.kind)
    return replace(
        branch, balance=balance,
        observed=to_full(rows, balance.system.ks, balance.n_harmonics), measures=measures, peaks=survey.peaks,
        band=None if at is None else survey.band(at), error_estimate=peak_error(workspace, survey.peaks),
        newton_iterations=survey.spent, seconds=time.perf_counter() - begun,
    )  # fmt: skip


def _measure(workspace: Workspace, solution: Real, tangent: Real, row: Real, out: Real) -> None:
    """Fill a row with what is observed at a point; `out` keeps its residual."""
    system, linear, point = workspace.system, workspace.linear, workspace.point
    u, p = np.ascontiguousarray(solution[:-1]), float(solution[-1])
    receptance(system, p, linear)
    evaluate(system, linear, u, p, 0.0, point)
    measure(system, linear, u, point, np.ascontiguousarray(tangent[:-1]), float(tangent[-1]), row, out)
