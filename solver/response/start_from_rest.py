"""The way from rest to a response in which every contact sticks: a linear transient, followed to its end.

With all contacts stuck and closed the motion from rest differs from the response by a free decay of

    M Δẍ + C Δẋ + K_s Δx = 0,  Δx(0) = −x(0),  Δẋ(0) = −ẋ(0),

until the first contact slips, if one does. The decay is exact at every instant looked at (a matrix
exponential), of the whole annulus where the structure is one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solver.jit.fourier import Real
from solver.linear.assembly import LinearModel

LARGEST = 400  # coordinates of the annulus: above, the exponential would cost more than the response
_TURN = 0.1  # rad of the fastest motion from instant to instant
_MOST_INSTANTS = 4096
_MOST_PERIODS = 3000
_MOST_PRODUCTS = 200_000_000  # multiplications of all periods: a fraction of a second


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Rest, as seen from the response at τ = 0, over all sectors.

    Attributes
    ----------
    model : LinearModel
        The structure.
    stiffness : (n_ports,) array
        Of the ports of what sticks [N/m], 0 elsewhere.
    x, v : (sectors, n) arrays
        Displacements [m] and velocities [m/s] of the response.
    omega : float
        [rad/s].
    """

    model: LinearModel
    stiffness: Real
    x: Real
    v: Real
    omega: float

    def distance(self, x: Real, v: Real) -> float:
        """Return the energy of displacements and velocities (sectors, n) [J]."""
        beyond = np.roll(x, -1, axis=0)
        u = x @ self.model.contact_here.T + beyond @ self.model.contact_next.T
        kinetic = np.sum(v * (v @ self.model.M))
        elastic = np.sum(x * (x @ self.model.K0)) + 2.0 * np.sum(x * (beyond @ self.model.Kp.T))
        return 0.5 * float(kinetic + elastic + np.sum(self.stiffness * u**2))


def keeps_sticking(
    start: Start, fits: Callable[[Real, Real], bool], is_over: Callable[[float], bool]
) -> bool:
    """Return whether the transient ends without a slip, as far as bounded work can tell.

    Parameters
    ----------
    start : where it begins.
    fits : whether motions of all ports away from the response, (n, sectors, n_ports) [m], at the angles (n,)
        of a period keep every contact stuck.
    is_over : whether an energy [J] is too small for a slip.
    """
    sectors, n = start.x.shape
    if sectors * n > LARGEST:
        return False
    generator, ports = _whole(start)
    fastest = float(np.abs(np.linalg.eigvals(generator)).max())
    count = max(128, math.ceil(2.0 * math.pi * fastest / _TURN))
    if count > _MOST_INSTANTS:
        return False
    from scipy.linalg import expm  # most responses never come here, and it takes long to import

    rows = _rows(expm(2.0 * math.pi / count * generator), ports, count)
    over_a_period = expm(2.0 * math.pi * generator)
    tau = 2.0 * math.pi / count * np.arange(count, dtype=np.float64)
    state = -np.concatenate([start.x.ravel(), start.v.ravel() / start.omega])

    def over(state: Real) -> bool:
        x, v = state.reshape(2, sectors, n)
        return is_over(start.distance(x, v * start.omega))

    periods = min(_MOST_PERIODS, _MOST_PRODUCTS // rows.size)
    # The energy never grows: what is not over at the end is so at no instant before.
    if not over(np.linalg.matrix_power(over_a_period, periods) @ state):
        return False
    for _ in range(periods):
        if not fits((rows @ state).reshape(count, sectors, -1), tau):
            return False
        state = over_a_period @ state
        if over(state):
            return True
    return False


def _whole(start: Start) -> tuple[Real, Real]:
    """Return the matrix of the decay by τ and the ports, (sectors · n_ports, 2 sectors · n)."""
    model, (sectors, n) = start.model, start.x.shape
    here, beyond = np.eye(sectors), np.roll(np.eye(sectors), 1, axis=1)
    L = np.kron(here, model.contact_here) + np.kron(beyond, model.contact_next)

    def whole(own: Real, coupling: Real) -> Real:
        return np.asarray(np.kron(here, own) + np.kron(beyond, coupling) + np.kron(beyond.T, coupling.T))

    K = whole(model.K0, model.Kp) + L.T @ (np.tile(start.stiffness, sectors)[:, None] * L)
    C = whole(model.C0, model.Cp)
    inverse = np.kron(here, np.linalg.inv(model.M))
    size = sectors * n
    generator = np.zeros((2 * size, 2 * size))
    generator[:size, size:] = np.eye(size)
    generator[size:, :size] = -inverse @ K / start.omega**2
    generator[size:, size:] = -inverse @ C / start.omega
    return generator, np.hstack([L, np.zeros_like(L)])


def _rows(step: Real, ports: Real, count: int) -> Real:
    """Return ports · stepⁱ for i = 0 … count − 1, (count · n_ports, size)."""
    rows = ports
    powers = step
    while len(rows) < count * len(ports):
        rows = np.vstack([rows, rows @ powers])
        powers = powers @ powers
    return rows[: count * len(ports)]
