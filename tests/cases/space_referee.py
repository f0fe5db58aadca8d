"""Friction in two directions under a circular limit, integrated by SciPy: shares nothing with the kernels.

The motion is given; sticks end where a root finder on a fine grid says so, slips are an initial value problem
of the force's direction (DOP853) that ends where its rate of slip is 0, Fourier integrals
included.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

TURN = 2.0 * math.pi
GRID = 6000
EDGE = 1e-9  # rad: where the limit is 0 the direction's equation has a pole, which is left out
GAUSS = np.polynomial.legendre.leggauss(40)


@dataclass(frozen=True, kw_only=True)
class Contact:
    """A contact in space: stiffnesses, friction, and the given motions (3, n) and load (3,)."""

    k1: float
    k2: float
    mu: float
    kn: float
    U: np.ndarray
    load: np.ndarray

    def basis(self, tau: float, order: int = 0) -> np.ndarray:
        H = (self.U.shape[1] - 1) // 2
        k = np.arange(1, H + 1)
        out = np.zeros(2 * H + 1)
        shift = order * math.pi / 2.0
        out[0] = 1.0 if order == 0 else 0.0
        out[1::2], out[2::2] = k**order * np.cos(k * tau + shift), k**order * np.sin(k * tau + shift)
        return out

    def motion(self, tau: float, order: int = 0) -> np.ndarray:
        return self.U[:2] @ self.basis(tau, order)

    def normal(self, tau: float, order: int = 0) -> float:
        v = self.U[2] @ self.basis(tau, order) if len(self.U) > 2 else 0.0
        shift = order * math.pi / 2.0
        mean = self.load[0] if order == 0 else 0.0
        return (
            mean + self.load[1] * math.cos(tau + shift) + self.load[2] * math.sin(tau + shift) + self.kn * v
        )

    @property
    def K(self) -> np.ndarray:
        return np.array([self.k1, self.k2])


@dataclass
class _March:
    contact: Contact
    F: np.ndarray
    slipped: bool = False

    def stick(self, begin: float, end: float, t: np.ndarray) -> tuple[float, np.ndarray, bool]:
        """From `begin` to where the limit is reached: place, force there, whether it slips then."""
        c = self.contact
        offset = t - c.K * c.motion(begin)

        def excess(tau: float) -> float:
            return float(np.hypot(*(offset + c.K * c.motion(tau))) - c.mu * c.normal(tau))

        places = begin + np.linspace(0.0, 1.0, max(int(GRID * (end - begin) / TURN), 60)) * (end - begin)
        at, slips = end, False
        for a, b in pairwise(places):
            if excess(b) <= 1e-13 * c.mu * abs(c.load).sum():
                continue
            at, slips = begin, True
            # At the limit from the begin: it has to fall below before it can reach it again.
            inside = [a] if a > begin else [begin + (b - begin) * 0.5**p for p in range(40)]
            inside = [x for x in inside if excess(x) < 0.0]
            if inside:
                at = brentq(excess, max(inside), b, xtol=1e-15, rtol=1e-15)
            break
        self.gather(begin, at, lambda tau: offset + c.K * c.motion(tau))
        return at, offset + c.K * c.motion(at), slips

    def gather(self, begin: float, end: float, force: Callable[[float], np.ndarray]) -> None:
        parts = max(1, int((end - begin) / 0.3))
        edges = np.linspace(begin, end, parts + 1)
        for a, b in pairwise(edges):
            for x, w in zip(*GAUSS, strict=True):
                tau = 0.5 * (a + b) + 0.5 * (b - a) * x
                self.F += 0.5 * (b - a) * w / math.pi * np.outer(force(tau), self.contact.basis(tau))

    def slip(self, begin: float, end: float, theta: float) -> tuple[float, float, bool]:
        c = self.contact
        self.slipped = True
        n = c.U.shape[1]

        def rates(tau, state):
            d, s, e = c.motion(tau, 1), math.sin(state[0]), math.cos(state[0])
            L, dL = c.mu * c.normal(tau), c.mu * c.normal(tau, 1)
            lam = (c.k1 * d[0] * e + c.k2 * d[1] * s - dL) / (c.k1 * e * e + c.k2 * s * s)
            turn = (c.k2 * (d[1] - lam * s) * e - c.k1 * (d[0] - lam * e) * s) / L
            basis = c.basis(tau) * L / math.pi
            return np.concatenate([[turn], e * basis, s * basis])

        def rate_of_slip(tau, state):
            d = c.K * c.motion(tau, 1)
            return d[0] * math.cos(state[0]) + d[1] * math.sin(state[0]) - c.mu * c.normal(tau, 1)

        rate_of_slip.terminal, rate_of_slip.direction = True, -1
        start = np.concatenate([[theta], np.zeros(2 * n)])
        done = solve_ivp(
            rates, (begin, end), start, method="DOP853", rtol=1e-12, atol=1e-13, events=rate_of_slip,
            max_step=0.1,
        )  # fmt: skip
        self.F += done.y[1:, -1].reshape(2, n)
        return done.t[-1], done.y[0, -1], done.status == 1

    def run(
        self, begin: float, end: float, t: np.ndarray, theta: float | None
    ) -> tuple[np.ndarray, float | None]:
        c = self.contact
        tau = begin
        for _ in range(400):
            if tau >= end - 1e-14:
                return t, theta
            if theta is None:
                tau, t, slips = self.stick(tau, end, t)
                if slips:
                    theta = math.atan2(t[1], t[0])
            else:
                tau, theta_end, sticks = self.slip(tau, end, theta)
                t = c.mu * c.normal(tau) * np.array([math.cos(theta_end), math.sin(theta_end)])
                theta = None if sticks else theta_end
        raise AssertionError("too many events")


def _contact_intervals(c: Contact) -> list[tuple[float, float]] | None:
    grid = TURN * np.arange(GRID + 1) / GRID
    N = np.array([c.normal(tau) for tau in grid])
    if N.min() > 0.0:
        return None
    up = [i for i in range(GRID) if N[i] <= 0.0 < N[i + 1]]
    ends = []
    for i in up:
        begin = brentq(c.normal, grid[i], grid[i + 1], xtol=1e-15, rtol=1e-15)
        j = i + 1
        while c.normal(grid[(j + 1) % GRID]) > 0.0:
            j += 1
        at = TURN * j / GRID
        ends.append((begin, brentq(c.normal, at, at + TURN / GRID, xtol=1e-15, rtol=1e-15)))
    return ends


def _onset(c: Contact, tau: float) -> float | None:
    """Direction of the slip with which contact begins, None where it sticks."""
    pull, rise = c.K * c.motion(tau, 1), c.mu * c.normal(tau, 1)
    if np.hypot(*pull) <= rise:
        return None

    def length(rate: float) -> float:
        return float(np.hypot(*(pull / (rise + c.K * rate))) - 1.0)

    rate = brentq(length, 0.0, 1e3 * np.hypot(*pull) / c.K.min(), xtol=1e-16, rtol=1e-15)
    n = pull / (rise + c.K * rate)
    return math.atan2(n[1], n[0])


def friction(c: Contact, periods: int = 60) -> np.ndarray:
    """Coefficients (2, n) of the friction force, from the unloaded state."""
    n = c.U.shape[1]
    intervals = _contact_intervals(c)
    if intervals is not None:
        march = _March(c, np.zeros((2, n)))
        for begin, end in intervals:
            theta = _onset(c, begin)
            shift = 0.0 if theta is None else EDGE
            march.run(begin + shift, end - EDGE, np.zeros(2), theta)
        march.F[:, 0] *= 0.5
        return march.F
    t, theta = c.K * c.motion(0.0), None
    limit = c.mu * c.normal(0.0)
    if np.hypot(*t) > limit:
        t = t * limit / np.hypot(*t)
        theta = math.atan2(t[1], t[0])
        pull = c.K * c.motion(0.0, 1)
        if pull @ t / limit < c.mu * c.normal(0.0, 1):
            theta = None
    for _ in range(periods):
        before = t
        march = _March(c, np.zeros((2, n)))
        t, theta = march.run(0.0, TURN, t, theta)
        if not march.slipped or np.abs(t - before).max() < 3e-12 * limit:
            march.F[:, 0] *= 0.5
            return march.F
    raise AssertionError("does not repeat")
