"""Growth of small perturbations of a periodic motion over one period: the monodromy matrix.

Between two changes of state of any contact the equations are linear with constant matrices, so a perturbation
goes on by a matrix exponential; the changes themselves are the exact ones of the motion. With τ = ωt, x the
motion, u = P x of a contact and w the place its slider is held at, a contact in one state (a `Piece`) has

    δf = tangent δu + grip δw,      δw = catch δu where the state begins.

For elastic Coulomb friction f = kt (u − w) in stick and f = ξμN(τ) in slip or 0 in separation, so δf is
kt (δu − δw), then 0. Nothing jumps in (x, x') because f is continuous. Where slip ends, at τₛ with
ξ kt u̇ = μ Ṅ, the slider stays at w = u − ξμN/kt: δw = δu + (u̇ − ξμṄ/kt) δτₛ = δu, whatever the change δτₛ
of that instant. Where a contact closes, τₛ is given by N alone and w = u: δw = δu again.

The frame is that of R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems,
2004, chapter 7, doi:10.1007/978-3-540-44398-8; here every saltation matrix acts on sliders alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import expm

from solver.contacts.laws.parts import SHORTEST, Piece
from solver.jit.fourier import Real

PERIOD = 2.0 * math.pi
INVARIANT = 1e-9  # smallest singular value, relative to the largest, of what resists a rigid displacement


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """A contact over the period; where no piece lasts it exerts no force (separation).

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
    def held(self) -> Piece | None:
        """The piece in which a slider is held all the time, if there is one: what it holds never changes."""
        return next((p for p in self.pieces if p.grip is not None and p.lasts >= PERIOD - SHORTEST), None)

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
        Of the state: displacements [m], velocities by τ [m/rad], places [m] of the s sliders that are held
        at τ = 0.
    sliders : tuple of int
        The elements these sliders belong to.
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
    n, count = structure.M.shape[0], len(elements)
    rates = _Rates.of(structure, omega)
    instants = _instants(elements)
    active = [element.piece_at(0.5 * (instants[-2] + instants[-1])) for element in elements]
    sliders = tuple(
        i for i, e in enumerate(elements) if active[i] >= 0 and e.pieces[active[i]].grip is not None
    )
    state = np.zeros((2 * n + count, 2 * n + len(sliders)))
    state[: 2 * n, : 2 * n] = np.eye(2 * n)
    for column, i in enumerate(sliders):
        state[2 * n + i, 2 * n + column] = 1.0
    for begin, end in pairwise(instants):
        middle = 0.5 * (begin + end)
        for i, element in enumerate(elements):
            now = element.piece_at(middle)
            if now != active[i]:
                catch = element.pieces[now].catch if now >= 0 else None
                state[2 * n + i] = 0.0 if catch is None else catch @ (element.ports @ state[:n])
                active[i] = now
        state = expm((end - begin) * rates.generator(elements, active)) @ state
    kept = [*range(2 * n), *(2 * n + i for i in sliders)]
    matrix = state[kept]
    reduced, neutral = _without_neutral(structure, elements, sliders, matrix)
    return Monodromy(matrix=matrix, sliders=sliders, reduced=reduced, neutral=neutral)


def _instants(elements: tuple[Element, ...]) -> list[float]:
    """Every instant at which a state changes, from one period boundary at a change to the next.

    The period is cut at τ = 0, so 0 and 2π are in it too.
    """
    changes = {0.0, PERIOD}
    for element in elements:
        for piece in element.pieces:
            if SHORTEST < piece.lasts < PERIOD - SHORTEST:
                changes |= {piece.begin % PERIOD, piece.end % PERIOD}
    ordered = sorted(changes)
    kept = [0.0]
    for tau in ordered[1:-1]:
        if tau - kept[-1] > SHORTEST and tau < PERIOD - SHORTEST:
            kept.append(tau)
    return [*kept, PERIOD]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rates:
    """The constant part of the equations: x'' = stiffness x + damping x' − inverse Pᵀ f."""

    inverse: Real
    stiffness: Real
    damping: Real

    @classmethod
    def of(cls, structure: Structure, omega: float) -> _Rates:
        inverse = np.asarray(np.linalg.inv(structure.M) / omega**2, dtype=np.float64)
        return cls(
            inverse=inverse, stiffness=-inverse @ structure.K, damping=-omega * (inverse @ structure.C)
        )

    def generator(self, elements: tuple[Element, ...], active: list[int]) -> Real:
        """The matrix A of the perturbation's equations z' = A z in these states."""
        n = self.inverse.shape[0]
        A = np.zeros((2 * n + len(elements), 2 * n + len(elements)))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, n : 2 * n] = self.damping
        stiffness = np.zeros((n, n))
        for i, (element, at) in enumerate(zip(elements, active, strict=True)):
            if at < 0:
                continue
            piece = element.pieces[at]
            stiffness += element.ports.T @ piece.tangent @ element.ports
            if piece.grip is not None:
                A[n : 2 * n, 2 * n + i] = -self.inverse @ (element.ports.T @ piece.grip)
        A[n : 2 * n, :n] = self.stiffness - self.inverse @ stiffness
        return A


def _without_neutral(
    structure: Structure, elements: tuple[Element, ...], sliders: tuple[int, ...], matrix: Real
) -> tuple[Real, int]:
    """Take the multipliers that are 1 by construction out of the map, exactly.

    A slider held all the time never moves: its row is that of the identity. And where nothing resists a
    displacement d of the structure (K d = 0, and every contact's force is the same once its slider has moved
    along), (d, 0, sliders) is reproduced; the map on what is orthogonal to it has the other multipliers.
    """
    n = structure.M.shape[0]
    free = [i for i, element in enumerate(elements) if element.held is None]
    kept = [*range(2 * n), *(2 * n + at for at, i in enumerate(sliders) if i in free)]
    reduced = matrix[np.ix_(kept, kept)]
    loose = _displacements_nothing_resists(structure, elements)
    carried = [
        catch @ (elements[i].ports @ loose)
        for i in sliders
        if i in free and (catch := _catch(elements[i])) is not None
    ]
    vectors = np.vstack([loose, np.zeros_like(loose), *(row[None, :] for row in carried)])
    if loose.shape[1]:
        basis, _ = np.linalg.qr(vectors, mode="complete")
        rest = basis[:, loose.shape[1] :]
        reduced = rest.T @ reduced @ rest
    return reduced, len(elements) - len(free) + loose.shape[1]


def _catch(element: Element) -> Real | None:
    """How the slider of an element follows a displacement of the structure."""
    return next((piece.catch for piece in element.pieces if piece.catch is not None), None)


def _displacements_nothing_resists(structure: Structure, elements: tuple[Element, ...]) -> Real:
    """Orthonormal displacements (n, d) that change no force of structure or contact."""
    rows = [structure.K]
    for element in elements:
        for piece in element.pieces:
            follows = piece.tangent
            if element.held is None and piece.grip is not None and piece.catch is not None:
                follows = follows + np.outer(piece.grip, piece.catch)
            rows.append(follows @ element.ports)
    _, sizes, vectors = np.linalg.svd(np.vstack(rows), full_matrices=False)
    loose: Real = vectors[sizes <= INVARIANT * max(sizes.max(initial=0.0), 1e-300)].T
    return loose
