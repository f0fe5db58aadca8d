"""A response that criteria judge, with the derivatives they share, and how its rows are made."""

from __future__ import annotations

import math
from collections.abc import Callable, Container
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from optim.criteria.criterion import Criterion
from optim.criteria.response_gradients import Sensitivity
from optim.criteria.rows import Row
from optim.problem.cases import Case
from optim.problem.problem import Problem
from optim.problem.variables import Real, by_variables, by_variables_twice
from solver.continuation.branch import Branch
from solver.response.wear import WearSensitivity
from solver.scene.scene import AnyContact


def of_sector(contact: AnyContact) -> str:
    """Return the name a contact has in one sector: that of ``shroud@3`` is ``shroud``."""
    return contact.name.partition("@")[0]


@dataclass(frozen=True, kw_only=True)
class Judged:
    """The response of a case of a problem.

    Attributes
    ----------
    problem, case : what is judged.
    branch : the response, which covers its range and has a peak.
    gradients : compute them (otherwise they are NaN).
    hertz : (low, high) [Hz] of a response beyond the band; None for that over the band.
    """

    problem: Problem
    case: Case
    branch: Branch
    gradients: bool
    hertz: tuple[float, float] | None = None

    @cached_property
    def sensitivity(self) -> Sensitivity | None:
        """Derivatives of amplitudes by the parameter paths; None without gradients."""
        return Sensitivity(self.branch.balance, self.problem.paths) if self.gradients else None

    @cached_property
    def wear(self) -> WearSensitivity | None:
        """Derivatives of what contacts go through by the parameter paths; None without gradients."""
        return WearSensitivity(self.branch.balance, self.problem.paths) if self.gradients else None

    def contacts(self, names: Container[str]) -> list[AnyContact]:
        """Return the contacts of these names, those of every sector of a disk that is written out."""
        return [one for one in self.branch.balance.scene.contacts if of_sector(one) in names]

    def limit(self, criterion: Criterion) -> Any:
        """Return what the keys of a criterion came to; None if none was given."""
        return self.problem.limits.of(criterion)

    def weight(self, criterion: Criterion) -> float:
        """Return the weight of a criterion in what is minimised."""
        return self.problem.weights.get(criterion, 0.0)

    def row(
        self, criterion: Criterion, what: str, value: float, by_paths: Real | None, *,
        at_hz: float = math.nan, bound: float | None = None, weight: float | None = None,
        second: Callable[[], Real] | None = None,
    ) -> Row:  # fmt: skip
        """Return a row of a criterion.

        Parameters
        ----------
        what : in words, for example ``peak at 753.28 Hz``.
        value : of the quantity itself, in the unit of the criterion.
        by_paths : its derivatives by the parameter paths, (n_paths,); None without gradients.
        at_hz : its frequency, if it has one.
        bound : the most it may be, or the least where larger is better.
        weight : in what is minimised; that of the criterion if left out.
        second : computes its second derivatives by the parameter paths, (n_paths, n_paths).
        """
        variables = self.problem.variables
        gradient = np.full(len(variables), np.nan)
        if by_paths is not None:
            gradient = by_variables(variables, by_paths)
        twice = None if second is None else lambda: by_variables_twice(variables, second())
        weight = self.weight(criterion) if weight is None else weight
        if criterion.smaller_is_better:
            return Row(
                quantity=criterion, case=self.case.name, what=what, value=value, gradient=gradient,
                at_hz=at_hz, weight=weight, bound=bound, second=twice,
            )  # fmt: skip
        # Kept from above like all rows; 0.0 − 0.0 is 0.0, −0.0 would show its sign.
        return Row(
            quantity=criterion, case=self.case.name, what=f"-{what}", value=0.0 - value,
            gradient=-gradient, at_hz=at_hz, weight=0.0, bound=None if bound is None else 0.0 - bound,
            second=None if twice is None else lambda: -twice(),
        )  # fmt: skip
