"""Wear of the contacts at a periodic response: friction work, least load and slip travel, with derivatives.

Every derivative goes through the whole solve, du/dp = −(∂r/∂u)⁻¹ ∂r/∂p. The Jacobian is factorised once, and
one substitution a parameter serves all measures of all contacts.

Each measure comes with its slopes along any changes of the solution and of λ, exactly:

- friction work W = ∮ f du = π Σ_k F_k · (dU/dτ)_k, bilinear in force and motion. The motion has the harmonics
  kept only, so this is the work of the whole force of the law, not of its first harmonics.
- least normal load: N0 − |N1| of a given load of one harmonic; of any other, and of one that gains kn v, its
  minimum over the period, whose place is stationary (envelope theorem).
- slip travel: with w_ξ = ξ kt u − μ N the slider moves by dw_ξ/kt while the contact slips towards ξ, so every
  slip adds the difference of w_ξ at its ends. It begins where w_ξ = −ξ c, with the offset c of the stick
  before, fixed at that stick's onset, and ends where dw_ξ/dτ = 0: these instants drop out of the
  derivative. Where N = 0 begins or ends it, or begins the stick before it, dτ = −dN/(dN/dτ) does not.

Design derivation of the last from the law of `solver.contacts.kernels.stick_slip_events`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, NamedTuple, cast

import numpy as np

from solver.balance.balance import Balance, Kind, build, contact_index, for_parameter
from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.residual import contact_values, evaluate
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.contacts.kernels.columns import KT, MU, OMEGA
from solver.contacts.kernels.stick_slip_events import AFTER_SLIP, LIFTING, SLIP, UNLOADED, largest
from solver.contacts.kernels.system import Evaluation, System, by_reference, evaluation_by_value
from solver.contacts.laws.contact_parts import Slider
from solver.contacts.pieces.line import Segments, Shares, line_left, segments_of
from solver.errors import SettingError
from solver.jit import fourier
from solver.jit.fourier import Integer, Real
from solver.jit.trig_polynomial import grid_size, grid_tables, on_grid
from solver.linear.kernels.receptance import receptance
from solver.response.solution import Solution, check_converged
from solver.results.told import Piece
from solver.scene.scene_harmonics import even_harmonics_reason

_ROUNDING = 1e-13  # of the terms of a sum that cancel


class Change(NamedTuple):
    """A change of a solution and of λ, to the first order: what a slope is taken along."""

    dU: Real  # (n_ports, n) motions
    dF: Real  # (n_ports, n) forces, the share of λ at fixed motions
    row: Real  # (n_contacts, ·) contact table
    load: Real  # (n_contacts, 1 + 2 K) coefficients of the given normal load


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactCycle:
    """All contacts over one period at a solution; copies, so that the workspace may go on."""

    balance: Annotated[Balance, "What was solved."]
    U: Annotated[Real, "Coefficients of motions [m], (n_ports, n)."]
    F: Annotated[Real, "Coefficients of forces [N], (n_ports, n)."]
    dF_dU: Annotated[Real, "As in `solver.contacts.kernels.system.Evaluation`, (blocks, n, n)."]
    table: Annotated[Real, "Parameters of the contacts at this λ, (n_contacts, ·)."]
    load: Annotated[Real, "Coefficients of the given normal loads [N], (n_contacts, 1 + 2 K)."]

    @classmethod
    def of(cls, balance: Balance, u: Real, p: float, point: Evaluation) -> ContactCycle:
        """Return the cycle at (u, λ = `p`, inside unit), where `point` was evaluated last."""
        table, load, _, _ = contact_values(balance.system, p, 0.0)
        U = u.reshape(balance.n_ports, balance.n_coefficients).copy()
        return cls(balance=balance, U=U, F=point.F.copy(), dF_dU=point.dF_dU.copy(), table=table, load=load)

    @property
    def top(self) -> int:
        """Highest harmonic of the full coefficients below, those of the given loads among them."""
        return max(self.balance.highest_harmonic, int(self.balance.system.load_ks[-1]))

    def ports(self, e: int) -> range:
        """Return the relative motions of contact `e`."""
        first = self.balance.system.first_port
        return range(int(first[e]), int(first[e + 1]))

    def full(self, coefficients: Real) -> Real:
        """Return coefficients (..., n) of the harmonics kept, spread over all up to `top`."""
        return fourier.to_full(coefficients, self.balance.system.ks, self.top)

    def normal_load(self, e: int) -> Real:
        """Return the coefficients (2 top + 1,) of the normal load of contact `e`, not cut at 0 [N]."""
        N = np.zeros(2 * self.top + 1)
        N[: self.load.shape[1]] = self.load[e]
        normal = self.balance.system.normal_port[e]
        if normal >= 0:
            N += self.table[e, self._stiffness(normal)] * self.full(self.U[normal])
        return N

    def load_change(self, e: int, change: Change) -> Real:
        """Return the change of `normal_load`."""
        dN = np.zeros(2 * self.top + 1)
        dN[: self.load.shape[1]] = change.load[e]
        normal = self.balance.system.normal_port[e]
        if normal >= 0:
            dN += change.row[e, self._stiffness(normal)] * self.full(self.U[normal])
            dN += self.table[e, self._stiffness(normal)] * self.full(change.dU[normal])
        return dN

    def _stiffness(self, port: int) -> int:
        """Return the column of a port's stiffness."""
        return int(self.balance.system.held[port, 0])

    def has_friction(self, e: int) -> bool:
        """Return whether contact `e` has a normal load and rubs."""
        return self.balance.scene.contacts[e].friction is not None

    def segments(self, e: int) -> Segments:
        """Return what contact `e`, whose slider moves on a line, does over the period."""
        return segments_of(self.slider(e), self.full(self.U[self.ports(e)[0]]), self.normal_load(e))

    def slider(self, e: int) -> Slider:
        """Return the slider of contact `e`, which rubs, at this λ."""
        return cast(Slider, self.balance.scene.contacts[e].with_numbers(self.table[e]).friction)


