"""Growth of small perturbations of a periodic motion over one period: the monodromy matrix.

Between two changes of state of any contact the equations are linear, and the changes themselves are the exact
ones of the motion. With τ = ωt, x the motion, u = P x of a contact and w what it remembers (the places its
sliders are held at), a contact in one state (`solver.contacts.pieces.piece.Piece`) has

    δf = tangent δu + grip δw,      δw' = by_motion δu + by_rate δu' + own δw,

and δw = from_motion δu + from_memory δw⁻ where the state begins. Where these matrices are constant, as with
friction along one direction, the perturbation goes on by a matrix exponential. Where they change (a direction
that turns in slip, a stiffness that changes with the motion) it goes on by exponentials of Magnus' series of
order 6, in steps whose order-4 part agrees with it to `AGREES`: S. Blanes, F. Casas, J. A. Oteo, J. Ros,
Phys. Rep. 470 (2009) 151, doi:10.1016/j.physrep.2008.11.001, section 5.4, at the three Gauss points.

Nothing jumps in (x, x') because forces are continuous. The frame is that of R. I. Leine, H. Nijmeijer,
Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7, doi:10.1007/978-3-540-44398-8;
here every saltation matrix acts on what contacts remember alone, and a law gives its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import expm

from solver.contacts.pieces.piece import SHORTEST, Piece
from solver.jit.fourier import Real

PERIOD = 2.0 * math.pi
INVARIANT = 1e-9  # smallest singular value, relative to the largest, of what resists a rigid displacement
AGREES = 1e-5  # relative, of the two orders of a step; what order 6 leaves is a hundredth of it
LEAST_STEP = 1e-6  # rad: where a force goes to 0 its direction turns ever faster
_GAUSS = math.sqrt(15.0) / 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """A contact, or a part of one, over the period; where no piece lasts it exerts no force (separation).

    Attributes
    ----------
    ports : (m, n) array
        u = ports x.
    pieces : tuple of Piece
        Its states, one after the other.
    """

    ports: Real
    pieces: tuple[Piece, ...]

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
class Structure:
    """The linear part: M, C, K (n, n each) in SI units."""

    M: Real
    C: Real
    K: Real


@dataclass(frozen=True, slots=True, kw_only=True)
class Monodromy:
    """The map of a perturbation over one period.

    Attributes
    ----------
    matrix : (2 n + s, 2 n + s) array
        Of the state: displacements [m], velocities by τ [m/rad], and the s numbers that are remembered at
        τ = 0 [m]: places of sliders that are held, and turns of forces that slip in space.
    sliders : tuple of int
        The elements these numbers belong to; one with two of them is there twice.
    reduced : square array
        The same map without what cannot decay nor grow: sliders held all the time, and displacements that
        nothing resists.
    neutral : int
        How many multipliers were left out, all of them exactly 1.
    """

    matrix: Real
    sliders: tuple[int, ...]
    reduced: Real
    neutral: int


def monodromy(structure: Structure, elements: tuple[Element, ...], omega: float) -> Monodromy:
    """Return the monodromy matrix of a periodic motion from its contacts' states.

    Parameters
    ----------
    structure : the linear part.
    elements : the contacts with their states over the period.
    omega : excitation frequency [rad/s].
    """
    n = structure.M.shape[0]
    instants = _instants(elements)
    flow = _Flow(structure, elements, omega, 0.5 * (instants[-2] + instants[-1]))
    kept = [*range(2 * n), *flow.remembered()]
    sliders = tuple(flow.owner(i) for i in kept[2 * n :])
    state = np.zeros((flow.size, len(kept)))
    state[kept, np.arange(len(kept))] = 1.0
    for begin, end in pairwise(instants):
        state = flow.over(begin, end, flow.entered(0.5 * (begin + end), state))
    matrix = state[kept]
    reduced, neutral = _without_neutral(structure, elements, flow, matrix)
    return Monodromy(matrix=matrix, sliders=sliders, reduced=reduced, neutral=neutral)


def _instants(elements: tuple[Element, ...]) -> list[float]:
    """Every instant at which a state changes, from one period boundary at a change to the next.

    The period is cut at τ = 0, so 0 and 2π are in it too.
    """
    changes = {0.0, PERIOD}
    for element in elements:
        for piece in element.pieces:
            changes |= {edge % PERIOD for edge in piece.edges}
            if SHORTEST < piece.lasts < PERIOD - SHORTEST:
                changes |= {piece.begin % PERIOD, piece.end % PERIOD}
    ordered = sorted(changes)
    kept = [0.0]
    for tau in ordered[1:-1]:
        if tau - kept[-1] > SHORTEST and tau < PERIOD - SHORTEST:
            kept.append(tau)
    return [*kept, PERIOD]


class _Flow:
    """The perturbation's equations z' = A(τ) z: x'' = stiffness x + damping x' − inverse Pᵀ f.

    z holds x, x' and for every element as many numbers as it may remember.
    """

    def __init__(
        self, structure: Structure, elements: tuple[Element, ...], omega: float, before: float
    ) -> None:
        self.n = structure.M.shape[0]
        inverse = np.asarray(np.linalg.inv(structure.M) / omega**2, dtype=np.float64)
        self._stiffness, self._damping = -inverse @ structure.K, -omega * (inverse @ structure.C)
        self._pulls = [inverse @ element.ports.T for element in elements]
        self.elements = elements
        self.first = 2 * self.n + np.concatenate([[0], np.cumsum([e.memory for e in elements], dtype=int)])
        self.size = int(self.first[-1])
        self.active = [element.piece_at(before) for element in elements]

    def remembered(self) -> list[int]:
        """Return the places in z of what is remembered now."""
        return [int(self.first[i]) + k for i in range(len(self.elements)) for k in range(self._memory(i))]

    def owner(self, place: int) -> int:
        """Return the element that a place in z belongs to."""
        return int(np.searchsorted(self.first, place, side="right")) - 1

    def _memory(self, i: int) -> int:
        return 0 if self.active[i] < 0 else self.elements[i].pieces[self.active[i]].memory

    def entered(self, tau: float, state: Real) -> Real:
        """Return the state with every element in the piece that lasts at an angle."""
        for i, element in enumerate(self.elements):
            now, place = element.piece_at(tau), slice(self.first[i], self.first[i + 1])
            for k in self._way(element, self.active[i], now):
                piece, known = element.pieces[k], state[place]
                rows = np.zeros_like(known)
                if piece.entry is not None:
                    rows[: piece.memory] = piece.entry.from_motion @ (element.ports @ state[: self.n])
                    if piece.entry.from_memory is not None:
                        before = piece.entry.from_memory
                        rows[: piece.memory] += before @ known[: before.shape[1]]
                state[place] = rows
            if now < 0:
                state[place] = 0.0
            self.active[i] = now
        return state

    @staticmethod
    def _way(element: Element, old: int, new: int) -> list[int]:
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
        if all(at < 0 or e.pieces[at].constant for e, at in zip(self.elements, self.active, strict=True)):
            return np.asarray(expm((end - begin) * self._generator(begin)) @ state)
        waiting = [(begin, end)]
        while waiting:
            low, high = waiting.pop()
            series, off = self._magnus(low, high)
            if off > AGREES and high - low > LEAST_STEP:
                middle = 0.5 * (low + high)
                waiting += [(middle, high), (low, middle)]
                continue
            state = expm(series) @ state
        return np.asarray(state)

    def _magnus(self, begin: float, end: float) -> tuple[Real, float]:
        """Return the exponent of a step, and how far its order-4 part is from it, relative."""
        h, middle = end - begin, 0.5 * (begin + end)
        A1, A2, A3 = (self._generator(middle + h * place) for place in (-_GAUSS, 0.0, _GAUSS))
        a1, a2 = h * A2, math.sqrt(15.0) * h / 3.0 * (A3 - A1)
        a3 = 10.0 * h / 3.0 * (A3 - 2.0 * A2 + A1)
        c1 = _commutator(a1, a2)
        c2 = -_commutator(a1, 2.0 * a3 + c1) / 60.0
        less = a1 + a3 / 12.0 - c1 / 12.0
        more = a1 + a3 / 12.0 + _commutator(-20.0 * a1 - a3 + c1, a2 + c2) / 240.0
        off = float(np.abs(more - less).sum(axis=0).max())
        return more, off / max(float(np.abs(a1).sum(axis=0).max()), 1e-300)

    def _generator(self, tau: float) -> Real:
        """The matrix A in the present states at an angle."""
        n, A = self.n, np.zeros((self.size, self.size))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, n : 2 * n] = self._damping
        A[n : 2 * n, :n] = self._stiffness
        for i, (element, at) in enumerate(zip(self.elements, self.active, strict=True)):
            if at < 0:
                continue
            piece, ports = element.pieces[at], element.ports
            rates, place = piece.at(tau), slice(self.first[i], self.first[i] + piece.memory)
            A[n : 2 * n, :n] -= self._pulls[i] @ rates.tangent @ ports
            if piece.memory:
                A[n : 2 * n, place] -= self._pulls[i] @ rates.grip
                A[place, :n], A[place, n : 2 * n] = rates.by_motion @ ports, rates.by_rate @ ports
                A[place, place] = rates.own
        return A


def _commutator(a: Real, b: Real) -> Real:
    return a @ b - b @ a


def _without_neutral(
    structure: Structure, elements: tuple[Element, ...], flow: _Flow, matrix: Real
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
    if loose.shape[1]:
        basis, _ = np.linalg.qr(vectors, mode="complete")
        rest = basis[:, loose.shape[1] :]
        reduced = rest.T @ reduced @ rest
    return reduced, matrix.shape[0] - len(kept) + loose.shape[1]


def _displacements_nothing_resists(structure: Structure, elements: tuple[Element, ...]) -> Real:
    """Orthonormal displacements (n, d) that change no force of structure or contact."""
    rows = [structure.K]
    for element in elements:
        for piece in element.pieces:
            for tau in (piece.begin + 0.3 * piece.lasts, piece.begin + 0.6 * piece.lasts):
                rates = piece.at(tau)
                follows = rates.tangent if piece.held else rates.tangent + rates.grip @ piece.carried
                rows.append(follows @ element.ports)
    _, sizes, vectors = np.linalg.svd(np.vstack(rows), full_matrices=False)
    loose: Real = vectors[sizes <= INVARIANT * max(sizes.max(initial=0.0), 1e-300)].T
    return loose
