"""Rows of what the contacts go through: friction work, and loads that must not fall to 0.

The worst over a response is a maximum over the frequency, so its gradient is the one at that frequency
(envelope theorem), or that of a corner of the response.
"""

from __future__ import annotations

import math

import numpy as np

from optim.criteria.rows import Quantity, Row
from optim.problem.cases import Case
from optim.problem.problem import Problem
from optim.problem.variables import Real, by_variables
from solver.continuation.branch import Branch
from solver.response.wear import WearSensitivity
from solver.response.wear_nonsmooth import worst_slopes
from solver.response.worst_wear import Measure, worst_wear
from solver.scene.scene import AnyContact, ElasticNormalContact, FrictionContact


def contact_rows(problem: Problem, case: Case, branch: Branch, *, gradients: bool) -> list[Row]:
    """Return the rows of the limits on contacts over one response.

    Parameters
    ----------
    problem, case : what is judged.
    branch : the response over the band.
    gradients : compute them (otherwise they are NaN).
    """
    rows: list[Row] = []
    slopes = WearSensitivity(branch.balance, problem.paths if gradients else ())
    for contact in branch.balance.scene.contacts:
        name = _of_sector(contact)
        bound = problem.limits.friction_work.get(name)
        if bound is not None:
            rows += _work(problem, case, branch, contact, slopes if gradients else None, bound)
        if name in problem.limits.in_contact:
            rows += _separation(problem, case, branch, contact, slopes if gradients else None)
    return rows


def _of_sector(contact: AnyContact) -> str:
    """Return the name a contact has in one sector: that of ``shroud@3`` is ``shroud``."""
    return contact.name.partition("@")[0]


def _work(
    problem: Problem, case: Case, branch: Branch, contact: AnyContact, slopes: WearSensitivity | None,
    bound: float,
) -> list[Row]:  # fmt: skip
    """Return a row for every local maximum of the friction work that competes."""
    return [
        Row(
            quantity=Quantity.FRICTION_WORK, case=case.name,
            what=f"friction work of {contact.name} at {worst.at:.6g} Hz", value=worst.value,
            gradient=_nothing(problem) if slopes is None
            else by_variables(problem.variables, worst_slopes(slopes, worst, contact.name).gradient),
            at_hz=worst.at, weight=0.0, bound=bound,
        )
        for worst in worst_wear(branch, contact.name, Measure.FRICTION_WORK)
    ]  # fmt: skip


def _separation(
    problem: Problem, case: Case, branch: Branch, contact: AnyContact, slopes: WearSensitivity | None
) -> list[Row]:
    """Return the negative least load of a contact, which must not be above 0."""
    if isinstance(contact, FrictionContact) and not isinstance(contact, ElasticNormalContact):
        slope = _nothing(problem)
        if slopes is not None:
            by_path = np.array([_load_slope(contact, path) for path in problem.paths])
            slope = by_variables(problem.variables, by_path)
        return [
            Row(
                quantity=Quantity.SEPARATION, case=case.name, what=f"-least load of {contact.name}",
                value=abs(contact.N1_value) - contact.N0, gradient=slope, at_hz=math.nan, weight=0.0,
                bound=0.0,
            )
        ]  # fmt: skip
    rows = []
    for worst in worst_wear(branch, contact.name, Measure.LEAST_LOAD):
        slope = _nothing(problem)
        if slopes is not None:
            load = worst_slopes(slopes, worst, contact.name, Measure.LEAST_LOAD)
            slope = by_variables(problem.variables, -load.gradient)
        rows.append(
            Row(
                quantity=Quantity.SEPARATION, case=case.name,
                what=f"-least load of {contact.name} at {worst.at:.6g} Hz", value=-worst.value,
                gradient=slope, at_hz=worst.at, weight=0.0, bound=0.0,
            )
        )  # fmt: skip
    return rows


def _load_slope(contact: FrictionContact, path: str) -> float:
    """Return d(|N1| − N0)/dp of a given load."""
    owner, _, key = path.rpartition(".")
    if owner not in (contact.name, contact.group):
        return 0.0
    sign = math.copysign(1.0, contact.N1_value)
    by_key = {"N0": sign * (contact.N1_ratio or 0.0) - 1.0, "N1": sign, "N1_ratio": sign * contact.N0}
    return by_key.get(key, 0.0)


def _nothing(problem: Problem) -> Real:
    return np.full(len(problem.variables), np.nan)
