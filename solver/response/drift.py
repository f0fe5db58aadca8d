"""How far a part that ratchets drifts in a period: a periodic motion and a constant velocity besides.

What contacts alone hold moves as x(t) + D t/T, x periodic. Contacts along which D has no part answer as ever;
friction along it is followed in time, in samples of a period, until it repeats: elastic springs with a limit
of a line, a box or a circle under a load that is given or moves. The unknowns are the harmonics and D, whose
equation is that of the mean forces; dashpots pull at the constant velocity. Newton's method starts at the
motion that a constant force would leave, with which the part was told to ratchet.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from solver.balance.balance import Balance, Kind, build
from solver.balance.kernels.residual import contact_values
from solver.balance.workspace import ALONG, PointSolution, Workspace
from solver.contacts.kernels.columns import PRESTRESSED
from solver.contacts.kernels.system import UNHELD
from solver.contacts.laws.contact_parts import Slider
from solver.jit import fourier
from solver.jit.fourier import Integer, Real
from solver.jit.separate import apart
from solver.scene.scene_harmonics import Amplitudes

if TYPE_CHECKING:
    from solver.continuation.branch import Branch
    from solver.response.solution import Solution

SAMPLES = 1024  # of a period
MOST_UNKNOWNS = 800  # beyond which it costs more than a march
_REPEATS = 1e-12  # of the largest limit: change over a period
_PERIODS = 20_000  # after which friction that does not repeat is given up
_SHARES = (1.0, 0.3, 3.0)  # of the first drift, to begin with one after the other
_LEAST, _LARGEST, _TRIALS = 1e-4, 1e2, 16  # drifts in a period that are looked at, relative to the vibration
_MOST, _HALVINGS = 25, 6
_SOLVED, _STEP = 1e-7, 1e-6  # relative residual aimed at; step of a difference
_DRAG = 1e-9  # share of what cancels in the drag of dashpots, below which it is rounding


def of_solution(solution: Solution) -> float:
    """Return the drift per period of a solution that ratchets [m], see `drift_per_period`."""
    workspace = Workspace.of(build(solution.scene, harmonics=solution.n_harmonics))
    return drift_per_period(workspace, 2.0 * math.pi * solution.frequency_hz)


def of_branch(branch: Branch) -> float:
    """Return the drift per period where a branch ended as ratcheting [m], a little beyond its last point."""
    from solver.continuation.stretches import AHEAD

    balance = branch.balance
    inside = balance.parameter.inside
    start, stop = float(inside(branch.start)), float(inside(branch.stop))
    last = float(branch.solutions[-1, -1]) if len(branch.values) else start
    for share in (0.0, *AHEAD):
        p = last + share * (stop - start)
        if (p - stop) * (stop - start) <= 0.0:
            found = drift_per_period(Workspace.of(balance), p)
            if not math.isnan(found):
                return found
    return math.nan


def drift_per_period(workspace: Workspace, p: float) -> float:
    """Return the largest displacement of a DOF in a period of the motion that drifts [m].

    Infinite where a mean load above friction speeds the part up without end, since no dashpot holds it; NaN
    where the part does not ratchet, or its contacts are of other laws than friction with a limit.
    """
    found = workspace.solve(p)
    balance = workspace.balance
    if not found.ratchets or balance.n_unknowns > MOST_UNKNOWNS:
        return math.nan
    drifting = _Drifting.of(workspace, p, found)
    if drifting is None:
        return math.nan
    if found.above_friction and not drifting.dragged:
        return math.inf
    first = drifting.first(above=found.above_friction)
    for share in _SHARES:
        solved = drifting.solved(share * first)
        if solved is not None:
            return float(np.abs(drifting.shapes @ solved).max(initial=0.0))
    return math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class _Drifting:
    """The balance of a motion that drifts.

    g directions of drift, D = a · `ways` at the ports, m coefficients in all.
    """

    workspace: Workspace
    p: float
    start: Annotated[Real, "(m,) the motion held by a constant force."]
    ways: Annotated[Real, "(g, nc) motions of the ports that nothing holds."]
    shapes: Annotated[Real, "(n_dofs, g) the same of the DOFs."]
    pulled: Annotated[Real, "(g, nc) what dashpots add to the mean motions for a unit of drift in a period."]
    damped: Annotated[Real, "(g, g) the mean forces of dashpots along the ways for it."]
    dragged: Annotated[bool, "Whether dashpots hold every way."]
    A: Annotated[Real, "(m, m) motions for forces."]
    free: Annotated[Real, "(m,) motions without contacts."]
    sliders: Annotated[
        tuple[tuple[int, Slider, Real, float], ...],
        "The contacts along which it drifts: number, friction, load, and what of it is there at rest.",
    ]

    @classmethod
    def of(cls, workspace: Workspace, p: float, found: PointSolution) -> _Drifting | None:
        """Return the balance for what ratchets; None where it is not known how it drifts."""
        holding = workspace.holding()
        held = holding.solve(p) if found.above_friction else found
        balance, system = workspace.balance, workspace.balance.system
        _, point = holding.forces(held.u, p)
        ways = point.gauge[: int(point.counts[UNHELD])].copy()
        if not len(ways) and len(system.loose) == 1:
            ways = system.loose
        moving = np.abs(ways) > ALONG * np.abs(ways).max(initial=0.0)
        table, loads, _, _ = contact_values(workspace.system, p, 0.0)
        sliders = []
        for e, contact in enumerate(balance.scene.contacts):
            contact = contact.with_numbers(table[e])
            first, slider = int(system.first_port[e]), contact.friction
            ports = np.flatnonzero(moving[:, first : int(system.first_port[e + 1])].any(axis=0))
            if not ports.size:
                continue
            if slider is None or not set(ports.tolist()) <= set(slider.ports):
                return None
            pressed = contact.normal_port is not None and table[e, PRESTRESSED] > 0.0
            rest = max(float(loads[e, 0]), 0.0) if pressed else 0.0
            sliders.append((e, slider, loads[e].copy(), rest))
        if not sliders:
            return None
        omega = p if balance.parameter.kind is Kind.FREQUENCY else system.omega
        shapes, pulled, damped, most = _dashpots(balance, ways, omega)
        linear = workspace.receptance(p)
        # As a matrix (nc·n, nc·n) of coefficients.
        A = linear.A[0]
        nc, n = A.shape[1], int(fourier.coefficient_count(system.ks))
        real = np.zeros((nc, n, nc, n))
        for i, k in enumerate(system.ks):
            here = int(fourier.cosine_position(system.ks, i))
            real[:, here, :, here] = A[i].real
            if k > 0:
                real[:, here + 1, :, here + 1] = A[i].real
                real[:, here, :, here + 1] = A[i].imag
                real[:, here + 1, :, here] = -A[i].imag
        return cls(
            workspace=workspace, p=p, start=held.u.copy(), ways=ways, shapes=shapes, pulled=pulled,
            damped=damped, dragged=bool(np.all(np.diag(damped) > _DRAG * most)),
            A=real.reshape(nc * n, nc * n), sliders=tuple(sliders),
            free=Amplitudes(balance.system.ks).coefficients(linear.u_linear[0].T).reshape(-1),
        )  # fmt: skip

    def first(self, *, above: bool) -> Real:
        """Return a drift (g,) to begin with, the way the force drives.

        It is what leaves the least of the force while the vibration stays that held by a constant force; or
        (`above` friction) what dashpots alone would hold.
        """
        force = self._left(np.zeros(len(self.ways)))
        if above:
            return np.asarray(np.linalg.solve(self.damped, force))
        ports = self.start.reshape(self.workspace.balance.n_ports, -1)
        size = float(np.abs(ports[:, 1:]).max(initial=0.0))
        unit = size * force / max(float(np.abs(force @ self.ways).max()), 1e-300)
        low, high = _LEAST, _LARGEST
        for _ in range(_TRIALS):
            middle = math.sqrt(low * high)
            low, high = (middle, high) if self._left(middle * unit) @ force > 0.0 else (low, middle)
        return np.asarray(math.sqrt(low * high) * unit)

    def _left(self, drift: Real) -> Real:
        """Return the mean force (g,) that drives the held motion on beside a drift [N]."""
        balance = self.workspace.balance
        means = self._residual(self.start, drift, slopes=False)[0][:: balance.n_coefficients]
        return np.asarray(-self.ways @ (balance.system.shift * means))

    def solved(self, drift: Real) -> Real | None:
        """Return the drift in a period by each way (g,), by Newton's method from there; None: not found."""
        u = self.start.copy()
        for _ in range(_MOST):
            residual, u_slope, drift_slope = self._residual(u, drift)
            norm = self._norm(residual)
            if norm <= _SOLVED:
                return drift
            step = self._step(residual, u_slope, drift_slope)
            if step is None:
                return None
            share = 1.0
            for _ in range(_HALVINGS):
                there = u - share * step[: u.size], drift - share * step[u.size :]
                if self._norm(self._residual(*there, slopes=False)[0]) < (1.0 - 0.1 * share) * norm:
                    break
                share *= 0.5
            u, drift = there
        return None

    def _step(self, residual: Real, u_slope: Real, drift_slope: Real) -> Real | None:
        """Return a step of (u, drift) that leaves where a part stands, which nothing asks for."""
        n, g, system = self.workspace.balance.n_coefficients, len(self.ways), self.workspace.balance.system
        place = np.zeros((g, residual.size))
        place[:, ::n] = self.ways * system.shift
        matrix = np.block([[u_slope, drift_slope], [place, np.zeros((g, g))]])
        try:
            step = np.linalg.solve(matrix, np.append(residual, np.zeros(g)))
        except np.linalg.LinAlgError:
            return None
        return step if np.all(np.isfinite(step)) else None

    def _norm(self, residual: Real) -> float:
        """Return a residual relative to the forces of the contacts on their stiffnesses."""
        shift, ports = self.workspace.balance.system.shift[:, None], self.workspace.balance.n_ports
        left, acts = (float((shift * np.abs(x.reshape(ports, -1))).max()) for x in (residual, self.free))
        return left / max(acts, 1e-300)

    def _residual(self, u: Real, drift: Real, *, slopes: bool = True) -> tuple[Real, Real, Real]:
        """Return the residual (m,) at a motion and drift with its slopes (m, m) by u and (m, g) by drift."""
        balance = self.workspace.balance
        system, n = balance.system, balance.n_coefficients
        _, point = self.workspace.forces(u, self.p)
        forces, by_u = point.F.reshape(-1).copy(), np.zeros((u.size, u.size))
        by_drift = np.zeros((u.size, len(drift)))
        for e in range(len(balance.scene.contacts)):
            first, ports = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
            rows = slice(first * n, (first + ports) * n)
            blocks = point.dF_dU[system.first_block[e] :][: ports * ports].reshape(ports, ports, n, n)
            by_u[rows, rows] = blocks.transpose(0, 2, 1, 3).reshape(ports * n, ports * n)
        for e, slider, load, rest in self.sliders:
            first, end = int(system.first_port[e]), int(system.first_port[e + 1])
            rows, ways = slice(first * n, end * n), self.ways[:, first:end]
            forces[rows], by_u[rows, rows], by_port = _followed(
                u[rows].reshape(end - first, n), drift @ ways, system.ks, slider, load, rest, slopes=slopes
            )
            by_drift[rows] = by_port @ ways.T
        stiffness = np.repeat(system.shift, n)
        pulled = np.zeros((len(drift), u.size))
        pulled[:, ::n] = self.pulled
        residual = u - self.free - drift @ pulled + self.A @ (forces - stiffness * u)
        slope = np.eye(u.size) + self.A @ (by_u - np.diag(stiffness))
        return residual, slope, self.A @ by_drift - pulled.T


