"""States of springs: on one side, which open and close, and with powers of the motion."""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.fields import Real
from solver.contacts.kernels.stick_slip_events import BEGIN, END
from solver.contacts.pieces.piece import SHORTEST, TURN, Piece, Rates, spring, steady
from solver.contacts.segments import segments_of
from solver.jit import fourier


def gap_pieces(motion: Real, stiffness: float, gap: float) -> tuple[Piece, ...]:
    """Return when a spring on one side is closed; the force is continuous, so that nothing jumps."""
    opening = motion.copy()
    opening[0] -= gap
    rows = segments_of(np.zeros(opening.size), opening, 1.0, 1.0).rows
    closed = ((float(row[BEGIN]), float(row[END])) for row in rows)
    return tuple(spring(*when, np.array([[stiffness]])) for when in closed if when[1] - when[0] > SHORTEST)


def polynomial_pieces(motion: Real, powers: tuple[float, ...]) -> tuple[Piece, ...]:
    """Return the one state of a spring with the force Σ a_j u^j, its stiffness Σ j a_j u^(j−1)."""
    slopes = [j * a for j, a in enumerate(powers, start=1)]
    if not any(slopes[1:]):
        return (spring(0.0, TURN, np.array([[slopes[0]]])),)
    highest = (motion.size - 1) // 2
    still = steady(np.zeros((1, 1)))

    def rates(tau: float) -> Rates:
        u, stiffness = float(fourier.basis(np.array([tau]), highest)[0] @ motion), 0.0
        for slope in reversed(slopes):
            stiffness = stiffness * u + slope
        return still._replace(tangent=np.array([[stiffness]]))

    edges = tuple(k * TURN / 8.0 for k in range(1, 8))
    return (Piece(begin=0.0, end=2.0 * math.pi, rates=rates, carried=np.zeros((0, 1)), edges=edges),)
