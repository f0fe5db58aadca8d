"""The way from rest to a response in which every contact sticks: a linear transient, followed to its end.

With all contacts stuck and closed the motion from rest differs from the response by a free decay of

    M Δẍ + C Δẋ + K_s Δx = 0,  Δx(0) = −x(0),  Δẋ(0) = −ẋ(0),

until the first contact slips, if one does. In an annulus it falls into nodal diameters, in each of them into
modes e^{λτ} that decay, so that it is exact at every instant looked at, and from any period on a motion of a
port is at most the sum of the amplitudes of its modes there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.jit.fourier import Complex, Real
from solver.linear.model import LinearModel

LARGEST = 400  # coordinates of the annulus: above, the modes would cost more than the response
_TURN = 0.1  # rad of the fastest motion from instant to instant
_MOST_INSTANTS = 4096
_MOST_PERIODS = 3000
_MOST_PRODUCTS = 200_000_000  # multiplications of all periods, were there no nodal diameters
# Condition of the modes above which they do not span what moves; of a pair of equal modes it is 1e8.
_WORST = 1e10
_GROWS = 1e-9  # of a mode's speed: a rate of growth below is rounding
_ROUNDING = 1e-6  # of a bound, for what rounding leaves


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Rest, as seen from the response at τ = 0, over all sectors."""

    model: Annotated[LinearModel, "The structure."]
    stiffness: Annotated[Real, "Of the ports of what sticks [N/m], 0 elsewhere, (n_ports,)."]
    x: Annotated[Real, "Displacements of the response [m], (sectors, n)."]
    v: Annotated[Real, "Its velocities [m/s], (sectors, n)."]
    omega: Annotated[float, "[rad/s]."]

    def distance(self, x: Real, v: Real) -> float:
        """Return the energy of displacements and velocities (sectors, n) [J]."""
        beyond = np.roll(x, -1, axis=0)
        u = x @ self.model.contact_here.T + beyond @ self.model.contact_next.T
        K, _, M = self.model.at(np.arange(len(x)), np.zeros(len(x), np.bool_))
        xs, vs = np.fft.fft(x, axis=0), np.fft.fft(v, axis=0)
        kinetic = np.einsum("si,sij,sj->", vs.conj(), M, vs).real / len(x)
        elastic = np.einsum("si,sij,sj->", xs.conj(), K, xs).real / len(x)
        return 0.5 * float(kinetic + elastic + np.sum(self.stiffness * u**2))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Transient:
    """What is left of the start, in the modes of every nodal diameter; 2 n of them in each."""

    rates: Annotated[Complex, "λ by τ, (sectors, 2 n)."]
    amplitudes: Annotated[Complex, "Of the modes at the beginning of a period, (sectors, 2 n)."]
    ports: Annotated[Complex, "Their motions of the ports of sector 0, (sectors, n_ports, 2 n)."]

    @classmethod
    def of(cls, start: Start) -> _Transient | None:
        """Return the transient at its beginning; None if its modes do not span it, or one of them grows."""
        ns = np.arange(len(start.x))
        model, omega = start.model, start.omega
        L = model.ports_at(ns)
        K, C, M = model.at(ns, np.zeros(ns.size, np.bool_))
        K = K + np.swapaxes(L.conj(), 1, 2) @ (start.stiffness[:, None] * L)
        inverse, n = np.linalg.inv(M), start.x.shape[1]
        generator = np.zeros((ns.size, 2 * n, 2 * n), np.complex128)
        generator[:, :n, n:] = np.eye(n)
        generator[:, n:, :n], generator[:, n:, n:] = -inverse @ K / omega**2, -inverse @ C / omega
        state = -np.fft.fft(np.hstack([start.x, start.v / omega]), axis=0) / ns.size
        try:
            rates, modes = np.linalg.eig(generator.real if ns.size == 1 else generator)
            duals = np.linalg.inv(modes)
        except np.linalg.LinAlgError:
            return None
        condition = np.linalg.norm(modes, axis=(1, 2)) * np.linalg.norm(duals, axis=(1, 2))
        if not np.all(condition <= _WORST) or np.any(rates.real > _GROWS * np.abs(rates)):
            return None
        return cls(
            rates=np.minimum(rates.real, 0.0) + 1j * rates.imag,
            amplitudes=(duals @ state[..., None])[..., 0],
            ports=L @ modes[:, :n],
        )  # fmt: skip

    def later(self, periods: int) -> _Transient:
        """Return the same some periods on."""
        return replace(self, amplitudes=self.amplitudes * np.exp(2.0 * math.pi * periods * self.rates))

    def bound(self) -> Real:
        """Return what a port of any sector moves at most, now and later, (n_ports,) [m]."""
        largest = np.einsum("spm,sm->p", np.abs(self.ports), np.abs(self.amplitudes))
        return np.asarray((1.0 + _ROUNDING) * largest)

    def motions(self, over_a_period: Complex) -> Real:
        """Return the motions of all ports, (count, sectors, n_ports) [m], at the instants of e^{λτ} given."""
        moved = (over_a_period * self.amplitudes[:, None]) @ np.swapaxes(self.ports, 1, 2)
        return np.swapaxes(len(moved) * np.fft.ifft(moved, axis=0).real, 0, 1)


def keeps_sticking(start: Start, fits: Callable[[Real, Real], bool], holds: Callable[[Real], bool]) -> bool:
    """Return whether the transient ends without a slip, as far as bounded work can tell.

    Parameters
    ----------
    start : where it begins.
    fits : whether motions of all ports away from the response, (n, sectors, n_ports) [m], at the angles (n,)
        of a period keep every contact stuck.
    holds : whether every contact sticks at any instant whose motions of the ports of its sector, (n_ports,)
        [m], are at most these.
    """
    sectors, n = start.x.shape
    transient = _Transient.of(start) if sectors * n <= LARGEST else None
    if transient is None:
        return False
    if holds(transient.bound()):
        return True
    count = max(128, math.ceil(2.0 * math.pi * float(np.abs(transient.rates).max()) / _TURN))
    if count > _MOST_INSTANTS:
        return False
    size = count * sectors * start.stiffness.size * 2 * sectors * n
    periods = _first(transient, holds, min(_MOST_PERIODS, _MOST_PRODUCTS // max(size, 1)))
    if periods is None:
        return False
    tau = 2.0 * math.pi / count * np.arange(count, dtype=np.float64)
    over_a_period = np.exp(transient.rates[:, None] * tau[:, None])
    return all(fits(transient.later(i).motions(over_a_period), tau) for i in range(periods))


def _first(transient: _Transient, holds: Callable[[Real], bool], most: int) -> int | None:
    """Return the number of periods from which on no contact can slip; None if `most` are not enough.

    What a port moves at most only falls.
    """
    if not holds(transient.later(most).bound()):
        return None
    low, high = 0, most
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(transient.later(middle).bound()) else (middle, high)
    return high
