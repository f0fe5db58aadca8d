"""The response of another degree of freedom on a branch that is already known."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from solver.balance.balance import build
from solver.balance.kernels.output import measure
from solver.balance.kernels.residual import evaluate
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.continuation.branch import Branch
from solver.continuation.branches.sweep import highest_between
from solver.continuation.extrema.branch_error import branch_error
from solver.continuation.extrema.extrema import Survey, band_limit
from solver.continuation.extrema.nodes import Points
from solver.jit.fourier import Real, to_full
from solver.linear.kernels.receptance import receptance


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
    other = scene.model_copy(update={"observe": scene.observe.model_copy(update={"dof": dof})})
    balance = build(other, "frequency", harmonics=branch.balance.n_harmonics, effects=effects)
    workspace = Workspace.of(balance)
    rows, measures = np.zeros((len(branch.values), balance.n_coefficients)), branch.measures.copy()
    for i, (solution, tangent) in enumerate(zip(branch.solutions, branch.tangents, strict=True)):
        _measure(workspace, solution, tangent, rows[i], measures[i])
    survey = Survey(
        workspace,
        Points(
            solutions=branch.solutions, tangents=branch.tangents, measures=measures, observed=rows,
            states=branch.states,
        ),
    )  # fmt: skip
    points = survey.points
    at = band_limit(limit, survey.peaks, balance.parameter.kind)
    error = branch_error(workspace, points, survey.peaks, highest_between)
    return replace(
        branch, balance=balance,
        values=balance.parameter.all_outside(points.solutions[:, -1].copy()), solutions=points.solutions,
        tangents=points.tangents, states=points.states,
        observed=to_full(points.observed, balance.system.ks, balance.highest_harmonic),
        measures=points.measures,
        peaks=survey.peaks, peak_certificate=survey.certificate(completed=branch.completed),
        band=None if at is None else survey.band(at), error_estimate=error,
        newton_iterations=survey.spent, seconds=time.perf_counter() - begun,
    )  # fmt: skip


def _measure(workspace: Workspace, solution: Real, tangent: Real, row: Real, out: Real) -> None:
    """Fill a row with what is observed at a point; `out` keeps its residual."""
    system, linear, point = workspace.system, workspace.linear, workspace.point
    u, p = np.ascontiguousarray(solution[:-1]), float(solution[-1])
    receptance(system, p, linear)
    evaluate(system, linear, u, p, 0.0, point)
    measure(system, linear, u, point, np.ascontiguousarray(tangent[:-1]), float(tangent[-1]), row, out)