def _dashpots(balance: Balance, ways: Real, omega: float) -> tuple[Real, Real, Real, Real]:
    """Return `shapes`, `pulled` and `damped` of `_Drifting` for motions of the ports (g, nc).

    The last numbers (g,) are what would drag if nothing cancelled.
    """
    from solver.response.time_history import matrices

    model = balance.model
    whole, _, ports = matrices(model, 0)
    C = model.plain(np.zeros(1, np.int64))[1][0]
    free = model.free
    K, C, L = (
        np.ascontiguousarray(each.real)
        for each in (whole[np.ix_(free, free)], C[np.ix_(free, free)], ports[:, free])
    )
    kt = model.port_stiffnesses
    held = K + L.T @ (kt[:, None] * L)
    moved = np.linalg.solve(held, L.T @ (kt * ways).T)
    slow = C @ moved * (omega / (2.0 * math.pi))
    shapes = np.asarray(model.shapes[:, free].real @ moved)
    most = np.einsum("ig,ij,jg->g", np.abs(moved), np.abs(C) + np.abs(C).max() * _DRAG, np.abs(moved))
    return shapes, -(L @ np.linalg.solve(held, slow)).T, moved.T @ slow, most


def _followed(
    motions: Real, drift: Real, ks: Integer, slider: Slider, load: Real, rest: float, *, slopes: bool
) -> tuple[Real, Real, Real]:
    """Return the forces of a contact that drifts, and their slopes by its motions and by the drift.

    Parameters
    ----------
    motions : (ports, n) coefficients [m]; drift : (ports,) in a period [m].
    load : coefficients of the normal load, of which `rest` is in equilibrium at rest [N].
    slopes : whether these are found, else they are 0.

    Returns
    -------
    (ports·n,) coefficients [N], (ports·n, ports·n) and (ports·n, ports) [N/m], by differences: the forces are
    smooth but where an event passes a sample.
    """
    ports, n = motions.shape
    size = max(float(np.abs(motions[:, int(ks[0] == 0) :]).max()), float(np.abs(drift).max()), 1e-300)
    many = 1 + ports * n + ports if slopes else 1
    every, ways = np.repeat(motions[None], many, axis=0), np.repeat(drift[None], many, axis=0)
    if slopes:
        every.reshape(many, -1)[1 + np.arange(ports * n), np.arange(ports * n)] += _STEP * size
        ways[1 + ports * n + np.arange(ports), np.arange(ports)] += _STEP * size
    basis = _instants(ks.tobytes())
    x = every @ basis.T
    normal = _instants(np.arange((load.size - 1) // 2 + 1).tobytes()) @ load
    pressed = np.repeat(normal[None], many, axis=0)
    if slider.normal_port is not None:
        pressed = pressed + slider.normal_stiffness * x[:, slider.normal_port]
    pressed = np.maximum(pressed, 0.0)
    along = list(slider.ports)
    stiff = np.array(slider.stiffnesses)[:, None]
    travel = np.diff(x[:, along], prepend=x[:, along, -1:], axis=2) + ways[:, along, None] / SAMPLES
    force, friction = np.zeros((many, ports, SAMPLES)), np.zeros((many, len(along), SAMPLES))
    slide(np.ascontiguousarray(stiff * travel), slider.limit(pressed), not slider.limits_apart, friction)
    force[:, along] = friction
    if slider.normal_port is not None:
        force[:, slider.normal_port] = pressed - rest
    weights = basis.T * (2.0 / SAMPLES)
    weights[: int(ks[0] == 0)] *= 0.5
    found = (force @ weights.T).reshape(many, -1)
    if not slopes:
        return found[0], np.zeros((ports * n, ports * n)), np.zeros((ports * n, ports))
    changes = ((found[1:] - found[0]) / (_STEP * size)).T
    return found[0], changes[:, : ports * n], changes[:, ports * n :]


@functools.lru_cache(maxsize=8)
def _instants(ks: bytes) -> Real:
    """Return what the coefficients of these harmonics are multiplied by at each sample, (samples, n)."""
    orders = np.frombuffer(ks, np.int64)
    tau = np.asarray(2.0 * math.pi / SAMPLES * np.arange(SAMPLES), np.float64)
    return fourier.from_full(fourier.basis(tau, int(orders[-1])), orders)


@apart
def slide(pulls: Real, limits: Real, one_limit: bool, out: Real) -> None:
    """Follow friction of springs with a limit from sample to sample until it repeats.

    Fill `out` (many, directions, samples) with the forces [N] of the last period.

    Parameters
    ----------
    pulls : (many, directions, samples) by how much the springs' forces grow to each sample [N].
    limits : (many, samples) [N].
    one_limit : for the whole force, a circle, in place of one for each direction.
    """
    many, directions, samples = pulls.shape
    for i in range(many):
        largest = 0.0
        for j in range(samples):
            largest = max(largest, limits[i, j])
        for _ in range(_PERIODS):
            change, last = 0.0, out[i, :, samples - 1].copy()
            for j in range(samples):
                carried = 0.0
                for d in range(directions):
                    before = out[i, d, j - 1] if j > 0 else last[d]
                    out[i, d, j] = before + pulls[i, d, j]
                    carried = math.hypot(carried, out[i, d, j])
                    if not one_limit:
                        out[i, d, j] = min(max(out[i, d, j], -limits[i, j]), limits[i, j])
                if one_limit and carried > limits[i, j]:
                    for d in range(directions):
                        out[i, d, j] *= limits[i, j] / carried
            for d in range(directions):
                change = max(change, abs(out[i, d, samples - 1] - last[d]))
            if change <= _REPEATS * largest:
                break