def friction_work(cycle: ContactCycle, e: int, changes: Sequence[Change]) -> tuple[float, Real]:
    """Return the work that friction takes out at contact `e` in one period [J], and its slopes.

    Of a rubbing contact it is that of the tangential force: the normal one moves nothing across the surface.
    A stuck contact does none: what is left of terms that cancel is not work, nor a slope of it.
    """
    work, slopes, ports = 0.0, np.zeros(len(changes)), cycle.ports(e)
    pairing = work_pairing(cycle.balance.system.ks, cycle.U.shape[1])
    for a in cycle.balance.scene.contacts[e].RUBBING:
        F, speed = cycle.F[ports[a]], pairing @ cycle.U[ports[a]]
        if abs(F @ speed) <= _ROUNDING * np.sum(np.abs(F * speed)):
            continue
        work += float(F @ speed)
        first = int(cycle.balance.system.first_block[e]) + a * len(ports)
        for i, change in enumerate(changes):
            dU = change.dU[ports.start : ports.stop]
            dF = change.dF[ports[a]] + np.einsum("bij,bj->i", cycle.dF_dU[first : first + len(ports)], dU)
            slopes[i] += dF @ speed + F @ (pairing @ dU[a])
    return work, slopes


def work_pairing(ks: Integer, n: int) -> Real:
    """Return the matrix P (n, n) of the work F·(P U) in a period, of the ascending harmonics `ks`."""
    pairing, orders = np.zeros((n, n)), math.pi * ks[ks > 0]
    cosines = np.arange(n - 2 * orders.size, n, 2)
    pairing[cosines, cosines + 1], pairing[cosines + 1, cosines] = orders, -orders
    return pairing


