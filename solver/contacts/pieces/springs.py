"""States of springs: on one side, which open and close, and with powers of the motion."""

from __future__ import annotations

import numpy as np

from solver.contacts.fields import Real
from solver.contacts.pieces.piece import SHORTEST, TURN, Rates, StatePiece, spring
from solver.contacts.segments import segments_of
from solver.jit import fourier


def gap_pieces(motion: Real, stiffness: float, gap: float) -> tuple[StatePiece, ...]:
    """Return when a spring on one side is closed; the force is continuous, so that nothing jumps."""
    opening = motion.copy()
    opening[0] -= gap
    rows = segments_of(np.zeros(opening.size), opening, 1.0, 1.0).rows
    closed = ((float(row.begin), float(row.end)) for row in rows)
    return tuple(spring(*when, np.array([[stiffness]])) for when in closed if when[1] - when[0] > SHORTEST)


def polynomial_pieces(motion: Real, powers: tuple[float, ...]) -> tuple[StatePiece, ...]:
    """Return the one state of a spring with the force Σ a_j u^j, its stiffness Σ j a_j u^(j−1)."""
    slopes = [j * a for j, a in enumerate(powers, start=1)]
    if not any(slopes[1:]):
        return (spring(0.0, TURN, np.array([[slopes[0]]])),)
    highest = (motion.size - 1) // 2

    def rates(tau: Real) -> Rates:
        u = fourier.basis(tau, highest) @ motion
        stiffness = np.asarray(np.polynomial.polynomial.polyval(u, slopes), dtype=np.float64)
        none = np.zeros((len(tau), 0, 1))
        return Rates(stiffness[:, None, None], none.swapaxes(1, 2), none, none, none[:, :, :0])

    edges = tuple(k * TURN / 8.0 for k in range(1, 8))
    return (StatePiece(begin=0.0, end=TURN, rates=rates, carried=np.zeros((0, 1)), edges=edges),)
