"""Gauss collocation of a perturbed structure and its contacts: one step of the equations of `monodromy`.

With 8 stages a step is of order 16, and |R(z)| > 1 of its stability function where Re z > 0, there alone
(E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, sections IV.3 and IV.5,
doi:10.1007/978-3-642-05221-7): in a constant state nothing grows that decays, nor the other way round,
however long the step. In coordinates y in which the structure falls into blocks,

    y'' = −K y − C y' − inputs f,      u = outputs y,

a step h leaves for the rates of y at the stages, in the eigenvectors of the rule's matrix A = S μ S⁻¹,

    Y' = X (S⁻¹1 y'₀ − hμ S⁻¹1 K y₀ − hμ inputs S⁻¹f),      X = (1 + hμ C + h²μ² K)⁻¹,

so that the motions of the contacts follow from their forces, which are the unknowns of a step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import block_diag, eigh

from solver.contacts.pieces.piece import Rates
from solver.jit.fourier import Complex, Real
from solver.response.stability.cost import STAGES

DECOUPLED = 1e-8  # of what two modes have alone, what joins them in stiffness and damping and counts as none
_ROUNDING = 1e-13  # of the largest


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
