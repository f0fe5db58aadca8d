"""The amplitude at given frequencies, each solved by itself: the points brute force is made of.

The motion is found from the matrices of all degrees of freedom under the contacts' forces, and its largest
value by samples and Newton's method, in numpy: of the solver there are the forces of the contacts alone.
"""

import math
from typing import NamedTuple

import numpy as np

from solver import Scene
from solver.balance.balance import build
from solver.balance.kernels.newton import newton
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import evaluation_by_value
from solver.jit.fourier import Complex, Real, to_complex, to_full
from solver.linear.condensation import force_amplitudes
from solver.linear.kernels.receptance import receptance
from solver.linear.model import LinearModel
from solver.response.time_history import matrices

SAMPLES = 256  # instants of a period at least
STEPS = 12  # of a walk from a known solution to another frequency, at most


class Known(NamedTuple):
    """A solution at a frequency [Hz]."""

    hz: float
    u: Real


class PointSolver:
    """max|x| at given frequencies, each solved by itself."""

    def __init__(self, scene: Scene, harmonics: int) -> None:
        self.workspace = Workspace.of(build(scene, harmonics=harmonics))
        balance = self.workspace.balance
        self.model: LinearModel = balance.model
        self.ks = balance.system.ks
        self.harmonics = harmonics
        self.solved = 0
        self._F = evaluation_by_value(self.workspace.point).F  # of the last solve
        self._parts = [matrices(self.model, int(k)) for k in self.ks]
        self._forces = force_amplitudes(self.model, self.ks)
        self._hz, self._u = np.zeros(0), np.zeros((0, balance.n_unknowns))

    def amplitudes(self, hz: Real) -> Real:
        """max|x| [m] at frequencies in ascending order, NaN where no solution was found."""
        balance = self.workspace.balance
        forces = np.zeros((hz.size, balance.n_ports, balance.n_coefficients))
        us, good = np.zeros((hz.size, balance.n_unknowns)), np.ones(hz.size, bool)
        before: Known | None = None
        for i, f in enumerate(hz if balance.n_unknowns else []):
            found = self._point(float(f), before)
            good[i] = found is not None
            if found is not None:
                before = Known(float(f), found)
                us[i] = found
                forces[i] = self._F
        self.solved += hz.size
        if balance.n_unknowns:
            self._remember(hz[good], us[good])
        values = self._amplitudes(hz, forces)
        values[~good] = np.nan
        return values

    def _amplitudes(self, hz: Real, forces: Real) -> Real:
        """max|x| under contact forces (points, ports, coefficients)."""
        full = to_complex(to_full(forces, self.ks, self.harmonics))[:, :, self.ks]
        return largest(self.observed(hz, full))

    def _point(self, f: float, before: Known | None) -> Real | None:
        """Solve from what is known beside it, in smaller steps if need be, at last from nothing."""
        i = int(np.searchsorted(self._hz, f))
        left = Known(float(self._hz[i - 1]), self._u[i - 1]) if i else before
        if left is not None and before is not None and before.hz > left.hz:
            left = before
        right = Known(float(self._hz[i]), self._u[i]) if i < self._hz.size else None
        near = [one for one in (left, right) if one is not None]
        near.sort(key=lambda one: abs(one.hz - f))
        if left is not None and right is not None:
            share = (f - left.hz) / (right.hz - left.hz) if right.hz > left.hz else 0.0
            found = self._newton(f, left.u + share * (right.u - left.u))
            if found is not None:
                return found
        for one in near:
            found = self._in_steps(one, f)
            if found is not None:
                return found
        nothing = self.workspace.solve(2.0 * math.pi * f)
        return nothing.u.copy() if nothing.converged else None

    def _in_steps(self, known: Known, f: float) -> Real | None:
        """Walk from a known solution to a frequency, a smaller step wherever Newton's method fails."""
        step, steps = f - known.hz, 0
        before: Known | None = None
        while steps < STEPS:
            steps += 1
            at = f if abs(f - known.hz) <= abs(step) * 1.000001 else known.hz + step
            guess = known.u
            if before is not None:
                guess = known.u + (at - known.hz) / (known.hz - before.hz) * (known.u - before.u)
            found = self._newton(at, guess)
            if found is None:
                step *= 0.25
                continue
            if at == f:
                return found
            before, known = known, Known(at, found)
            step *= 2.0
        return None

    def _newton(self, f: float, guess: Real) -> Real | None:
        u, p, workspace = guess.copy(), 2.0 * math.pi * f, self.workspace
        receptance(workspace.system, p, workspace.linear)
        good, _, _ = newton(workspace.system, workspace.linear, u, p, 0.0, workspace.point)
        return u if good else None

    def from_nothing(self, hz: float) -> float:
        """max|x| [m] at one frequency with the start from nothing."""
        balance = self.workspace.balance
        if balance.n_unknowns == 0:
            return float(self.amplitudes(np.array([hz]))[0])
        found = self.workspace.solve(2.0 * math.pi * hz)
        forces = self._F.copy()
        return float(self._amplitudes(np.array([hz]), forces[None])[0]) if found.converged else math.nan

    def observed(self, hz: Real, forces: Complex) -> Complex:
        """The observed DOF, (points, H + 1) amplitudes, under contact forces (points, ports, harmonics)."""
        omega = 2.0 * math.pi * hz
        motion = np.zeros((hz.size, self.harmonics + 1), np.complex128)
        for i, k in enumerate(self.ks):
            K, C, L = self._parts[i]
            pushed = self._forces[i] - forces[:, :, i] @ L.conj()
            if not pushed.any():
                continue
            for some in np.array_split(np.arange(hz.size), 1 + hz.size * K.size // 2_000_000):
                w = (k * omega[some])[:, None, None]
                dynamic = K - w**2 * self.model.M + 1j * w * C
                x = np.linalg.solve(dynamic, pushed[some][:, :, None])[:, :, 0]
                motion[some, k] = x @ self.model.observe
        return motion

    def _remember(self, hz: Real, u: Real) -> None:
        both = np.append(self._hz, hz)
        order = np.argsort(both, kind="stable")
        self._hz, self._u = both[order], np.concatenate([self._u, u])[order]


def largest(motion: Complex) -> Real:
    """max over a period of |Re sum x_k exp(i k tau)|, for each row of (points, H + 1)."""
    if not motion[:, 1:].any():
        return np.abs(motion[:, 0].real)
    parts = np.array_split(motion, 1 + len(motion) // 2000)
    return np.concatenate([_largest(part) for part in parts])


def _largest(motion: Complex) -> Real:
    ks = np.arange(motion.shape[1])
    samples = max(SAMPLES, 32 * ks.size)
    tau = 2.0 * math.pi / samples * np.arange(samples)
    x = (motion @ np.exp(1j * np.outer(ks, tau))).real
    rows, sized = np.arange(len(motion)), np.abs(x)
    before, after = np.roll(sized, 1, axis=1), np.roll(sized, -1, axis=1)
    bend = 2.0 * sized - before - after
    top = (sized >= before) & (sized >= after) & (bend > 0.0)
    # The vertices of parabolas tell which of the local maxima is the highest.
    rise = np.where(top, (after - before) ** 2 / (8.0 * np.where(top, bend, 1.0)), 0.0)
    at = np.argmax(sized + rise, axis=1)
    angle, sign, found = tau[at], np.sign(x[rows, at]), sized[rows, at]
    for _ in range(5):
        turned = motion * np.exp(1j * angle[:, None] * ks)
        slope, bent = (1j * ks * turned).sum(axis=1).real, (-(ks**2) * turned).sum(axis=1).real
        found = np.maximum(found, sign * turned.sum(axis=1).real)
        step = np.where(sign * bent < 0.0, -slope / np.where(bent == 0.0, 1.0, bent), 0.0)
        angle = angle + np.clip(step, -tau[1], tau[1])
    return found
