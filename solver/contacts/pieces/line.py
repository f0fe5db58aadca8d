"""States of what acts along one direction: friction, a spring on one side, one with powers of the motion.

Stick: f = kt (u − w). Slip in direction ξ: f = ξμN, N = N0 + N1 cos(τ + φ) + kn v, and kn v presses. Where a
slip ends, w = u − ξμN/kt, and its rate ξ kt u' − μN' is 0 there, so that

    δw = δu − ξ (μ kn/kt) δv,

whatever the change of that instant. Where N rises through 0 the slider is where the part is, w = u, at an
instant that moves by δτ = −kn δv/N':

    δw = δu − (u' kn/N') δv.

Forces never jump, so that nothing else does: the saltation matrices (R. I. Leine, H. Nijmeijer, Dynamics and
Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7, doi:10.1007/978-3-540-44398-8) act on sliders
alone. At the instant N becomes 0 nothing is remembered any longer.
"""

from __future__ import annotations

import numpy as np

from solver.contacts.fields import Real
from solver.contacts.kernels.stick_slip_events import AFTER_SLIP, FAILED, STICK
from solver.contacts.pieces.piece import SHORTEST, TURN, Rates, StateEntry, StatePiece, spring, steady
from solver.contacts.segments import segments_of
from solver.errors import SettingError
from solver.jit import fourier


def friction_pieces(
    slip: Real, load: Real, kt: float, mu: float, *, kn: float | None = None, presses: bool = True
) -> tuple[StatePiece, ...]:
    """Return the states of friction in one direction.

    Parameters
    ----------
    slip : full coefficients of u [m]; load : of N, what the normal motion adds included [N].
    kn : stiffness by which the second motion v changes the load [N/m]; None: the load is given.
    presses : whether the normal force itself belongs to it.

    Raises
    ------
    SettingError
        A motion that cannot be followed.
    """
    if kn is not None:
        _presses_or_opens(load)
    found = segments_of(slip, load, kt, mu)
    if found.state == FAILED:
        raise SettingError("solution", "motion", "must be one of every contact that can be followed")
    by_load = 0.0 if kn is None else kn
    pressed = np.diag([0.0, by_load if presses else 0.0])
    m = 1 if kn is None else 2
    pieces = []
    for row in found.rows:
        begin, end = float(row.begin), float(row.end)
        if end - begin <= SHORTEST:
            continue
        tangent = pressed.copy()
        if row.motion != STICK or mu == 0.0:
            tangent[0, 1] = row.direction * mu * by_load
            pieces.append(spring(begin, end, tangent[:m, :m]))
            continue
        tangent[0, 0] = kt
        follows = -row.direction * mu * by_load / kt
        if row.began != AFTER_SLIP and by_load > 0.0 and end - begin < TURN - SHORTEST:
            follows = -_slope(slip, begin) * by_load / _slope(load, begin)
        always = end - begin >= TURN - SHORTEST
        entry = None if always else StateEntry(np.array([[1.0, follows]])[:, :m], None)
        rates = steady(tangent[:m, :m], np.array([[-kt], [0.0]])[:m])
        pieces.append(StatePiece(begin=begin, end=end, rates=rates, entry=entry, carried=np.eye(1, m)))
    return tuple(pieces)


def _presses_or_opens(load: Real) -> None:
    """Raise SettingError where a contact touches all the time without a force."""
    if not np.any(load):
        wanted = "must press or open every contact: what touches without a force is stiff to one side alone"
        raise SettingError("solution", "motion", wanted)


def _slope(coefficients: Real, tau: float) -> float:
    """Return the derivative by τ of full coefficients."""
    return float(
        fourier.basis(np.array([tau]), (coefficients.size - 1) // 2)[0] @ fourier.derivative(coefficients)
    )


def gap_pieces(motion: Real, stiffness: float, gap: float) -> tuple[StatePiece, ...]:
    """Return when a spring on one side is closed; the force is continuous, so that nothing jumps."""
    opening = motion.copy()
    opening[0] -= gap
    _presses_or_opens(opening)
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
