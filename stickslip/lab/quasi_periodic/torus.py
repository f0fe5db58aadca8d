"""Motions on the torus of two frequencies, as sums of waves read off balances of long periods."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solver.arrays import Real
from solver.balance.balance import Balance
from solver.scene.scene_harmonics import Amplitudes
from solver.jit import fourier
from solver.jit.fourier import Complex, Flags, Integer
from solver.response.solution import Solution

_GRID = 256  # angles of a turn at which the extremes are compared


@dataclass(frozen=True, slots=True)
class Torus:
    """A motion x(θ₁, θ₂) = mean + Re Σ c exp(i (k θ₁ + l θ₂)), n sums."""

    k: Integer
    l: Integer  # noqa: E741 (the letter of the field)
    c: Complex
    mean: float

    def at(self, first: Real, second: Real) -> Real:
        """Return x at pairs of angles, (m,)."""
        waves = np.exp(1j * (np.outer(first, self.k) + np.outer(second, self.l)))
        return np.asarray(self.mean + (waves @ self.c).real)

    def low(self, turns: tuple[int, int]) -> Flags:
        """Return of which waves a curve of so many turns tells what they are beside it, (n,)."""
        return np.abs(self.k) + np.abs(self.l) <= sum(turns) // 4

    def sizes(self) -> Real:
        """Return max|x| and (max x - min x) / 2 of all its waves on an even grid of both angles."""
        grid = np.zeros((_GRID, _GRID), complex)
        np.add.at(grid, (self.k % _GRID, self.l % _GRID), self.c)
        x = self.mean + np.fft.ifft2(grid).real * grid.size
        return np.array([np.abs(x).max(), 0.5 * np.ptp(x)])

    def beside(self, other: Torus, share: float) -> Torus:
        """Return the motion between this one (share 0) and another one (share 1)."""
        found: dict[tuple[int, int], complex] = {}
        for each, weight in ((self, 1.0 - share), (other, share)):
            for k, l, c in zip(each.k.tolist(), each.l.tolist(), each.c.tolist(), strict=True):  # noqa: E741
                found[k, l] = found.get((k, l), 0.0) + weight * c
        k, l = np.array(list(found), np.int64).reshape(-1, 2).T  # noqa: E741
        mean = (1.0 - share) * self.mean + share * other.mean
        return Torus(k, l, np.array(list(found.values()), np.complex128), mean)


NOWHERE = Torus(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0, np.complex128), math.nan)


@dataclass(frozen=True, slots=True)
class ContactMotions:
    """The slip motions of a long period as waves on the torus, from which another one can begin."""

    k: Integer
    l: Integer  # noqa: E741 (the letter of the field)
    u: Complex  # (nc, n) amplitudes

    @classmethod
    def of(cls, u: Real, balance: Balance, p: int, q: int) -> ContactMotions:
        """Return those of unknowns (n_unknowns,) of p and q turns."""
        ks = balance.system.ks
        k, l = _sums(ks, p, q, int(ks[-1]) + 1)  # noqa: E741
        return cls(k, l, Amplitudes(balance.system.ks).of(u.reshape(-1, balance.n_coefficients)))

    def guess(self, balance: Balance, p: int, q: int) -> Real:
        """Return the unknowns of p and q turns: waves whose sum is no harmonic kept are left out."""
        amplitudes = Amplitudes(balance.system.ks)
        place = {n: i for i, n in enumerate(balance.system.ks.tolist())}
        found = np.zeros((len(self.u), len(place)), np.complex128)
        for n, c in zip((self.k * p + self.l * q).tolist(), self.u.T, strict=True):
            if abs(n) in place:
                found[:, place[abs(n)]] += c if n >= 0 else c.conj()
        return amplitudes.coefficients(found).reshape(-1)


def torus_of(found: Solution, p: int, q: int) -> Torus:
    """Read the motion of p and q turns as one on the torus: each harmonic is the sum of the least order."""
    amplitudes = fourier.to_complex(found.observed)
    n = np.flatnonzero(amplitudes)
    n = n[n > 0]
    return Torus(*_sums(n, p, q, amplitudes.size), amplitudes[n], float(amplitudes[0].real))


def _sums(n: Integer, p: int, q: int, count: int) -> tuple[Integer, Integer]:
    """Return k and l of the sums k p + l q of least order that are harmonics n below `count`, (m,) each."""
    inverse = pow(q, -1, p) if p > 1 else 0
    reach = math.ceil(count / (p * q)) + 1
    every = (n * inverse % p)[:, None] + p * np.arange(-reach, reach + 1)
    firsts = (n[:, None] - every * q) // p
    best = np.argmin(np.abs(every) + np.abs(firsts), axis=1)
    rows = np.arange(n.size)
    return firsts[rows, best], every[rows, best]


def sizes_on(found: Solution, torus: Torus, turns: tuple[int, int], *, repeats: bool) -> tuple[float, float]:
    """Return max|x| and half peak to peak on the torus, of what they are on the curve of a long period.

    The curve passes by the places where waves of low orders are largest together: by how much those are
    larger on the torus than on the curve is known of these waves, on even grids.
    """
    if repeats:
        return found.max_abs, found.half_peak_to_peak
    low = torus.low(turns)
    k, l, c = torus.k[low], torus.l[low], torus.c[low]  # noqa: E741
    grid, line = np.zeros((_GRID, _GRID), complex), np.zeros(_GRID * max(turns), complex)
    np.add.at(grid, (k % _GRID, l % _GRID), c)
    np.add.at(line, k * turns[0] + l * turns[1], c)
    everywhere, along = np.fft.ifft2(grid).real * grid.size, np.fft.ifft(line).real * line.size
    above, below = max(everywhere.max() - along.max(), 0.0), max(along.min() - everywhere.min(), 0.0)
    upward = torus.mean + everywhere.max() >= -torus.mean - everywhere.min()
    return found.max_abs + (above if upward else below), found.half_peak_to_peak + 0.5 * (above + below)
