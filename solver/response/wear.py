"""Wear of the contacts at a periodic response: friction work, least load and slip travel, with derivatives.

Every derivative goes through the whole solve, du/dp = −(∂r/∂u)⁻¹ ∂r/∂p. The Jacobian is factorised once, and
one substitution a parameter serves all measures of all contacts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.balance.balance import Balance, build, contact_index, for_parameter
from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.residual import contact_values, evaluate
from solver.balance.parameter import Kind
from solver.balance.simplifications import Effects, even_harmonics_reason
from solver.balance.workspace import Workspace
from solver.contacts.kernels.columns import OMEGA
from solver.contacts.kernels.system import System, by_reference, evaluation_by_value
from solver.contacts.segments import Shares
from solver.errors import SettingError
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.linear.kernels.receptance import receptance
from solver.response.solution import Solution, check_converged
from solver.response.wear_measures import (
    Change,
    ContactCycle,
    friction_work,
    least_load,
    slip_travel,
)
from solver.results.told import Piece


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Measured(Piece):
    """A number of a response with its derivatives through the whole solve; NaN where that is singular."""

    value: Annotated[float, "In its SI unit."]
    by_frequency: Annotated[float, "By the excitation frequency [unit/Hz]."]
    gradient: Annotated[Real, "By each parameter path, at a fixed frequency, (n_paths,)."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ContactWear(Piece):
    """What one contact goes through in a period."""

    name: Annotated[str, "Name of the contact."]
    work: Annotated[
        Measured, "Work that friction takes out [J], of one sector's contact if the structure is cyclic."
    ]
    least_load: Annotated[
        Measured | None,
        "Least normal load [N], below 0 if the contact separates; None of a law without friction.",
    ]
    travel: Annotated[
        Measured | None, "Distance rubbed [m]; None of a law whose slider does not move on a line."
    ]
    shares: Annotated[
        Shares | None,
        "Shares of the period in stick, slip and separation; a spring on one side sticks while it is "
        "closed. None of a law that knows no such.",
    ]


class WearPoint:
    """The measures of all contacts at one solution."""

    def __init__(self, cycle: ContactCycle, changes: Sequence[Change]) -> None:
        self._cycle = cycle
        self._changes = changes

    def work(self, contact: str) -> Measured:
        """Return the friction work of a contact in one period [J]; 0 of a law without friction."""
        return _measured(friction_work(self._cycle, self._at(contact), self._changes))

    def least_load(self, contact: str) -> Measured | None:
        """Return the least normal load of a contact over the period [N]."""
        found = least_load(self._cycle, self._at(contact), self._changes)
        return None if found is None else _measured(found)

    def travel(self, contact: str) -> Measured | None:
        """Return the distance a contact rubs in one period [m]."""
        found = slip_travel(self._cycle, self._at(contact), self._changes)
        return None if found is None else _measured(found)

    def shares(self, contact: str) -> Shares | None:
        """Return the shares of the period a contact spends in stick, slip and separation."""
        return period_shares(self._cycle, self._at(contact))

    def _at(self, contact: str) -> int:
        return contact_index(self._cycle.balance.scene, contact)


class WearSensitivity:
    """Measures of the contacts at solutions of a frequency response, with derivatives by parameter paths.

    Parameters
    ----------
    balance : of a frequency response, `Branch.balance`; with even harmonics if a path calls for them.
    paths : parameters to differentiate by.

    Raises
    ------
    SettingError
        The balance is not one of a frequency response, an unknown path, or one that needs harmonics which
        the balance leaves out.
    """

    def __init__(self, balance: Balance, paths: Sequence[str] = ()) -> None:
        if balance.parameter.kind is not Kind.FREQUENCY:
            raise SettingError("parameter", balance.parameter.path, "must be `frequency` for these measures")
        self._workspace = Workspace.of(balance)
        self._by_path = [for_parameter(balance, path, 1.0) for path in paths]

    @property
    def balance(self) -> Balance:
        """The balance of the response."""
        return self._workspace.balance

    def at(self, frequency_hz: float, u: Real) -> WearPoint:
        """Return the measures at a solution `u` (n_unknowns,) of the balance [m] at a frequency [Hz]."""
        workspace, omega = self._workspace, 2.0 * math.pi * frequency_hz
        system, linear, point = workspace.system, workspace.linear, workspace.point
        receptance(system, omega, linear)
        evaluate(system, linear, u, omega, 0.0, point)
        cycle = ContactCycle.of(workspace.balance, u, omega, evaluation_by_value(point))
        good = factorise(system, linear, point, np.empty(u.size), 0.0, 0.0) != 0.0
        changes = [self._change(workspace.balance, system, omega, good=good)]
        # What follows evaluates into the same arrays, but for the factors, which stay.
        for balance in self._by_path:
            there = replace(balance, system=balance.system._replace(omega=omega))
            moved = by_reference(there.system)
            p = balance.parameter.inside(balance.scene.value(balance.parameter.path))
            receptance(moved, p, linear)
            evaluate(moved, linear, u, p, 0.0, point)
            changes.append(self._change(there, moved, p, good=good))
        return WearPoint(cycle, changes)

    def _change(self, balance: Balance, system: System, p: float, *, good: bool) -> Change:
        """Return how the solution moves with λ, in user units, where the point was evaluated last."""
        workspace = self._workspace
        point = evaluation_by_value(workspace.point)
        per_unit = 2.0 * math.pi if balance.parameter.kind is Kind.FREQUENCY else 1.0
        du = -per_unit * point.dr_dp
        if good:
            step_back(workspace.system, workspace.point, du)
        else:
            du[:] = math.nan
        _, _, row, load = contact_values(system, p, 0.0)
        return Change(dU=du.reshape(point.F.shape), dF=per_unit * point.dF_dp, row=row, load=load)


def contact_wear(solution: Solution, paths: Sequence[str] = ()) -> dict[str, ContactWear]:
    """Return what every contact goes through in one period of a response, with derivatives.

    Parameters
    ----------
    solution : a converged response.
    paths : parameters to differentiate by, at a fixed frequency.

    Raises
    ------
    SettingError
        The solution did not converge, or an unknown path.
    """
    check_converged(solution)
    scene = solution.scene
    effects = Effects(even_harmonics=even_harmonics_reason(scene, paths) is not None)
    balance = build(scene, harmonics=solution.n_harmonics, effects=effects)
    motions = [motion for contact in solution.contacts for motion in contact.motions]
    u = np.concatenate([fourier.from_full(motion, balance.system.ks) for motion in motions] or [np.empty(0)])
    point = WearSensitivity(balance, paths).at(solution.frequency_hz, u)
    return {
        contact.name: ContactWear(
            name=contact.name, work=point.work(contact.name), least_load=point.least_load(contact.name),
            travel=point.travel(contact.name), shares=point.shares(contact.name),
        )
        for contact in scene.contacts
    }  # fmt: skip


def period_shares(cycle: ContactCycle, e: int) -> Shares | None:
    """Return the shares of the period in stick, slip and separation; None of a law that knows no such."""
    row, ports = cycle.table[e], cycle.ports(e)
    contact = cycle.balance.scene.contacts[e].with_numbers(row).at_frequency(float(row[OMEGA]))
    return contact.shares(cycle.full(cycle.U[ports.start : ports.stop]), cycle.normal_load(e))


def _measured(found: tuple[float, Real]) -> Measured:
    value, slopes = found
    return Measured(value=value, by_frequency=float(slopes[0]), gradient=slopes[1:])
