"""The worst a contact goes through over a response: every local maximum of a measure along a branch.

At a maximum inside the range the slope along the branch is 0, and at an end the frequency does not move
either, so the derivative of the worst value by a parameter is the one at that fixed frequency (envelope
theorem). A maximum may also be a corner of the response, closed in by bracketing, where two smooth pieces m⁻
and m⁺ meet at ω_k(p); as for peaks of the amplitude (`solver.sensitivity.nonsmooth`) the derivative is
m⁻_p + m⁻_ω dω_k/dp with dω_k/dp = −(m⁺_p − m⁻_p)/(m⁺_ω − m⁻_ω), from solutions beside the corner at two
distances, extrapolated to it.

Two maxima may hide between two points of a branch: near the top it is made dense until cubics through its
points predict the measure between them, as for the peaks of the amplitude
(`solver.continuation.extrema.extrema`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from operator import attrgetter
from typing import Annotated, TypeVar

import numpy as np

from solver.balance.balance import Kind, contact_index
from solver.balance.kernels.locate import between
from solver.balance.kernels.output import MEASURES
from solver.balance.kernels.residual import contact_values, evaluate
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import evaluation_by_value
from solver.continuation.bracketing import closing_in, dense_between
from solver.continuation.branch import Branch
from solver.continuation.extrema.kernels.node_table import share_scales
from solver.continuation.extrema.kernels.peak_search import MOST_HALVINGS, NEAR_THE_TOP, PREDICTED
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.linear.kernels.receptance import receptance
from solver.response.wear import (
    Change,
    ContactCycle,
    Measured,
    WearSensitivity,
    force_change,
    friction_work,
    least_load,
    slip_travel,
    work_of,
    work_pairing,
)
from solver.results.told import Piece
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.nonsmooth import SMOOTH, corner_slopes

Number = TypeVar("Number", float, Real)
# Maxima below this share of the highest cannot lead within one step of an optimiser.
COMPETES = 0.6
_HALVINGS_BELOW = 2  # of an interval whose maximum could compete, but not lead
_FLAT = 1e-11  # slope over the whole interval, relative to the value, at which a maximum is found
_NARROW = 1e-12  # share of the interval at which a corner is found
_MOST_ITERATIONS = 12


class Measure(Enum):
    """What a contact goes through in a period; the value is what a user reads."""

    FRICTION_WORK = "friction work"
    FRICTION_POWER = "friction power"
    LEAST_LOAD = "least normal load"
    SLIP_TRAVEL = "slip travel"


_MEASURES: dict[Measure, Callable[[ContactCycle, int, Sequence[Change]], tuple[float, Real] | None]] = {
    Measure.FRICTION_WORK: friction_work,
    Measure.FRICTION_POWER: friction_work,
    Measure.LEAST_LOAD: least_load,
    Measure.SLIP_TRAVEL: slip_travel,
}


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class WorstWear(Piece):
    """A local worst value of a measure over a branch."""

    value: Annotated[float, "Friction work [J] or power [W], least normal load [N] or slip travel [m]."]
    at: Annotated[float, "Value of the branch's parameter there, in user units (Hz for a frequency)."]
    solution: Annotated[Real, "Slip motions of all contacts there [m], (n_unknowns,)."]
    interior: Annotated[bool, "Not at an end of the branch."]


def worst_friction_work(branch: Branch, contact: str) -> WorstWear:
    """Return the largest friction work of a contact in one period over a branch.

    Raises
    ------
    SettingError
        An unknown contact, or a branch without a point.
    """
    return worst_wear(branch, contact, Measure.FRICTION_WORK)[0]


def worst_wear(
    branch: Branch, contact: str, measure: Measure = Measure.FRICTION_WORK
) -> tuple[WorstWear, ...]:
    """Return every local worst value of a measure over a branch that competes, worst first.

    Of work and travel they are the maxima above `COMPETES` times the highest, of the least load all minima;
    the ends of the branch are among them where it is worst there. Only a completed branch covers its range.

    Raises
    ------
    SettingError
        An unknown contact, a law the measure has no meaning for, or a branch without a point.
    """
    e = contact_index(branch.scene, contact)
    if not len(branch.values):
        raise SettingError("branch", branch.status.value, "must have a point")
    found = _MaximaSearch(branch, e, measure).maxima()
    if measure is Measure.LEAST_LOAD:
        return tuple(found)
    return tuple(one for one in found if one.value >= COMPETES * found[0].value)


@dataclass(frozen=True, slots=True)
class _Node:
    """A point of the branch with the number to be made largest and its slope along the tangent."""

    solution: Real
    tangent: Real
    value: float
    slope: float


class _MaximaSearch:
    """Looks for the maxima of one measure of one contact along a branch."""

    def __init__(self, branch: Branch, e: int, measure: Measure) -> None:
        self._workspace = Workspace.of(branch.balance)
        self._point = evaluation_by_value(self._workspace.point)  # views: they follow the workspace
        frequency = branch.balance.parameter.kind is Kind.FREQUENCY
        fixed = frequency and not np.any(branch.balance.system.load_rise)
        # The frequency does not change the contacts but for loads that follow it.
        self._fixed = contact_values(branch.balance.system, 0.0, 0.0) if fixed else None
        self._e = e
        self._measure = measure
        self._sign = -1.0 if measure is Measure.LEAST_LOAD else 1.0
        nodes = self._on_branch(branch.solutions, branch.tangents)
        top = max(node.value for node in nodes)
        self._size = max(abs(node.value) for node in nodes)
        self._nodes = [nodes[0]]
        for right in nodes[1:]:
            inside = dense_between(self._nodes[-1], right, MOST_HALVINGS, partial(self._halved, top))
            self._nodes += [*inside, right]

    def maxima(self) -> list[WorstWear]:
        """Return all local maxima, highest first."""
        found = []
        for left, right in zip(self._nodes[:-1], self._nodes[1:], strict=True):
            if (left.slope > 0.0) == (right.slope > 0.0):
                continue  # both tangents point along the branch: the measure rises, or falls, all the way
            by_share = self._by_share(left, right)
            g_left, g_right = left.slope * by_share[0], right.slope * by_share[1]
            if g_left > 0.0 >= g_right:
                # The slope by the share of the chord is brought to 0: it jumps over it at a corner.
                best = left if left.value >= right.value else right
                at = partial(self._between, left, right)
                for node, slope, width in closing_in(at, attrgetter("slope"), g_left, g_right):
                    best = node if node.value >= best.value else best
                    if abs(slope) <= _FLAT * self._size or width <= _NARROW:
                        break
                found.append(self._worst(best, interior=True))
        first, last = self._nodes[0], self._nodes[-1]
        if len(self._nodes) == 1 or first.slope <= 0.0:
            found.append(self._worst(first, interior=False))
        if len(self._nodes) > 1 and last.slope >= 0.0:
            found.append(self._worst(last, interior=False))
        return sorted(found, key=lambda one: -self._sign * one.value)

    def _worst(self, node: _Node, *, interior: bool) -> WorstWear:
        at = float(self._workspace.balance.parameter.outside(float(node.solution[-1])))
        solution = node.solution[:-1].copy()
        return WorstWear(value=self._sign * node.value, at=at, solution=solution, interior=interior)

    def _halved(self, top: float, left: _Node, right: _Node, depth: int) -> tuple[_Node | None, bool]:
        """Return the node between two, and whether a cubic predicts it; None where nothing can compete."""
        below = top - (1.0 - COMPETES) * self._size
        if max(left.value, right.value) < below:
            return None, True
        by_share = self._by_share(left, right)
        g_left, g_right = left.slope * by_share[0], right.slope * by_share[1]
        if g_left == 0.0 == g_right:
            return None, True  # a given load does not change with the frequency
        reach = max(left.value, right.value) + 0.25 * (max(g_left, 0.0) + max(-g_right, 0.0))
        if reach < top - (1.0 - NEAR_THE_TOP) * self._size and depth <= MOST_HALVINGS - _HALVINGS_BELOW:
            return None, True
        middle = self._between(left, right, 0.5)
        cubic = 0.5 * (left.value + right.value) + (g_left - g_right) / 8.0
        return middle, middle is None or abs(cubic - middle.value) <= PREDICTED * self._size

    def _on_branch(self, solutions: Real, tangents: Real) -> list[_Node]:
        """Return the points of the branch: the work at all of them at once."""
        workspace, point, system = self._workspace, self._point, self._workspace.balance.system
        e, first = self._e, int(system.first_port[self._e])
        rubbing = workspace.balance.scene.contacts[e].RUBBING
        together = self._measure in (Measure.FRICTION_WORK, Measure.FRICTION_POWER) and rubbing
        nodes: list[_Node] = []
        forces = np.zeros((2, len(rubbing), len(solutions), point.F.shape[1]))
        for i, (solution, tangent) in enumerate(zip(solutions, tangents, strict=True)):
            p = float(solution[-1])
            if i == 0 or not together:  # forces of contacts do not depend on the receptance
                receptance(workspace.system, p, workspace.linear)
            evaluate(workspace.system, workspace.linear, solution[:-1], p, 0.0, workspace.point)
            if not together:
                nodes.append(self._node(solution, tangent))
                continue
            dU = tangent[:-1].reshape(point.F.shape)
            for j, a in enumerate(rubbing):
                forces[0, j, i] = point.F[first + a]
                forces[1, j, i] = tangent[-1] * point.dF_dp[first + a]
                forces[1, j, i] += force_change(system, e, a, point.dF_dU, dU)
        if not together:
            return nodes
        values, slopes = np.zeros(len(solutions)), np.zeros(len(solutions))
        for j, a in enumerate(rubbing):
            motions = [
                rows[:, :-1].reshape(-1, *point.F.shape)[:, first + a] for rows in (solutions, tangents)
            ]
            done, rises = work_of(motions[0], forces[0, j], motions[1], forces[1, j], system.ks)
            values, slopes = values + done, slopes + rises
        values, slopes = self._rated(values, slopes, solutions[:, -1], tangents[:, -1])
        known = np.isfinite(values)
        values, slopes = np.where(known, values, -math.inf), np.where(known, slopes, 0.0)
        return [
            _Node(*each)
            for each in zip(solutions, tangents, values.tolist(), slopes.tolist(), strict=True)
        ]  # fmt: skip

    def _by_share(self, left: _Node, right: _Node) -> tuple[float, float]:
        """Return what turns both tangents into derivatives by the share of the chord between them."""
        ends = left.solution, right.solution, left.tangent, right.tangent
        return share_scales(*ends, self._workspace.balance.system.least_size)

    def _between(self, left: _Node, right: _Node, share: float) -> _Node | None:
        """Return the solution at a share of the chord, its slope by the share; None if there is none."""
        workspace, by_share = self._workspace, self._by_share(left, right)
        found, tangent = np.zeros(left.solution.size), np.zeros(left.solution.size)
        observed, values = np.zeros(workspace.balance.n_coefficients), np.zeros(MEASURES)
        good, _ = between(
            workspace.system, workspace.linear, workspace.point, left.solution, left.tangent * by_share[0],
            right.solution, right.tangent * by_share[1], share, _MOST_ITERATIONS, found, tangent, observed,
            values,
        )  # fmt: skip
        # It leaves the workspace evaluated at the solution found.
        return self._node(found, tangent) if good else None

    def _rated(self, value: Number, slope: Number, p: Number, dp: Number) -> tuple[Number, Number]:
        """Return a number of a period as it is or, of a power, in a second, with its slope along dλ = dp."""
        if self._measure is not Measure.FRICTION_POWER:
            return value, slope
        if self._workspace.balance.parameter.kind is not Kind.FREQUENCY:
            rate = self._workspace.balance.system.omega / (2.0 * math.pi)
            return value * rate, slope * rate
        return value * p / (2.0 * math.pi), (slope * p + value * dp) / (2.0 * math.pi)

    def _node(self, solution: Real, tangent: Real) -> _Node:
        """Measure the contact where the workspace was evaluated last."""
        balance, point, dp = self._workspace.balance, self._point, float(tangent[-1])
        table, load, dtable, dload = self._fixed or contact_values(balance.system, float(solution[-1]), 0.0)
        cycle = ContactCycle(
            balance=balance, U=solution[:-1].reshape(point.F.shape), F=point.F, dF_dU=point.dF_dU,
            table=table, load=load,
        )  # fmt: skip
        along = Change(
            dU=tangent[:-1].reshape(point.F.shape), dF=dp * point.dF_dp, row=dp * dtable, load=dp * dload
        )
        found = _MEASURES[self._measure](cycle, self._e, [along])
        if found is None:
            name = balance.scene.contacts[self._e].name
            raise SettingError("contact", name, f"must be one whose law has a {self._measure.value}")
        value, slope = self._sign * found[0], self._sign * float(found[1][0])
        value, slope = self._rated(value, slope, float(solution[-1]), dp)
        if not math.isfinite(value):
            value, slope = -math.inf, 0.0
        return _Node(solution, tangent, value, slope)


def worst_slopes(
    sensitivity: WearSensitivity, worst: WorstWear, contact: str, measure: Measure = Measure.FRICTION_WORK
) -> Measured:
    """Return a local worst value of a frequency response with its derivatives by parameters.

    Parameters
    ----------
    sensitivity : of the balance of the response, `Branch.balance`, and the paths.
    worst : one of `solver.worst_wear` for the same contact and measure.

    Raises
    ------
    SettingError
        An unknown contact, or a law the measure has no meaning for.
    """
    here = _measured(sensitivity, worst.at, worst.solution, contact, measure)
    if not worst.interior or not abs(here.by_frequency) * worst.at > SMOOTH * abs(here.value):
        return here

    def slopes(u: Real, at_hz: float) -> tuple[float, Real]:
        found = _measured(sensitivity, at_hz, u, contact, measure)
        return found.by_frequency, found.gradient

    sign = -1.0 if measure is Measure.LEAST_LOAD else 1.0
    corner = corner_slopes(sensitivity.balance, worst.at, worst.solution, slopes, sign)
    # Where nothing is found beside it, the derivative at the fixed frequency stands in.
    return here if corner is None else replace(here, gradient=corner[0])


def worst_hessian(sensitivities: Sensitivities, worst: WorstWear, contact: str, measure: Measure) -> Real:
    """Return the second derivatives of a local worst friction work or power by parameters, (n, n).

    NaN where it is a corner.

    Raises
    ------
    SettingError
        An unknown contact, or laws or paths without exact second derivatives.
    """
    balance = sensitivities.balance
    e, ks = contact_index(balance.scene, contact), balance.system.ks
    pairing = np.zeros((balance.n_ports, balance.n_coefficients, balance.n_coefficients))
    for a in balance.scene.contacts[e].RUBBING:
        pairing[int(balance.system.first_port[e]) + a] = work_pairing(ks, balance.n_coefficients)
    found = sensitivities.of_contacts(worst.solution, worst.at, pairing)
    if measure is Measure.FRICTION_POWER:
        found = found.times_frequency(worst.at)
    return found.of_peak().hessian if worst.interior else found.hessian


def _measured(
    sensitivity: WearSensitivity, at_hz: float, solution: Real, contact: str, measure: Measure
) -> Measured:  # fmt: skip
    point = sensitivity.at(at_hz, solution)
    found = {
        Measure.FRICTION_WORK: point.work,
        Measure.FRICTION_POWER: point.work,
        Measure.LEAST_LOAD: point.least_load,
        Measure.SLIP_TRAVEL: point.travel,
    }[measure](contact)
    if found is None:
        raise SettingError("contact", contact, f"must be one whose law has a {measure.value}")
    if measure is not Measure.FRICTION_POWER:
        return found
    rise = at_hz * found.by_frequency + found.value
    return Measured(value=at_hz * found.value, by_frequency=rise, gradient=at_hz * found.gradient)