def least_load(cycle: ContactCycle, e: int, changes: Sequence[Change]) -> tuple[float, Real] | None:
    """Return the least normal load of contact `e` over the period [N], and its slopes.

    Below 0 the contact separates: the number is what the load would be if it could pull. None of a law
    without friction. A load that does not vary has a corner there: its slope is that of any variation's rise.
    """
    if not cycle.has_friction(e):
        return None
    N, dN = cycle.normal_load(e), [cycle.load_change(e, change) for change in changes]
    if not np.any(N[3:]) and not any(np.any(each[3:]) for each in dN):
        swing = math.hypot(N[1], N[2])
        rises = [(N[1:3] @ d[1:3]) / swing if swing > 0.0 else math.hypot(d[1], d[2]) for d in dN]
        slopes = [float(d[0] - rise) for d, rise in zip(dN, rises, strict=True)]
        return float(N[0] - swing), np.array(slopes)
    if not np.all(np.isfinite(N)):
        return math.nan, np.full(len(changes), math.nan)
    at = fourier.basis(np.array([lowest(N)]), cycle.top)[0]
    return float(at @ N), np.array([float(at @ each) for each in dN])


def slip_travel(cycle: ContactCycle, e: int, changes: Sequence[Change]) -> tuple[float, Real] | None:
    """Return the distance that contact `e` rubs in one period [m], and its slopes.

    None of a law whose slider does not move on a line.
    """
    if not cycle.balance.scene.contacts[e].slides_on_a_line:
        return None
    slider, port = cycle.slider(e), cycle.ports(e)[0]
    kt = slider.kt
    U, N = cycle.full(cycle.U[port]), cycle.normal_load(e)
    ends = _slip_ends(cycle.segments(e))
    e_tau = fourier.basis(ends.tau, cycle.top)
    xi, sign = ends.direction, ends.sign
    u, load = e_tau @ U, e_tau @ N
    travel = float((sign * xi) @ line_left(xi, kt, u, slider.limit(load)))
    du_dtau, dN_dtau = e_tau @ fourier.derivative(U), e_tau @ fourier.derivative(N)
    moving = ends.moves & (dN_dtau != 0.0)
    slopes = np.zeros(len(changes))
    for j, change in enumerate(changes):
        du = e_tau @ cycle.full(change.dU[port])
        dload = e_tau @ cycle.load_change(e, change)
        dtau = np.where(moving, -dload / np.where(moving, dN_dtau, 1.0), 0.0)
        dkt, dlimit = change.row[e, KT], change.row[e, MU] * load + slider.limit(dload + dN_dtau * dtau)
        dw = xi * (dkt * u + kt * (du + du_dtau * dtau)) - dlimit
        slopes[j] = (float(sign @ dw) - travel * dkt) / kt
    return travel, slopes


class _Ends(NamedTuple):
    """Terms ± w_ξ(τ) whose sum is kt times the distance rubbed, (count,) each."""

    sign: Real
    direction: Real
    tau: Real
    moves: np.ndarray  # bool: an instant of N = 0


def _slip_ends(found: Segments) -> _Ends:
    """Return where the slips of a period begin and end, as terms of the travel."""
    rows, lifting = found.rows, found.state == LIFTING
    terms: list[tuple[float, float, float, bool]] = []
    for i, row in enumerate(rows):
        if row.motion != SLIP:
            continue
        xi = float(row.direction)
        followed = i + 1 < len(rows) and rows[i + 1].begin == row.end
        terms.append((1.0, xi, float(row.end), lifting and not followed))
        follows = i > 0 and rows[i - 1].end == row.begin
        before = rows[i - 1]
        if not follows or before.motion == SLIP:
            terms.append((-1.0, xi, float(row.begin), lifting and not follows))
        elif before.began == AFTER_SLIP:
            d = float(before.direction)
            terms.append((-xi * d, d, float(before.onset), False))
        elif before.began != UNLOADED:
            terms.append((-1.0, xi, float(before.onset), True))
    table = np.array(terms, dtype=np.float64).reshape(-1, 4)
    return _Ends(sign=table[:, 0], direction=table[:, 1], tau=table[:, 2], moves=table[:, 3] > 0.0)


def lowest(N: Real) -> float:
    """Return where a load with coefficients `N` is least [rad]."""
    top = (N.size - 1) // 2
    c, s = np.zeros(top + 1), np.zeros(top + 1)
    c[0], c[1:], s[1:] = -N[0], -N[1::2], -N[2::2]
    n = grid_size(top)
    value, slope = np.zeros(n), np.zeros(n)
    on_grid(c, s, top, *grid_tables(n, top), value, slope)
    return float(largest(c, s, top, value, slope)[1])


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
