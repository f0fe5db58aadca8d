"""Growth of small perturbations of a periodic motion over one period: the monodromy matrix.

Between two changes of state of any contact the equations are linear, and the changes themselves are the exact
ones of the motion. With τ = ωt, x the motion, u = P x of a contact and w what it remembers (the places its
sliders are held at), a contact in one state (`solver.contacts.pieces.piece.StatePiece`) has

    δf = tangent δu + grip δw,      δw' = by_motion δu + by_rate δu' + own δw,

and δw = from_motion δu + from_memory δw⁻ where the state begins. The perturbation goes on by collocation, in
steps as short as what is fastest wants, or where these matrices are constant, as with friction along one
direction, by a matrix exponential if that costs less. Of a wave around a disk a share of the period is
enough: the map over it and a turn, several times, are that of all.

Nothing jumps in (x, x') because forces are continuous. The frame is that of R. I. Leine, H. Nijmeijer,
Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7, doi:10.1007/978-3-540-44398-8;
here every saltation matrix acts on what contacts remember alone, and a law gives its own.

With 8 stages a step of Gauss collocation is of order 16, and |R(z)| > 1 of its stability function where Re z
> 0, there alone (E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, sections IV.3 and
IV.5, doi:10.1007/978-3-642-05221-7): in a constant state nothing grows that decays, nor the other way round,
however long the step. In coordinates y in which the structure falls into blocks,

    y'' = −K y − C y' − inputs f,      u = outputs y,

a step h leaves for the rates of y at the stages, in the eigenvectors of the rule's matrix A = S μ S⁻¹,

    Y' = X (S⁻¹1 y'₀ − hμ S⁻¹1 K y₀ − hμ inputs S⁻¹f),      X = (1 + hμ C + h²μ² K)⁻¹,

so that the motions of the contacts follow from their forces, which are the unknowns of a step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import block_diag, eigh, expm, null_space

from solver.contacts.pieces.piece import SHORTEST, Rates, StatePiece
from solver.errors import StoppedError
from solver.jit.fourier import Complex, Real
from solver.response.stability.cost import FASTEST_IN_A_STEP, STAGES, of_a_step, of_an_exponential
from solver.results.watch import OnProgress, ShouldStop

DECOUPLED = 1e-8  # of what two modes have alone, what joins them in stiffness and damping and counts as none
_ROUNDING = 1e-13  # of the largest

PERIOD = 2.0 * math.pi
INVARIANT = 1e-9  # smallest singular value, relative to the largest, of what resists a rigid displacement
ALIKE = 1e-9  # relative difference of matrices of sectors that are alike
SMOOTH = 2e-3  # of the largest force, the last Legendre coefficients of a step that is not halved
LEAST_STEP = 1e-6  # rad: where a force goes to 0 its direction turns ever faster


class _Rule(NamedTuple):
    """Nodes in [0, 1], matrix and weights; its eigenvalues above the real axis with S and S⁻¹.

    `end` takes the value at the end from those at the stages; `tail` the last two Legendre coefficients.
    """

    nodes: Real
    matrix: Real
    weights: Real
    eigenvalues: Complex
    right: Complex
    left: Complex
    end: Real
    tail: Real


def _rule(stages: int) -> _Rule:
    """Return the rule; integrals of Lagrange's polynomials by Legendre's, which the nodes make orthogonal."""
    x, w = legendre.leggauss(stages)
    P = legendre.legvander(x, stages)
    orders = np.arange(stages)
    share = w[:, None] * P[:, :stages] * (orders + 0.5)
    below = np.column_stack([-np.ones(stages), P[:, : stages - 1]])
    matrix = 0.5 * (P[:, 1:] - below) / (2.0 * orders + 1.0) @ share.T
    values, right = np.linalg.eig(matrix)
    upper, left = values.imag > 0.0, np.linalg.inv(right)
    weights = 0.5 * w
    return _Rule(
        0.5 * (x + 1.0), matrix, weights, values[upper], right[:, upper], left[upper],
        np.linalg.solve(matrix.T, weights), share[:, -2:].T,
    )  # fmt: skip


GAUSS = _rule(STAGES)
_ONCE = GAUSS.left.sum(axis=1)  # S⁻¹1
_END = (GAUSS.end @ GAUSS.right, GAUSS.weights @ GAUSS.right)  # of rates and of motions


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocks:
    """A structure in coordinates y in which it falls into b blocks of k, with p motions of contacts."""

    basis: Annotated[Real, "x = basis y, (n, n)."]
    inverse: Annotated[Real, "y = inverse x, (n, n)."]
    stiffness: Annotated[Real, "K by τ and per unit of mass, (b, k, k)."]
    damping: Annotated[Real, "C likewise, (b, k, k)."]
    inputs: Annotated[Real, "y'' = −inputs f and u = outputs y, (p, n)."]
    outputs: Real
    fastest: Annotated[float, "A bound of what is fastest, in units of the excitation frequency."]

    @property
    def whole(self) -> tuple[Real, Real]:
        """K and C as they are, (n, n) each."""
        return np.asarray(block_diag(*self.stiffness)), np.asarray(block_diag(*self.damping))


def blocks_of(M: Real, C: Real, K: Real, ports: Real, omega: float) -> Blocks:
    """Return a structure in its modes where they are decoupled; else all of it is one block."""
    n = len(M)
    try:
        basis = np.asarray(eigh(0.5 * (K + K.T), M)[1])
    except np.linalg.LinAlgError:
        basis = np.eye(n)
    fed = np.linalg.inv(M @ basis)
    stiffness, damping = fed @ K @ basis / omega**2, fed @ C @ basis / omega
    if _decoupled(stiffness) and _decoupled(damping):
        blocks = [np.diag(each)[:, None, None] for each in (stiffness, damping)]
    else:
        blocks = [each[None] for each in (stiffness, damping)]
    stiff, damp = (float(np.linalg.norm(each, 2, axis=(1, 2)).max(initial=0.0)) for each in blocks)
    return Blocks(
        basis=basis, inverse=np.linalg.inv(basis), stiffness=blocks[0], damping=blocks[1],
        inputs=fed @ ports.T / omega**2, outputs=ports @ basis, fastest=max(np.sqrt(stiff), damp),
    )  # fmt: skip


def _decoupled(matrix: Real) -> bool:
    alone = np.sqrt(np.abs(np.diag(matrix)))
    beside = np.abs(matrix - np.diag(np.diag(matrix)))
    return bool(
        np.all(beside <= DECOUPLED * np.outer(alone, alone) + _ROUNDING * alone.max(initial=0.0) ** 2)
    )


class StructureStep:
    """What a step of one length does to a structure, with the motions of some contacts."""

    def __init__(self, blocks: Blocks, h: float, ports: list[int]) -> None:
        (b, k, _), p = blocks.stiffness.shape, len(ports)
        n = b * k
        self.h, self.outputs = h, blocks.outputs[ports]
        inputs = blocks.inputs[:, ports]
        scaled = h * GAUSS.eigenvalues[:, None, None, None]
        X = np.linalg.inv(np.eye(k) + scaled * blocks.damping + scaled**2 * blocks.stiffness)
        XK = scaled * (X @ blocks.stiffness)
        by_rate, by_motion = _ONCE * _END[0], h * _ONCE * _END[1]
        one = np.eye(k)
        self._own = (
            one - _twice(by_motion, XK), _twice(by_motion, X), -_twice(by_rate, XK), one + _twice(by_rate, X)
        )  # fmt: skip
        seen = np.ascontiguousarray(self.outputs.reshape(p, b, k).swapaxes(0, 1))
        now, still = ((seen @ each).swapaxes(1, 2).reshape(len(X), p, n) for each in (X, XK))
        spread, hm = GAUSS.right * _ONCE, scaled[:, 0, 0]
        self.free = (_twice(spread, -still).reshape(-1, n), _twice(spread, now).reshape(-1, n))
        joined = GAUSS.right[:, :, None] * hm[:, 0, None] * GAUSS.left
        self.follows = -_twice(np.moveaxis(joined, 1, -1), now @ inputs).swapaxes(1, 2)
        self.follows = self.follows.reshape(STAGES * p, STAGES * p)
        fed = (X @ inputs.reshape(b, k, p)).reshape(len(X), n, p)
        self._pushed = tuple(
            -_twice((end * factor * GAUSS.eigenvalues * h)[None, :] * GAUSS.left.T, fed)
            .transpose(1, 0, 2)
            .reshape(n, -1)
            for end, factor in ((_END[1], h), (_END[0], 1.0))
        )

    def ended(self, q: Real, v: Real, forces: Real | None) -> tuple[Real, Real]:
        """Return motions and rates at the end, from those at the begin and forces (stages p, m)."""
        b, k, _ = self._own[0].shape
        q3, v3 = q.reshape(b, k, -1), v.reshape(b, k, -1)
        qq, qv, vq, vv = self._own
        times = np.multiply if k == 1 else np.matmul
        later = (times(qq, q3) + times(qv, v3)).reshape(q.shape)
        rates = (times(vq, q3) + times(vv, v3)).reshape(q.shape)
        if forces is not None:
            later += self._pushed[0] @ forces
            rates += self._pushed[1] @ forces
        return later, rates


def _twice(factors: Complex, each: NDArray[Any]) -> Real:
    """Return 2 Re Σ factors each over the eigenvalues above the real axis, the last axis of the factors."""
    return np.asarray(2.0 * np.tensordot(factors, each, axes=(-1, 0)).real)


class ContactStep:
    """How forces and memory of one contact with m motions follow the rates of these over a step.

    Attributes
    ----------
    force : three arrays
        Forces at the stages (stages m) by the rates at the stages (stages m), by motion and by memory at
        the begin.
    memory : three arrays
        The same of what is remembered at the end.
    """

    def __init__(self, rates: Rates, h: float) -> None:
        s, m, k = rates.grip.shape
        hA = h * GAUSS.matrix
        tangent = np.einsum("iab,ij->iajb", rates.tangent, hA).reshape(s * m, s * m)
        start = np.tile(np.eye(k), (s, 1))
        if not k:
            nothing = np.zeros((s * m, 0))
            self.force = (tangent, rates.tangent.reshape(s * m, m), nothing)
            self.memory = (np.zeros((0, s * m)), np.zeros((0, m)), np.zeros((0, 0)))
            return
        own, moved, paced = (
            np.einsum("ij,jab->iajb", hA, each).reshape(s * k, -1)
            for each in (rates.own, rates.by_motion, rates.by_rate)
        )
        driven = moved @ np.kron(hA, np.eye(m)) + paced
        once = moved.reshape(s * k, s, m).sum(axis=1)
        states = np.linalg.solve(np.eye(s * k) - own, np.hstack([driven, once, start]))
        gripped = (rates.grip @ states.reshape(s, k, -1)).reshape(s * m, -1)
        ends = np.tensordot(GAUSS.end, states.reshape(s, k, -1), axes=1)
        cuts = [s * m, (s + 1) * m]
        by_rates, by_motion, by_memory = np.split(gripped, cuts, axis=1)
        self.force = (tangent + by_rates, rates.tangent.reshape(s * m, m) + by_motion, by_memory)
        first, second, third = np.split(ends, cuts, axis=1)
        self.memory = (first, second, np.eye(k) + third)


def stepped(
    step: StructureStep, contacts: list[tuple[ContactStep, slice, slice]], q: Real, v: Real, w: Real
) -> tuple[Real, Real, Real, Real]:
    """Return motions, rates and memory at the end of a step, and the forces at its stages (stages, p, m).

    Parameters
    ----------
    step : that of the structure.
    contacts : of each its step, its places among the structure's motions and those of its memory.
    q, v, w : (n, m), (n, m) and (s, m) at the begin.
    """
    p, width = len(step.outputs), q.shape[1]
    if not p:
        return *step.ended(q, v, None), w, np.zeros((STAGES, 0, width))
    u, follows = step.outputs @ q, step.follows.reshape(STAGES, p, -1)
    free = (step.free[0] @ q + step.free[1] @ v).reshape(STAGES, p, width)
    system, pulls = np.eye(STAGES * p).reshape(STAGES, p, -1), np.empty_like(free)
    paces, answers = [], []
    for contact, place, held in contacts:
        paces.append(free[:, place].reshape(-1, width))
        answers.append(follows[:, place].reshape(-1, STAGES * p))
        by_rates, by_motion, by_memory = contact.force
        system[:, place] -= (by_rates @ answers[-1]).reshape(STAGES, -1, STAGES * p)
        pull = by_rates @ paces[-1] + by_motion @ u[place] + by_memory @ w[held]
        pulls[:, place] = pull.reshape(STAGES, -1, width)
    forces = np.asarray(np.linalg.solve(system.reshape(STAGES * p, -1), pulls.reshape(-1, width)))
    after = w.copy()
    for (contact, place, held), pace, answer in zip(contacts, paces, answers, strict=True):
        by_rates, by_motion, by_memory = contact.memory
        if by_memory.size:
            moved = by_rates @ pace + by_motion @ u[place] + by_memory @ w[held]
            after[held] = moved + (by_rates @ answer) @ forces
    return *step.ended(q, v, forces), after, forces.reshape(STAGES, p, width)


@dataclass(frozen=True, slots=True, kw_only=True)
class PeriodElement:
    """A contact, or a part of one, over the period; where no piece lasts it exerts no force (separation)."""

    ports: Annotated[Real, "u = ports x, (m, n)."]
    pieces: Annotated[tuple[StatePiece, ...], "Its states, one after the other."]

    @property
    def held(self) -> bool:
        """Whether its sliders are held all the time."""
        return any(piece.held for piece in self.pieces)

    @property
    def memory(self) -> int:
        """The most numbers it remembers."""
        return max((piece.memory for piece in self.pieces), default=0)

    def piece_at(self, tau: float) -> int:
        """Index of the piece that lasts at `tau`, -1 for none."""
        return next((i for i, piece in enumerate(self.pieces) if piece.holds_at(tau)), -1)


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearPart:
    """The linear part: M, C, K (n, n each) in SI units."""

    M: Real
    C: Real
    K: Real
    rates: Annotated[Real | None, "Rows (m, 2 n) over displacements and velocities [m/s] that are 0."] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Monodromy:
    """The map of a perturbation over one period."""

    matrix: Annotated[
        Real,
        "Of the state, (2 n + s, 2 n + s): displacements [m], velocities by τ [m/rad], and the s numbers "
        "that are remembered at τ = 0 [m]: places of sliders that are held, and turns of forces that slip "
        "in space.",
    ]
    sliders: Annotated[
        tuple[int, ...], "The elements these numbers belong to; one with two of them is there twice."
    ]
    reduced: Annotated[
        Real,
        "The same map without what cannot decay nor grow: sliders held all the time, and displacements "
        "that nothing resists.",
    ]
    neutral: Annotated[int, "How many multipliers were left out, all of them exactly 1."]


def monodromy(
    structure: LinearPart, elements: tuple[PeriodElement, ...], omega: float, *, sectors: int = 1,
    order: int = 0, on_progress: OnProgress = None, should_stop: ShouldStop = None,
) -> Monodromy:  # fmt: skip
    """Return the monodromy matrix of a periodic motion from its contacts' states.

    Parameters
    ----------
    structure : the linear part.
    elements : the contacts with their states over the period.
    omega : excitation frequency [rad/s].
    sectors, order : sectors that do the same one after the other, and the engine order of that wave.
    on_progress : called with (share done, steps so far).
    should_stop : asked between steps.

    Raises
    ------
    StoppedError
        `should_stop` said so.
    """
    n, wave = structure.M.shape[0], _wave(structure, elements, sectors, order)
    instants = _instants(elements, PERIOD / wave.parts)
    flow = _Flow(structure, elements, omega, _instants(elements, PERIOD))
    begun, kept = list(flow.active), [*range(2 * n), *flow.remembered()]
    sliders = tuple(flow.owner(i) for i in kept[2 * n :])
    state = np.zeros((flow.size, len(kept)))
    state[kept, np.arange(len(kept))] = 1.0
    for begin, end in pairwise(instants):
        if should_stop is not None and should_stop():
            raise StoppedError("the computation of multipliers was stopped")
        state = flow.over(begin, end, flow.entered(0.5 * (begin + end), state))
        if on_progress is not None:
            on_progress(end / instants[-1], flow.steps)
    if flow.active != flow.further(begun, wave):  # rounding has put a change on the other side of the cut
        return monodromy(structure, elements, omega, on_progress=on_progress, should_stop=should_stop)
    flow.active = begun
    part = flow.as_given(state)[flow.places(wave, -wave.ahead)][kept]
    matrix = np.linalg.matrix_power(part, wave.parts)
    around = np.zeros(flow.size, dtype=np.intp)
    around[kept] = np.arange(len(kept))
    matrix = matrix[around[flow.places(wave, wave.ahead * wave.parts)[kept]]]
    reduced, neutral = _without_neutral(structure, elements, flow, matrix)
    return Monodromy(matrix=matrix, sliders=sliders, reduced=reduced, neutral=neutral)


class _Wave(NamedTuple):
    """A wave around a disk: what is so many sectors ahead is here one of so many parts of a period later."""

    sectors: int = 1
    ahead: int = 0
    parts: int = 1


def _wave(structure: LinearPart, elements: tuple[PeriodElement, ...], sectors: int, order: int) -> _Wave:
    """Return by how much of a period sectors follow each other, if they are alike.

    With x_j(τ) that of sector j and s order = g modulo n, g the greatest divisor they share, what the sector
    s further does now this one does g/n of a period later. So the map over a period is the power of that over
    g/n of it, followed by the turn.
    """
    n, joint = len(structure.M), math.gcd(order, sectors)
    if joint == sectors or n % sectors or len(elements) % sectors:
        return _Wave()
    width, count = n // sectors, len(elements) // sectors
    for each in (structure.M, structure.C, structure.K):
        if np.abs(np.roll(each, (width, width), (0, 1)) - each).max() > ALIKE * np.abs(each).max():
            return _Wave()
    for i, element in enumerate(elements):
        other = elements[(i + count) % len(elements)].ports
        if other.shape != element.ports.shape or not np.allclose(np.roll(element.ports, width, 1), other):
            return _Wave()
    ahead = next(s for s in range(sectors) if s * order % sectors == joint)
    return _Wave(sectors, ahead, sectors // joint)


def _instants(elements: tuple[PeriodElement, ...], last: float) -> list[float]:
    """Every instant up to a last one at which a state changes; 0 and the last are among them."""
    changes = {0.0}
    for element in elements:
        for piece in element.pieces:
            changes |= {edge % PERIOD for edge in piece.edges}
            if SHORTEST < piece.lasts < PERIOD - SHORTEST:
                changes |= {piece.begin % PERIOD, piece.end % PERIOD}
    kept = [0.0]
    for tau in sorted(changes)[1:]:
        if tau - kept[-1] > SHORTEST and tau < last - SHORTEST:
            kept.append(tau)
    return [*kept, last]


class _Flow:
    """The perturbation's equations: of y and y' of the structure and of what elements may remember."""

    def __init__(
        self, structure: LinearPart, elements: tuple[PeriodElement, ...], omega: float, instants: list[float]
    ) -> None:
        self.n, self.elements, self.steps = structure.M.shape[0], elements, 0
        ports = [element.ports for element in elements]
        every = np.vstack([*ports, np.zeros((0, self.n))])
        self._blocks = blocks_of(structure.M, structure.C, structure.K, every, omega)
        self._joined = self._blocks.outputs @ self._blocks.inputs
        ends = np.cumsum([0, *(len(each) for each in ports)]).tolist()
        self._ports = [list(range(*each)) for each in pairwise(ends)]
        self.first = 2 * self.n + np.concatenate([[0], np.cumsum([e.memory for e in elements], dtype=int)])
        self.size = int(self.first[-1])
        self.active = [element.piece_at(0.5 * (instants[-2] + instants[-1])) for element in elements]
        self._largest, self.omega = 0.0, omega

    def further(self, active: list[int], wave: _Wave) -> list[int]:
        """Return the pieces in which elements are a share of the wave later."""
        shift = wave.ahead * (len(active) // wave.sectors)
        return active[shift:] + active[:shift]

    def places(self, wave: _Wave, sectors: int) -> NDArray[np.intp]:
        """Return the places in the state of what is so many sectors further."""
        rows = np.roll(np.arange(self.n), -sectors * (self.n // wave.sectors))
        count = len(self.elements) // wave.sectors
        memory = [
            np.arange(self.first[j], self.first[j + 1])
            for i in range(len(self.elements))
            for j in [(i + sectors * count) % len(self.elements)]
        ]
        return np.concatenate([rows, self.n + rows, *memory])

    def as_given(self, state: Real) -> Real:
        """Return a state in the coordinates of the structure, on both sides."""
        state = self._turned(state, self._blocks.basis)
        return self._turned(state.T, self._blocks.inverse.T).T

    def _turned(self, state: Real, matrix: Real) -> Real:
        n = self.n
        return np.vstack([matrix @ state[:n], matrix @ state[n : 2 * n], state[2 * n :]])

    def remembered(self) -> list[int]:
        """Return the places in z of what is remembered now."""
        present = ((i, at) for i, at in enumerate(self.active) if at >= 0)
        return [
            int(self.first[i]) + k for i, at in present for k in range(self.elements[i].pieces[at].memory)
        ]

    def owner(self, place: int) -> int:
        """Return the element that a place in z belongs to."""
        return int(np.searchsorted(self.first, place, side="right")) - 1

    def entered(self, tau: float, state: Real) -> Real:
        """Return the state with every element in the piece that lasts at an angle."""
        for i, element in enumerate(self.elements):
            now, place = element.piece_at(tau), slice(self.first[i], self.first[i + 1])
            for k in self._way(element, self.active[i], now):
                piece, known = element.pieces[k], state[place]
                rows = np.zeros_like(known)
                if piece.entry is not None:
                    moved = self._blocks.outputs[self._ports[i]] @ state[: self.n]
                    rows[: piece.memory] = piece.entry.from_motion @ moved
                    if piece.entry.from_memory is not None:
                        before = piece.entry.from_memory
                        rows[: piece.memory] += before @ known[: before.shape[1]]
                state[place] = rows
            if now < 0:
                state[place] = 0.0
            self.active[i] = now
        return state

    @staticmethod
    def _way(element: PeriodElement, old: int, new: int) -> list[int]:
        """Return the pieces entered from one to another, those too short to be seen between among them."""
        if new in (old, -1):
            return []
        way = [new]
        while len(way) < len(element.pieces):
            entry = element.pieces[way[0]].entry
            before = (way[0] - 1) % len(element.pieces)
            if before == old or entry is None or entry.from_memory is None:
                break
            way.insert(0, before)
        return way

    def over(self, begin: float, end: float, state: Real) -> Real:
        """Return the state at the end of an interval in which no element changes its piece."""
        present = enumerate(zip(self.elements, self.active, strict=True))
        now = [(i, element.pieces[at]) for i, (element, at) in present if at >= 0]
        ports = [port for i, _ in now for port in self._ports[i]]
        turn = (end - begin) * self._fastest(now, ports, 0.5 * (begin + end))
        steps, decoupled = math.ceil(turn / FASTEST_IN_A_STEP), len(self._blocks.stiffness) > 1
        seconds = steps * of_a_step(self.n, len(ports), len(now), state.shape[1], decoupled=decoupled)
        if all(piece.constant for _, piece in now) and of_an_exponential(self.size, turn) < seconds:
            self.steps += 1
            return np.asarray(expm((end - begin) * self._generator(now)) @ state)
        edges = np.linspace(begin, end, max(steps, 1) + 1).tolist()
        waiting, structure = list(pairwise(edges))[::-1], None
        while waiting:
            low, high = waiting.pop()
            h = high - low
            if structure is None or abs(structure.h - h) > SHORTEST:
                structure = StructureStep(self._blocks, h, ports)
            found, forces = self._stepped(structure, low, now, state)
            self._largest = max(self._largest, float(np.abs(forces).max(initial=0.0)))
            tail = np.abs(np.tensordot(GAUSS.tail, forces, axes=1)).max(initial=0.0)
            if tail > SMOOTH * self._largest and h > LEAST_STEP:
                waiting += [(low + 0.5 * h, high), (low, low + 0.5 * h)]
                continue
            self.steps += 1
            state = found
        return state

    def _stepped(
        self, structure: StructureStep, low: float, now: list[tuple[int, StatePiece]], state: Real
    ) -> tuple[Real, Real]:
        """Return the state after a step, and the forces at its stages."""
        n, h, contacts, begin = self.n, structure.h, [], 0
        nodes = low + h * GAUSS.nodes
        for i, piece in now:
            width, memory = len(self._ports[i]), int(self.first[i]) - 2 * n
            place, held = slice(begin, begin + width), slice(memory, memory + piece.memory)
            contacts.append((ContactStep(piece.at(nodes), h), place, held))
            begin += width
        q, v, w, forces = stepped(structure, contacts, state[:n], state[n : 2 * n], state[2 * n :])
        return np.vstack([q, v, w]), forces

    def _fastest(self, now: list[tuple[int, StatePiece]], ports: list[int], tau: float) -> float:
        """Return a bound of what is fastest with the contacts in their states, in units of ω."""
        tangents = block_diag(*(piece.at(np.array([tau])).tangent[0] for _, piece in now))
        added = np.linalg.norm(tangents @ self._joined[np.ix_(ports, ports)], 2) if ports else 0.0
        return math.sqrt(self._blocks.fastest**2 + float(added))

    def _generator(self, now: list[tuple[int, StatePiece]]) -> Real:
        """Return the matrix of the equations in states that are constant."""
        n, A = self.n, np.zeros((self.size, self.size))
        stiffness, damping = self._blocks.whole
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = -stiffness, -damping
        for i, piece in now:
            rates, place = piece.at(np.zeros(1)), slice(self.first[i], self.first[i] + piece.memory)
            outputs, inputs = self._blocks.outputs[self._ports[i]], self._blocks.inputs[:, self._ports[i]]
            A[n : 2 * n, :n] -= inputs @ rates.tangent[0] @ outputs
            A[n : 2 * n, place] -= inputs @ rates.grip[0]
            A[place, :n], A[place, n : 2 * n] = rates.by_motion[0] @ outputs, rates.by_rate[0] @ outputs
            A[place, place] = rates.own[0]
        return A


def _without_neutral(
    structure: LinearPart, elements: tuple[PeriodElement, ...], flow: _Flow, matrix: Real
) -> tuple[Real, int]:
    """Take the multipliers that are 1 by construction out of the map, exactly.

    A slider held all the time never moves: its row is that of the identity. And where nothing resists a
    displacement d of the structure (K d = 0, and every contact's force is the same once its slider has moved
    along), (d, 0, sliders) is reproduced; the map on what is orthogonal to it has the other multipliers.
    """
    n = structure.M.shape[0]
    owners = [flow.owner(place) for place in flow.remembered()]
    kept = [*range(2 * n), *(2 * n + at for at, i in enumerate(owners) if not elements[i].held)]
    reduced = matrix[np.ix_(kept, kept)]
    loose = _displacements_nothing_resists(structure, elements)
    free = [i for i in range(len(elements)) if i in owners and not elements[i].held]
    carried = [elements[i].pieces[flow.active[i]].carried @ (elements[i].ports @ loose) for i in free]
    vectors = np.vstack([loose, np.zeros_like(loose), *carried])
    if structure.rates is not None:
        rates = np.pad(structure.rates, ((0, 0), (0, len(kept) - 2 * n)))
        rates[:, n : 2 * n] *= flow.omega
        fulfilled = null_space(rates)
        reduced, vectors = fulfilled.T @ reduced @ fulfilled, fulfilled.T @ vectors
    if loose.shape[1]:
        basis, _ = np.linalg.qr(vectors, mode="complete")
        rest = basis[:, loose.shape[1] :]
        reduced = rest.T @ reduced @ rest
    return reduced, matrix.shape[0] - len(kept) + loose.shape[1]


def _displacements_nothing_resists(structure: LinearPart, elements: tuple[PeriodElement, ...]) -> Real:
    """Orthonormal displacements (n, d) that change no force of structure or contact."""
    rows = [structure.K]
    for element in elements:
        for piece in element.pieces:
            rates = piece.at(piece.begin + piece.lasts * np.array([0.3, 0.6]))
            follows = rates.tangent if piece.held else rates.tangent + rates.grip @ piece.carried
            rows += list(follows @ element.ports)
    _, sizes, vectors = np.linalg.svd(np.vstack(rows), full_matrices=False)
    loose: Real = vectors[sizes <= INVARIANT * max(sizes.max(initial=0.0), 1e-300)].T
    return loose
