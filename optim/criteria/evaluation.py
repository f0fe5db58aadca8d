"""Evaluating a design: the responses of all its cases and the rows they give, with gradients."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from optim.criteria.contact_criteria import contact_rows
from optim.criteria.response_gradients import Sensitivity
from optim.criteria.rows import Evaluation, Quantity, Response, Row
from optim.problem.cases import Case
from optim.problem.problem import Problem
from optim.problem.variables import Real, by_variables, by_variables_twice, parameter_values
from optim.problem.watch import ShouldStop
from solver.balance.simplifications import Effects, even_harmonics_reason
from solver.branches.observation import observing
from solver.branches.sweep import sweep
from solver.continuation.branch import Branch, Peak
from solver.extrema.extrema import HALF_POWER
from solver.scene.scene import FrictionContact, Scene

# Peaks below this share of the highest are not handed to the optimiser: within one step they cannot lead.
COMPETES = 0.6


def evaluate(
    problem: Problem, values: Mapping[str, float], *, gradients: bool = True, should_stop: ShouldStop = None
) -> Evaluation:
    """Compute everything a design is judged by.

    Parameters
    ----------
    problem : what is judged.
    values : the design, variable name to value.
    gradients : compute them (otherwise they are NaN).
    should_stop : asked while the responses are computed.

    Returns
    -------
    The evaluation; without rows if a response does not cover its range, for whatever reason.
    """
    responses: list[Response] = []
    rows: list[Row] = []
    for case in problem.cases:
        known = [response.branch for response in responses if response.case == case.beside]
        found = _case(problem, case, values, known, gradients, should_stop)
        responses += found[0]
        rows += found[1]
        if not all(response.branch.completed for response in found[0]):
            return Evaluation(values=dict(values), responses=tuple(responses), rows=())
    return Evaluation(values=dict(values), responses=tuple(responses), rows=tuple(rows))


def _case(
    problem: Problem, case: Case, values: Mapping[str, float], known: Sequence[Branch], gradients: bool,
    should_stop: ShouldStop,
) -> tuple[list[Response], list[Row]]:  # fmt: skip
    """Compute the responses and rows of one case; `known` are those of a case with another DOF alone."""
    here = case.scene.with_values(parameter_values(problem.variables, values))
    effects = effects_of(problem, here)
    judge = Judge(problem=problem, case=case, gradients=gradients)
    ranges = ((None, None), *problem.limits.forbidden_hz.get(case.name, ()))
    responses: list[Response] = []
    rows: list[Row] = []
    for i, (low, high) in enumerate(ranges):
        if known:
            branch = observing(known[i], here.observe.dof, limit=problem.limit, effects=effects)
        else:
            branch = sweep(
                here, start=low, stop=high, harmonics=problem.harmonics, limit=problem.limit, effects=effects,
                should_stop=should_stop,
            )  # fmt: skip
        responses.append(Response(case=case.name, branch=branch))
        rows += judge.response(branch) if low is None or high is None else judge.forbidden(branch, low, high)
    return responses, rows


def effects_of(problem: Problem, scene: Scene) -> Effects:
    """Return what has to be computed for the slopes: those by a load's variation need the even harmonics."""
    return Effects(even_harmonics=even_harmonics_reason(scene, problem.paths) is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Judge:
    """Turns the responses of one case into rows.

    Attributes
    ----------
    problem, case : what is judged.
    gradients : compute them (otherwise they are NaN).
    """

    problem: Problem
    case: Case
    gradients: bool

    def _sensitivity(self, branch: Branch) -> Sensitivity | None:
        return Sensitivity(branch.balance, self.problem.paths) if self.gradients else None

    def _nothing(self) -> Real:
        return np.full(len(self.problem.variables), np.nan)

    def response(self, branch: Branch) -> list[Row]:
        """Return the rows of the response over the band: peaks and the resonance band."""
        if not branch.completed or not branch.peaks:
            return []
        sensitivity, limits = self._sensitivity(branch), self.problem.limits
        weight = self.problem.weights[Quantity.PEAK] * self.case.weight
        rows = self._maxima(branch, sensitivity, Quantity.PEAK, "peak", weight, limits.peak)
        if branch.band is not None:
            slope = self._nothing()
            if sensitivity is not None:
                fixed = self.problem.limit is not None
                dlimit = np.zeros(len(self.problem.paths))
                if not fixed:
                    dlimit = HALF_POWER * sensitivity.peak(branch.peaks[0])
                slope = by_variables(self.problem.variables, sensitivity.band(branch.band.edges, dlimit))
            rows.append(
                Row(
                    quantity=Quantity.BAND, case=self.case.name,
                    what=f"band above {branch.band.limit:.6g} m", value=branch.band.width, gradient=slope,
                    at_hz=math.nan, weight=self.problem.weights[Quantity.BAND], bound=limits.band_hz,
                    second=self._band_second(branch, sensitivity),
                )
            )  # fmt: skip
        return rows + contact_rows(self.problem, self.case, branch, gradients=self.gradients)

    def forbidden(self, branch: Branch, low: float, high: float) -> list[Row]:
        """Return the rows of a response over a forbidden range."""
        if not branch.completed:
            return []
        what = f"amplitude from {low:g} to {high:g} Hz, highest"
        return self._maxima(
            branch, self._sensitivity(branch), Quantity.FORBIDDEN, what, 0.0, self.problem.limit
        )

    def _maxima(
        self, branch: Branch, sensitivity: Sensitivity | None, quantity: Quantity, what: str, weight: float,
        bound: float | None,
    ) -> list[Row]:  # fmt: skip
        """Return a row for every local maximum that competes."""
        competing = [peak for peak in branch.peaks if peak.value >= COMPETES * branch.peaks[0].value]
        return [
            Row(
                quantity=quantity, case=self.case.name, what=f"{what} at {peak.at:.6g} Hz", value=peak.value,
                gradient=self._nothing()
                if sensitivity is None
                else by_variables(self.problem.variables, sensitivity.peak(peak)),
                at_hz=peak.at, weight=weight, bound=bound, second=self._peak_second(peak, sensitivity),
            )
            for peak in competing
        ]  # fmt: skip

    def _peak_second(self, peak: Peak, sensitivity: Sensitivity | None) -> Callable[[], Real] | None:
        if sensitivity is None or not sensitivity.has_second:
            return None
        return lambda: by_variables_twice(self.problem.variables, sensitivity.peak_second(peak))

    def _band_second(self, branch: Branch, sensitivity: Sensitivity | None) -> Callable[[], Real] | None:
        if sensitivity is None or branch.band is None or not sensitivity.has_second:
            return None
        edges, highest = branch.band.edges, None if self.problem.limit is not None else branch.peaks[0]
        return lambda: by_variables_twice(self.problem.variables, sensitivity.band_second(edges, highest))


def natural_scales(problem: Problem) -> dict[Quantity, float]:
    """Return what an excess over a bound of 0 is relative to: for separation the scene's normal loads."""
    loads = [c.N0 for c in problem.scene.contacts if isinstance(c, FrictionContact) and c.N0 > 0.0]
    scales = dict.fromkeys(Quantity, 1.0)
    scales[Quantity.SEPARATION] = max(loads, default=1.0)
    return scales
