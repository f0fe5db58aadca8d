"""The response of another degree of freedom on a branch that is already known."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.balance.balance import build
from solver.balance.kernels.observers import measure_through_modes, modal_motion
from solver.balance.kernels.output import measure
from solver.balance.kernels.residual import evaluate, evaluate_forces, prepare_forces
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import DENSE
from solver.continuation.branch import Branch
from solver.continuation.branches.sweep import highest_between
from solver.continuation.extrema.branch_error import branch_error
from solver.continuation.extrema.extrema import Survey, band_limit
from solver.continuation.extrema.nodes import Place, Points
from solver.continuation.peaks import Peak
from solver.jit.fourier import Flags, Real, to_full
from solver.linear.kernels.receptance import observer_receptance, receptance

COMPETES_FOR_HIGHEST = 0.8  # share of the highest point from which a maximum may turn out to be the highest


def observing(
    branch: Branch, dof: str, *, measure: str | None = None, limit: float | None = None,
    effects: Effects | None = None,
) -> Branch:  # fmt: skip
    """Return a frequency response observed otherwise: the same solutions, its own peaks and band.

    It costs one evaluation a point, no continuation. Between points it is as good as the branch is dense;
    near the top of the new DOF the survey of the peaks adds points of its own.

    Parameters
    ----------
    branch : a completed response over the frequency.
    dof : name of the DOF.
    measure : of its motion, as in a scene; that of the branch if left out.
    limit : amplitude [m] above which the band is measured; peak/√2 if left out.
    effects : those the branch was computed with.

    Raises
    ------
    SceneError
        No such DOF.
    """
    begun = time.perf_counter()
    scene = branch.balance.scene
    update = {"dof": dof, "measure": measure or scene.observe.measure}
    other = scene.model_copy(update={"observe": scene.observe.model_copy(update=update)})
    balance = build(other, "frequency", harmonics=branch.balance.n_harmonics, effects=effects)
    workspace = Workspace.of(balance)
    rows, measures = (
        found[0] for found in _measured([workspace], branch.solutions, branch.tangents, branch.measures)
    )
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


def highest_peaks(branch: Branch, dofs: Sequence[str]) -> tuple[list[Peak], Branch]:
    """Return the highest peak of each of several DOFs on one frequency response.

    The contacts are evaluated once a point for all of them, and lower maxima are not polished: a fraction of
    what `observing` costs for each. The peaks themselves are found and polished in the same way. Points that
    one DOF calls for, at changes of state and narrow resonances, are known to those behind it.

    Parameters
    ----------
    branch : a completed response over the frequency.
    dofs : names of the DOFs.

    Returns
    -------
    The peaks, and the branch with every point that was solved for.

    Raises
    ------
    SceneError
        No such DOF.
    """
    scene, balance = branch.balance.scene, branch.balance
    workspaces = [Workspace.of(balance)]
    for dof in dofs:
        other = scene.model_copy(update={"observe": scene.observe.model_copy(update={"dof": dof})})
        seen = build(other, "frequency", harmonics=balance.n_harmonics)
        workspaces.append(Workspace.of(seen, observing_another=workspaces[0]))
    solutions, tangents, states = branch.solutions, branch.tangents, branch.states
    rows, measures = _measured(workspaces, solutions, tangents, branch.measures)
    found, lost = [], set[Place]()
    for j, workspace in enumerate(workspaces[1:], 1):
        points = Points(
            solutions=solutions, tangents=tangents, measures=measures[j], observed=rows[j], states=states
        )
        survey = Survey(workspace, points, worth=COMPETES_FOR_HIGHEST, lost=lost)
        found.append(survey.peaks[0])
        points = survey.points
        fresh = _fresh(points.solutions, solutions)
        more = _measured(workspaces, points.solutions[fresh], points.tangents[fresh], points.measures[fresh])
        rows, measures = (_joined(*both, fresh) for both in zip((rows, measures), more, strict=True))
        solutions, tangents, states = points.solutions, points.tangents, points.states
    return found, replace(
        branch, values=balance.parameter.all_outside(solutions[:, -1].copy()), solutions=solutions,
        tangents=tangents, states=states, measures=measures[0],
        observed=to_full(rows[0], balance.system.ks, balance.highest_harmonic),
    )  # fmt: skip


def _fresh(solutions: Real, known: Real) -> Flags:
    """Return which rows are not among the known ones, all of which are there in the same order."""
    fresh, j = np.ones(len(solutions), bool), 0
    for i, solution in enumerate(solutions):
        if j < len(known) and np.array_equal(solution, known[j]):
            fresh[i], j = False, j + 1
    return fresh


def _joined(known: Real, more: Real, fresh: Flags) -> Real:
    """Return the rows of several DOFs, (DOFs, points, …), with those of fresh points in their places."""
    both = np.empty((len(known), fresh.size, known.shape[2]))
    both[:, ~fresh], both[:, fresh] = known, more
    return both


def _measured(
    workspaces: Sequence[Workspace], solutions: Real, tangents: Real, like: Real
) -> tuple[Real, Real]:
    """Return the motions and measures of several DOFs, (DOFs, points, …); residuals are those of `like`."""
    rows = np.zeros((len(workspaces), len(solutions), workspaces[0].balance.n_coefficients))
    measures = np.repeat(like[None], len(workspaces), axis=0)
    for i, (solution, tangent) in enumerate(zip(solutions, tangents, strict=True)):
        _measure_all(workspaces, solution, tangent, rows[:, i], measures[:, i])
    return rows, measures


def _measure_all(
    workspaces: Sequence[Workspace], solution: Real, tangent: Real, rows: Real, out: Real
) -> None:
    """Fill a row for each of several DOFs of one motion; `out` keeps its residual and what it loses."""
    first = workspaces[0]
    u, p = np.ascontiguousarray(solution[:-1]), float(solution[-1])
    du, dp = np.ascontiguousarray(tangent[:-1]), float(tangent[-1])
    system = first.balance.system
    if system.alone.any() or system.hold == 1:
        receptance(first.system, p, first.linear)
        evaluate(first.system, first.linear, u, p, 0.0, first.point)
    else:
        prepare_forces(first.system, first.linear, p)
        evaluate_forces(first.system, first.linear, u, p, first.point)
    if system.form == DENSE:
        for j, each in enumerate(workspaces):
            if j > 0:
                observer_receptance(each.system, p, each.linear)
            measure(each.system, each.linear, u, first.point, du, dp, rows[j], out[j])
        return
    amplitudes = np.empty((2, *system.modal_forces.shape), np.complex128)
    modal_motion(first.system, u, p, first.point, du, dp, amplitudes)
    for j, each in enumerate(workspaces):
        measure_through_modes(each.system, first.point, amplitudes, rows[j], out[j])
