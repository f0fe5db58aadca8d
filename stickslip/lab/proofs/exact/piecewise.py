"""A scene as a piecewise linear system: what its contacts do makes it one of many autonomous linear systems.

The state in the angle τ = ωt is w = (x, dx/dτ, s, 1, cos τ, sin τ, …, cos Kτ, sin Kτ): coordinates, their
rates, the positions of elastic sliders, and the harmonics of forces and loads, so that in every mode w' = A w
and each force, load and condition is a row times w. A slider that sticks is rigid (d·x' = 0, its force the
multiplier of that constraint) or elastic (kt (d·x − s)); in slip its force is ± its limit
Λ = Σ μ_i max(N_i, 0). Rigid sliders along the same motion are one slider with the sum of their limits: how
they share its force is not determined. A rigid normal contact keeps v = 0; its load is the multiplier, and
must stay positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from solver.contacts.laws.contact_parts import Follows, NormalLoad, Row, Slider
from solver.contacts.pieces.line import FREE, STICK, line_force, line_lasts
from solver.errors import SettingError
from solver.jit.fourier import Complex, Flags, Integer, Real
from solver.linear.assembly import check_structure, linear_model
from solver.linear.condensation import force_amplitudes
from solver.scene.scene import Scene

TO_SLIP, TO_REST, TO_OPEN, TO_CLOSE, AT_GAP, LIFTS = range(6)  # what ends a piece
_PARALLEL = 1e-12
_ELASTIC = "give one a large finite kt (the error falls with its square root)"
_EVENTS = "where contacts are followed by their events (kt = inf, kn = inf, exact, certify)"


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """A friction contact as a part of a slider."""

    contact: Annotated[int, "Its number in the scene."]
    slider: Annotated[int, "That of its slider."]
    factor: Annotated[float, "Its motion is that times the slider's."]
    friction: Annotated[Slider, "Its friction."]
    given: Annotated[Real, "(nw,) row of its load without what a rigid normal contact adds."]
    normal: Annotated[
        Real | None, "(n,) row of its normal motion, None under a given load; kn [N/m], may be infinite."
    ] = None
    kn: float = 0.0
    rest: Annotated[float, "Part of its normal force that is in equilibrium at rest [N]."] = 0.0

    @property
    def weight(self) -> float:
        """How much of its load counts in the limit of its slider."""
        return abs(self.factor) * self.friction.limit(1.0)

    @property
    def rigid_normal(self) -> bool:
        """Whether its normal motion is a constraint."""
        return math.isinf(self.kn)


@dataclass(slots=True)
class MemberState:
    """What sliders, members and gaps do; each a small whole number."""

    sliders: Integer
    closed: Flags
    pressed: Flags

    @property
    def key(self) -> bytes:
        """It as a key of a table."""
        return self.sliders.tobytes() + self.closed.tobytes() + self.pressed.tobytes()

    def copy(self) -> MemberState:
        """A copy that may change."""
        return MemberState(self.sliders.copy(), self.closed.copy(), self.pressed.copy())


@dataclass(slots=True)
class Mode:
    """One of the linear systems."""

    A: Annotated[Real, "(nw, nw) array, w' = A w."]
    forces: Annotated[Real, "Rows of the force of every slider [N], (sliders, nw)."]
    limits: Annotated[Real, "Rows of its limit [N], (sliders, nw)."]
    loads: Annotated[Real, "(members, nw) rows of the normal loads [N]."]
    conditions: Annotated[Real, "(nc, nw) rows that are positive as long as the mode lasts."]
    ends: Annotated[list[tuple[int, int, int]], "What each of them ends in."]
    to_rates: Annotated[Real, "(nw, nw) removes what constraints forbid of the rates."]
    steps: Any = None  # what `flow` keeps of it


class Piecewise:
    """A scene at one frequency as a piecewise linear system.

    Parameters
    ----------
    scene : lumped or of matrices, with contacts of the laws coulomb, elastic-normal and gap.
    omega : angular frequency [rad/s].
    mass_damping : what the damping has besides, in units of the mass [1/s]; below 0 it feeds the motion.

    Raises
    ------
    SettingError
        A contact or a term of the structure that this has no place for, or rigid contacts in a closed loop.
    """

    def __init__(self, scene: Scene, omega: float, mass_damping: float = 0.0) -> None:
        scene.observe.check_whole("an exact orbit")
        model = linear_model(scene)
        check_structure(scene, model, _EVENTS)
        self.scene, self.omega, self.n = scene, omega, model.n_coordinates
        self.mass_damping = mass_damping
        zero = np.zeros(1, np.int64)
        K, C, M = (np.real(each[0]) for each in model.at(zero, np.ones(1, np.bool_)))
        self.inverse = np.linalg.inv(M) / omega**2
        ports = np.real(model.ports_at(zero)[0])
        self.ports = ports
        orders = [force.harmonic for force in model.forces if force.amplitude != 0.0]
        orders += [k for c in scene.contacts if c.load is not None for k in c.load.orders]
        self.top = max([1, *orders])
        self._place(scene, ports)
        self.rigid = np.isinf(self.kt)
        self.elastic_at = 2 * self.n + np.cumsum(~self.rigid) - 1  # of the sliders' positions in w
        self._check_independent()
        amplitudes = force_amplitudes(model, np.arange(self.top + 1))
        base = np.zeros((self.n, self.nw))
        base[:, : self.n], base[:, self.n : 2 * self.n] = -K, -omega * (C + mass_damping * M)
        base[:, self.nd :] = self._wave_rows(amplitudes)
        self.base = base
        self.observe = np.zeros(self.nw)
        self.observe[: self.n] = model.observe
        self.modes: dict[bytes, Mode] = {}

    @property
    def nd(self) -> int:
        """How many numbers of w are unknown: all but the harmonics."""
        return 2 * self.n + int((~self.rigid).sum())

    @property
    def nw(self) -> int:
        """The size of w."""
        return self.nd + 2 * self.top + 1

    def harmonics_at(self, tau: float) -> Real:
        """Return the last numbers of w at an angle: 1, cos τ, sin τ, …"""
        angles = tau * np.arange(1, self.top + 1)
        return np.concatenate([[1.0], np.column_stack([np.cos(angles), np.sin(angles)]).ravel()])

    def _wave_rows(self, amplitudes: Complex) -> Real:
        """Return rows over the harmonics for complex amplitudes (K + 1, rows)."""
        rows = np.zeros((amplitudes.shape[1], 2 * self.top + 1))
        rows[:, 0] = amplitudes[0].real
        rows[:, 1::2], rows[:, 2::2] = amplitudes[1:].real.T, -amplitudes[1:].imag.T
        return rows

    def motion(self, row: Real, *, rate: bool = False) -> Real:
        """Return the row over w of a relative motion or its rate by τ."""
        found = np.zeros(self.nw)
        found[self.n * rate : self.n * (1 + rate)] = row
        return found

    def _place(self, scene: Scene, ports: Real) -> None:
        """Sort the contacts into sliders with members, and springs on one side."""
        raw: list[tuple[int, Slider, Real, Row, NormalLoad]] = []
        self.gaps: list[tuple[int, Real, float, float]] = []
        first = 0
        rows: list[Real] = []
        stiffnesses: list[float] = []
        belongs: list[tuple[int, float]] = []
        for number, contact in enumerate(scene.contacts):
            row, numbers = ports[first], contact.rows()[0]
            if contact.slides_on_a_line and contact.friction is not None and contact.load is not None:
                own = ports[first : first + len(contact.end_keys)]
                raw.append((number, contact.friction, own, numbers, contact.load))
                belongs.append(_slider_of(row, numbers.kt, rows, stiffnesses))
            elif numbers.follows is Follows.GAP:
                self.gaps.append((number, row, numbers.kt, numbers.gap))
            else:
                wanted = f"must be coulomb, elastic-normal or gap {_EVENTS}"
                raise SettingError(f"{contact.name}.law", contact.LAW, wanted)
            first += len(contact.end_keys)
        self.d = np.array(rows).reshape(-1, self.n)
        self.kt = np.array(stiffnesses)
        self.rigid = np.isinf(self.kt)
        self.members = [self._member(place, *each) for place, each in zip(belongs, raw, strict=True)]
        self.of_slider = [
            [i for i, member in enumerate(self.members) if member.slider == slider]
            for slider in range(len(rows))
        ]

    def _member(
        self,
        place: tuple[int, float],
        number: int,
        friction: Slider,
        own: Real,
        numbers: Row,
        load: NormalLoad,
    ) -> Member:
        normal = None
        coefficients = load.coefficients[: 2 * self.top + 1]
        given = np.zeros(self.nw)
        given[self.nd : self.nd + coefficients.size] = coefficients
        if numbers.normal_port is not None:
            normal = own[numbers.normal_port]
            if math.isinf(numbers.kn):
                given[:] = 0.0
                given[self.nd] = numbers.rest
            else:
                given[: self.n] += numbers.kn * normal
        return Member(
            contact=number, slider=place[0], factor=place[1], friction=friction, given=given, normal=normal,
            kn=numbers.kn, rest=numbers.rest,
        )  # fmt: skip

    def _check_independent(self) -> None:
        """Refuse rigid contacts of which some follow from the others, other than along the same motion."""
        rows = [(self.members[own[0]].contact, self.d[i])
                for i, own in enumerate(self.of_slider) if self.rigid[i]]  # fmt: skip
        rows += [(each.contact, each.normal) for each in self.members if each.rigid_normal]
        if rows and np.linalg.matrix_rank(np.array([row for _, row in rows]), 1e-9) < len(rows):
            names = ", ".join(dict.fromkeys(self.scene.contacts[at].name for at, _ in rows))
            wanted = "must be of motions that do not follow from each other, where contacts are rigid: "
            raise SettingError(
                "contacts", names, wanted + "the forces in such a loop are not determined; " + _ELASTIC
            )

    # Modes

    def mode(self, state: MemberState) -> Mode:
        """Return the linear system of a state."""
        key = state.key
        found = self.modes.get(key)
        if found is None:
            found = self.modes[key] = self._made(state)
        return found

    def _made(self, state: MemberState) -> Mode:
        loads = np.array([each.given for each in self.members]).reshape(-1, self.nw)
        limits = np.zeros((len(self.kt), self.nw))
        for i in np.flatnonzero(state.closed).tolist():
            limits[self.members[i].slider] += self.members[i].weight * loads[i]
        push, forces = self._pushed(state), np.zeros_like(limits)
        for i, xi in enumerate(state.sliders.tolist()):
            if xi != STICK or not self.rigid[i]:
                held = np.eye(1, self.nw, self.elastic_at[i])[0]
                forces[i] = line_force(xi, self.kt[i], self.motion(self.d[i]), held, limits[i])
            push -= np.outer(self.d[i], forces[i])
        held = [i for i, xi in enumerate(state.sliders.tolist()) if xi == STICK and self.rigid[i]]
        pressing = [i for i, each in enumerate(self.members) if each.rigid_normal]
        normals = [self.members[i].normal for i in pressing]
        slip = {i: int(state.sliders[self.members[i].slider]) for i in pressing}
        slip = {i: xi if abs(xi) == 1 else 0 for i, xi in slip.items()}
        shares = [  # how a unit of each multiplier pulls: what is pressed also rubs
            normal + slip[i] * self.members[i].weight * self.d[self.members[i].slider]
            for i, normal in zip(pressing, normals, strict=True)
        ]
        B = np.array([*self.d[held], *normals]).reshape(-1, self.n)
        pulls = np.array([*self.d[held], *shares]).reshape(-1, self.n).T
        multipliers = np.linalg.solve(B @ self.inverse @ pulls, B @ self.inverse @ push)
        push -= pulls @ multipliers
        forces[held] = multipliers[: len(held)]
        for i, row in zip(pressing, multipliers[len(held) :], strict=True):
            loads[i] += row
            limits[self.members[i].slider] += self.members[i].weight * row
            forces[self.members[i].slider] += slip[i] * self.members[i].weight * row
        A = self._rates(push)
        conditions, ends = self._conditions(state, A, forces, limits, loads)
        return Mode(A, forces, limits, loads, conditions, ends, self._to_rates(B))

    def _pushed(self, state: MemberState) -> Real:
        """Return the forces on the coordinates without friction and multipliers, (n, nw)."""
        push = self.base.copy()
        for i, member in enumerate(self.members):
            if member.normal is not None and not member.rigid_normal:
                pressed = member.given * state.closed[i]
                pressed[self.nd] -= member.rest
                push -= np.outer(member.normal, pressed)
        for at, (_, row, k, gap) in enumerate(self.gaps):
            if state.pressed[at]:
                spring = k * self.motion(row)
                spring[self.nd] -= k * gap
                push -= np.outer(row, spring)
        return push

    def _rates(self, push: Real) -> Real:
        """Return A for the forces on the coordinates."""
        n, A = self.n, np.zeros((self.nw, self.nw))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n] = self.inverse @ push
        for k in range(1, self.top + 1):
            cosine = self.nd + 2 * k - 1
            A[cosine, cosine + 1], A[cosine + 1, cosine] = -k, k
        return A

    def _to_rates(self, B: Real) -> Real:
        found, n = np.eye(self.nw), self.n
        if len(B):
            back = self.inverse @ B.T @ np.linalg.inv(B @ self.inverse @ B.T)
            found[n : 2 * n, n : 2 * n] -= back @ B
        return found

    def _conditions(
        self, state: MemberState, A: Real, forces: Real, limits: Real, loads: Real
    ) -> tuple[Real, list[tuple[int, int, int]]]:
        """Return the rows that must stay positive, and (what ends there, of which, direction)."""
        rows: list[Real] = []
        ends: list[tuple[int, int, int]] = []
        for i, xi in enumerate(state.sliders.tolist()):
            rate = self.motion(self.d[i], rate=True)
            lasts = line_lasts(xi, self.kt[i], forces[i], limits[i], rate, limits[i] @ A)
            rows += lasts
            ends += [(TO_SLIP, i, 1), (TO_SLIP, i, -1)] if xi == STICK else [(TO_REST, i, xi)] * len(lasts)
        for i, member in enumerate(self.members):
            if np.any(loads[i, : self.nd]) or np.any(loads[i, self.nd + 1 :]):
                rows.append(loads[i] if state.closed[i] else -loads[i])
                closes = LIFTS if member.rigid_normal else TO_OPEN if state.closed[i] else TO_CLOSE
                ends.append((closes, i, 0))
        for at, (_, row, _, gap) in enumerate(self.gaps):
            away = -self.motion(row)
            away[self.nd] += gap
            rows.append(-away if state.pressed[at] else away)
            ends.append((AT_GAP, at, 0))
        return np.array(rows).reshape(-1, self.nw), ends

    def at_rest(self) -> tuple[Real, MemberState]:
        """Return w at rest at the angle 0, contacts without force, and what they do; sliders stick."""
        w = np.zeros(self.nw)
        w[self.nd :] = self.harmonics_at(0.0)
        closed = np.array([each.rigid_normal or each.given @ w > 0.0 for each in self.members], np.bool_)
        sliders = np.array(
            [STICK if any(closed[i] for i in own) else FREE for own in self.of_slider], np.int64
        )
        return w, MemberState(sliders, closed, np.array([gap < 0.0 for *_, gap in self.gaps], np.bool_))


def _slider_of(row: Real, kt: float, rows: list[Real], stiffnesses: list[float]) -> tuple[int, float]:
    """Return the slider of a contact along `row`, which is added unless it is one of the rigid ones there."""
    if math.isinf(kt):
        for at, other in enumerate(rows):
            factor = float(row @ other) / float(other @ other)
            if (
                math.isinf(stiffnesses[at])
                and np.abs(row - factor * other).max() <= _PARALLEL * np.abs(row).max()
            ):
                return at, factor
    rows.append(row)
    stiffnesses.append(kt)
    return len(rows) - 1, 1.0
