"""The worst a contact goes through over a response: every local maximum of a measure along a branch.

At a maximum inside the range the slope along the branch is 0, and at an end the frequency does not move
either, so the derivative of the worst value by a parameter is the one at that fixed frequency (envelope
theorem). A maximum may also be a corner of the response, closed in by bracketing, where two smooth pieces m⁻
and m⁺ meet at ω_k(p); as for peaks of the amplitude (`solver.sensitivity.nonsmooth`) the derivative is
m⁻_p + m⁻_ω dω_k/dp with dω_k/dp = −(m⁺_p − m⁻_p)/(m⁺_ω − m⁻_ω), from solutions beside the corner at two
distances, extrapolated to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from typing import Annotated

import numpy as np

from solver.balance.balance import Kind, contact_index
from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, PIECE
from solver.balance.kernels.residual import contact_values, evaluate_contacts, friction_works
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import evaluation_by_value
from solver.continuation.bracketing import closing_in
from solver.continuation.branch import Branch, Points
from solver.continuation.extrema.kernels.node_table import NOWHERE, ROWS, Look, halve, look_between
from solver.continuation.extrema.kernels.peak_search import MOST_HALVINGS, NEAR_THE_TOP, PREDICTED, SURE
from solver.continuation.extrema.nodes import NodeSolver
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.response.wear import (
    Change,
    ContactCycle,
    Measured,
    WearSensitivity,
    least_load,
    slip_travel,
    work_pairing,
)
from solver.results.told import Piece
from solver.sensitivity.gradient import TWO_PI, Sensitivities
from solver.sensitivity.nonsmooth import SMOOTH, corner_slopes

# Maxima below this share of the highest cannot lead within one step of an optimiser.
COMPETES = 0.6
_HALVINGS_BELOW = 2  # of an interval whose maximum could compete, but not lead
_FLAT = 1e-11  # slope over the whole interval, relative to the value, at which a maximum is found
_NARROW = 1e-12  # share of the interval at which a corner is found
_ROUNDED = 1e-13  # share of the size below which the nearer of two points to the root is the higher


class Measure(Enum):
    """What a contact goes through in a period; the value is what a user reads."""

    FRICTION_WORK = "friction work"
    FRICTION_POWER = "friction power"
    LEAST_LOAD = "least normal load"
    SLIP_TRAVEL = "slip travel"


_BY_CYCLE = {Measure.LEAST_LOAD: least_load, Measure.SLIP_TRAVEL: slip_travel}


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


class _MaximaSearch:
    """Looks for the maxima of one measure of one contact along a branch, on a table of its points."""

    def __init__(self, branch: Branch, e: int, measure: Measure) -> None:
        unseen = np.zeros((len(branch.solutions), branch.balance.n_coefficients))
        self._solver = NodeSolver(Workspace.of(branch.balance), Points.of(branch, observed=unseen))
        self._solver.begin()
        self._e, self._measure = e, measure
        self._works = measure in (Measure.FRICTION_WORK, Measure.FRICTION_POWER)
        self._sign = -1.0 if measure is Measure.LEAST_LOAD else 1.0
        self._numbers = np.zeros((0, 2))  # of each row of the table what is made largest, and its slope
        values = self._known()[self._solver.order, 0]
        self._top, self._size = float(values.max()), float(np.abs(values).max())
        # Below nothing competes: of the least load every minimum does.
        self._least = -math.inf if self._sign < 0.0 else COMPETES * self._top
        self._densify()

    def _known(self) -> Real:
        """Return the numbers of all rows, those that are new among them."""
        rows, known = self._solver.table, len(self._numbers)
        count = int(rows.counts[ROWS])
        if count > known:
            fresh = self._measured(rows.solutions[known:count], rows.tangents[known:count])
            self._numbers = np.concatenate([self._numbers, fresh])
        return self._numbers

    def _look(self) -> tuple[Look, Real]:
        """Return what may stand between neighbouring points, and how high by the slopes."""
        rows, known = self._solver.table, self._known()
        seen = np.zeros((len(known), rows.measures.shape[1]))
        seen[:, HIGH] = seen[:, LOW] = known[:, 0]
        seen[:, HIGH_SLOPE] = seen[:, LOW_SLOPE] = known[:, 1]
        seen[:, PIECE] = rows.measures[: len(known), PIECE]
        partners, scales = np.full(len(known), NOWHERE), np.empty((len(known), 2))
        look = look_between(
            rows.solutions, rows.tangents, seen, partners, scales, self._solver.order, self._solver.least,
            -math.inf,
        )  # fmt: skip
        ends = np.maximum(look.measures[:-1, HIGH], look.measures[1:, HIGH])
        rise, fall = look.slopes[:, 0, 0], look.slopes[:, 1, 0]
        return look, ends + 0.25 * (np.maximum(rise, 0.0) + np.maximum(-fall, 0.0))

    def _densify(self) -> None:
        """Halve intervals until cubics predict the measure: finely near the top, coarsely elsewhere."""
        if self._solver.order.size < 2:
            return
        look, reach = self._look()
        same = look.measures[:-1, PIECE] == look.measures[1:, PIECE]
        off = np.where(same & (look.error <= SURE * PREDICTED * self._size), 0.0, math.inf)
        off[np.all(look.slopes[:, :, 0] == 0.0, axis=1)] = 0.0  # a given load does not change
        for depth in range(MOST_HALVINGS):
            near = reach >= self._top - (1.0 - NEAR_THE_TOP) * self._size
            competes = (reach >= self._top - (1.0 - COMPETES) * self._size) & (depth < _HALVINGS_BELOW)
            wanted = (off > PREDICTED * self._size) & (near | competes)
            if not wanted.any():
                break
            before = len(self._numbers)
            self._solver.run(halve, wanted, False)
            values, fresh = self._known()[self._solver.order, 0], self._solver.order >= before
            cubic = look.measures[:-1, HIGH] + look.measures[1:, HIGH]
            cubic = 0.5 * cubic + (look.slopes[:, 0, 0] - look.slopes[:, 1, 0]) / 8.0
            places = np.flatnonzero(fresh)
            missed = np.abs(cubic[np.cumsum(~fresh)[places] - 1] - values[places])
            off = np.zeros(fresh.size - 1)
            off[places - 1] = off[places] = missed
            look, reach = self._look()

    def maxima(self) -> list[WorstWear]:
        """Return all local maxima that may compete, highest first."""
        found, order, values = [], self._solver.order, self._known()
        if order.size == 1 or values[order[0], 1] <= 0.0:
            found.append(self._worst(order[0], interior=False))
        if order.size > 1:
            if values[order[-1], 1] >= 0.0:
                found.append(self._worst(order[-1], interior=False))
            look, reach = self._look()
            rises, falls = look.slopes[:, 0, 0] > 0.0, look.slopes[:, 1, 0] <= 0.0
            for j in np.flatnonzero(rises & falls & (reach >= self._least)).tolist():
                top = self._top_between(*order[j : j + 2].tolist(), *look.slopes[j, :, 0].tolist())
                found.append(self._worst(top, interior=True))
        return sorted(found, key=lambda one: -self._sign * one.value)

    def _top_between(self, left: int, right: int, rise: float, fall: float) -> int:
        """Return the row of the maximum between two, with the slopes by the share of the way there.

        The slope is brought to 0: it jumps over it at a corner.
        """
        best = left if self._known()[left, 0] >= self._known()[right, 0] else right
        ends = self._solver.nodes([left, right])
        at = partial(self._solver.between, ends[0], ends[1])
        for node, slope, width in closing_in(at, lambda node: self._known()[node.number, 1], rise, fall):
            lost = self._known()[best, 0] - self._known()[node.number, 0]
            best = node.number if lost <= _ROUNDED * self._size else best
            if abs(slope) <= _FLAT * self._size or width <= _NARROW:
                break
        return best

    def _worst(self, row: int, *, interior: bool) -> WorstWear:
        solution = self._solver.table.solutions[row]
        at = float(self._solver.workspace.balance.parameter.outside(float(solution[-1])))
        value = self._sign * float(self._known()[row, 0])
        return WorstWear(value=value, at=at, solution=solution[:-1].copy(), interior=interior)

    def _measured(self, solutions: Real, tangents: Real) -> Real:
        """Return the number that is made largest at points, and its slope along the tangent, (P, 2)."""
        workspace = self._solver.workspace
        balance = workspace.balance
        solutions, tangents = np.ascontiguousarray(solutions), np.ascontiguousarray(tangents)
        if self._works:
            works, slopes = np.empty((2, len(solutions)))
            rubbing = np.array(balance.scene.contacts[self._e].RUBBING, np.int64)
            friction_works(
                workspace.system, workspace.point, self._e, rubbing, solutions, tangents, works, slopes
            )
        else:
            measured = map(self._by_cycle, solutions, tangents)
            works, slopes = self._sign * np.array(list(measured)).reshape(-1, 2).T
        if self._measure is Measure.FRICTION_POWER:
            frequency = balance.parameter.kind is Kind.FREQUENCY
            omega, rise = (solutions[:, -1], tangents[:, -1]) if frequency else (balance.system.omega, 0.0)
            works, slopes = works * omega / TWO_PI, (slopes * omega + works * rise) / TWO_PI
        found = np.stack([works, slopes], axis=1)
        found[~np.isfinite(works)] = -math.inf, 0.0
        return found

    def _by_cycle(self, solution: Real, tangent: Real) -> tuple[float, float]:
        """Measure the contact at a point, by its whole cycle."""
        workspace, p, dp = self._solver.workspace, float(solution[-1]), float(tangent[-1])
        balance, point = workspace.balance, evaluation_by_value(workspace.point)
        evaluate_contacts(workspace.system, solution[:-1], p, 0.0, False, workspace.point)
        _, _, row, load = contact_values(balance.system, p, 0.0)
        along = Change(
            dU=tangent[:-1].reshape(point.F.shape), dF=dp * point.dF_dp, row=dp * row, load=dp * load
        )
        cycle = ContactCycle.of(balance, solution[:-1], p, point)
        found = _BY_CYCLE[self._measure](cycle, self._e, [along])
        if found is None:
            name = balance.scene.contacts[self._e].name
            raise SettingError("contact", name, f"must be one whose law has a {self._measure.value}")
        return found[0], float(found[1][0])


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
    others = {Measure.LEAST_LOAD: point.least_load, Measure.SLIP_TRAVEL: point.travel}
    found = others.get(measure, point.work)(contact)
    if found is None:
        raise SettingError("contact", contact, f"must be one whose law has a {measure.value}")
    if measure is not Measure.FRICTION_POWER:
        return found
    rise = at_hz * found.by_frequency + found.value
    return Measured(value=at_hz * found.value, by_frequency=rise, gradient=at_hz * found.gradient)
