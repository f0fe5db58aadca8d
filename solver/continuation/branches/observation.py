"""The response of another degree of freedom on a branch that is already known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.balance.balance import Balance, build
from solver.balance.kernels.output import measure, measure_through_modes
from solver.balance.kernels.residual import evaluate
from solver.balance.rounding import resonates_undamped
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import DENSE, UTILISED
from solver.continuation.branch import Branch, BranchStatus, Peak, Points
from solver.continuation.branches.sweep import surveyed, with_error, with_points
from solver.continuation.extrema.extrema import Survey
from solver.continuation.extrema.nodes import NodeSolver
from solver.jit.fourier import Integer, Real
from solver.jit.timer import clock
from solver.linear.kernels.receptance import observer_receptance, receptance
from solver.scene.materials import Haigh


def observing(
    branch: Branch, dof: str, *, measure: str | Haigh | None = None, limit: float | None = None,
    peaks_alone: bool = False, errors: bool = True,
) -> Branch:  # fmt: skip
    """Return a frequency response observed otherwise: the same solutions, its own peaks and band.

    It costs one evaluation a point, no continuation. Between points it is as good as the branch is dense;
    near the top of the new DOF the survey of the peaks adds points of its own.

    Parameters
    ----------
    branch : a completed response over the frequency.
    dof : name of the DOF.
    measure : of its motion, as in a scene; that of the branch if left out. The utilisation of a recovered
        stress by what it is judged by, `solver.scene.materials.haigh_of`.
    limit : amplitude [m] above which the band is measured; peak/√2 if left out.
    peaks_alone : leave out the band and the error of the highest peak.
    errors : estimate that error; `with_error` does it later if not.

    Raises
    ------
    SceneError
        No such DOF.
    """
    begun = clock()
    workspace = _workspaces(branch, [dof], measure)[0]
    x, measures = _measured([workspace], branch.solutions, branch.tangents, branch.measures)
    seen = replace(branch, balance=workspace.balance, error_estimate=math.nan, newton_iterations=0)
    inside = workspace.balance.parameter.inside
    if resonates_undamped(workspace.balance, inside(branch.start), inside(branch.stop)):
        points = Points.of(branch, observed=x[0], measures=measures[0])
        return replace(with_points(seen, points), status=BranchStatus.UNDAMPED, peaks=(), band=None)
    survey = Survey.of(workspace, Points.of(branch, observed=x[0], measures=measures[0]))
    if peaks_alone:
        return replace(
            with_points(seen, survey.points), peaks=survey.peaks, band=None,
            peak_certificate=survey.certificate(completed=branch.reached),
        )  # fmt: skip
    found = surveyed(seen, survey, limit)
    if errors:
        found = with_error(found, workspace)
    return replace(found, seconds=clock() - begun)


def highest_peaks(branch: Branch, dofs: Sequence[str]) -> tuple[list[Peak], Branch]:
    """Return the highest peak of each of several DOFs on one frequency response.

    A fraction of what `observing` costs for each: the contacts are evaluated once a point for all DOFs, what
    was solved for one is known to those behind it, and lower maxima are not polished.

    Parameters
    ----------
    branch : a completed response over the frequency; its own peaks are not looked at.
    dofs : names of the DOFs.

    Returns
    -------
    The peaks, and the branch with the DOF observed that has the highest: with every point that was solved
    for, its peaks polished where they compete for the highest, and the error of that, but no band.

    Raises
    ------
    SceneError
        No such DOF.
    """
    begun = clock()
    workspaces = _workspaces(branch, dofs)
    nothing = np.zeros((len(branch.values), branch.balance.n_coefficients))
    solver = NodeSolver(workspaces[0], Points.of(branch, observed=nothing))
    observers, order = _Observers(solver, workspaces), solver.order
    found: list[Peak] = []
    worst, peaks, certificate = 0, branch.peaks, branch.peak_certificate
    for j in range(len(dofs)):
        observers.see(j, order)
        survey = Survey(solver, order, highest_alone=True)
        order = survey.order
        found.append(survey.peaks[0])
        if j == 0 or found[j].value > found[worst].value:
            worst, peaks, certificate = j, survey.peaks, survey.certificate(completed=True)
    observers.see(worst, order)
    points = solver.points_of(order)
    seen = replace(
        branch, balance=workspaces[worst].balance, peaks=peaks, band=None, peak_certificate=certificate,
        error_estimate=math.nan, newton_iterations=branch.newton_iterations + solver.spent,
        seconds=branch.seconds + clock() - begun,
    )  # fmt: skip
    return found, with_error(with_points(seen, points), workspaces[worst])


def _workspaces(branch: Branch, dofs: Sequence[str], measure: str | Haigh | None = None) -> list[Workspace]:
    """Return a workspace with each DOF observed; all share what is known of the resonances."""
    workspaces = list[Workspace]()
    for dof in dofs:
        balance = observed_balance(branch.balance, dof, measure)
        workspaces.append(Workspace.of(balance, observing_another=workspaces[0] if workspaces else None))
    return workspaces


def observed_balance(posed: Balance, dof: str, measure: str | Haigh | None = None) -> Balance:
    """Return the balance of a frequency response observed otherwise, see `observing`."""
    haigh = measure if isinstance(measure, Haigh) else None
    how = {"measure": "half_peak_to_peak" if haigh else measure or posed.scene.observe.measure}
    seen = posed.scene.observe.model_copy(update={"dof": dof, **how})
    other = posed.scene.model_copy(update={"observe": seen})
    balance = build(other, harmonics=posed.n_harmonics, effects=posed.effects)
    if haigh is None:
        return balance
    system = balance.system._replace(centred=UTILISED, haigh=np.array(haigh, dtype=np.float64))
    return replace(balance, system=system)


class _Observers:
    """Several observed DOFs at the points of one solver, each point measured once for all of them."""

    def __init__(self, solver: NodeSolver, workspaces: Sequence[Workspace]) -> None:
        self._solver, self._workspaces = solver, workspaces
        self._known = np.zeros(0, bool)
        table = solver.table
        self._x = np.empty((len(workspaces), 0, table.observed.shape[1]))
        self._measures = np.empty((len(workspaces), 0, table.measures.shape[1]))

    def see(self, j: int, rows: Integer) -> None:
        """Have rows of the table seen as DOF number j sees them."""
        table = self._solver.table
        more = len(table.measures) - self._known.size
        if more:
            self._known = np.pad(self._known, (0, more))
            self._x, self._measures = (
                np.pad(one, ((0, 0), (0, more), (0, 0))) for one in (self._x, self._measures)
            )
        new = rows[~self._known[rows]]
        self._known[new] = True
        self._x[:, new], self._measures[:, new] = _measured(
            self._workspaces, table.solutions[new], table.tangents[new], table.measures[new]
        )
        self._solver.observe(self._workspaces[j], rows, self._x[j, rows], self._measures[j, rows])


def _measured(
    workspaces: Sequence[Workspace], solutions: Real, tangents: Real, like: Real
) -> tuple[Real, Real]:
    """Return the motions and measures of several DOFs, (DOFs, points, …); residuals are those of `like`."""
    first = workspaces[0]
    x = np.zeros((len(workspaces), len(solutions), first.balance.n_coefficients))
    measures = np.repeat(like[None], len(workspaces), axis=0)
    if first.balance.system.form != DENSE:
        seen = np.array([each.balance.system.observe_modes for each in workspaces])
        measure_through_modes(first.system, first.point, seen, solutions, tangents, x, measures)
        return x, measures
    for i, (solution, tangent) in enumerate(zip(solutions, tangents, strict=True)):
        u, p = solution[:-1].copy(), float(solution[-1])
        receptance(first.system, p, first.linear)
        evaluate(first.system, first.linear, u, p, 0.0, first.point)
        for j, each in enumerate(workspaces):
            if j > 0:
                observer_receptance(each.system, p, each.linear)
            along = tangent[:-1].copy(), float(tangent[-1])
            measure(each.system, each.linear, u, first.point, *along, x[j, i], measures[j, i])
    return x, measures
