"""Contacts for the kernel's tests: a way to call it, random ones, and a crude march to judge it by."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numba
import numpy as np

from solver.contacts.kernels import stick_slip_events as events
from solver.contacts.kernels.coulomb.line_force import contact_force
from solver.contacts.kernels.stick_slip_events import new_segments
from solver.jit import fourier
from solver.jit.trig_polynomial import grid_size, grid_tables

STATES = {0: "separated", 1: "stuck", 2: "slipping", 3: "lifting"}


@dataclass(frozen=True, kw_only=True)
class Case:
    """One contact: slip motion and load as full coefficients, stiffness and friction."""

    U: np.ndarray
    N: np.ndarray
    kt: float
    mu: float

    @property
    def n_harmonics(self) -> int:
        return (self.U.size - 1) // 2

    @property
    def scale(self) -> float:
        """Size of the largest force the law allows."""
        limit = self.mu * (self.N[0] + np.hypot(self.N[1::2], self.N[2::2]).sum())
        motion = self.kt * (abs(self.U[0]) + np.hypot(self.U[1::2], self.U[2::2]).sum())
        return float(min(limit, 2.0 * motion))


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What the kernel gives, and the segments it went through."""

    F: np.ndarray
    dF_dU: np.ndarray
    dF_dkt: np.ndarray
    dF_dmu: np.ndarray
    dF_dN: np.ndarray
    state: str
    segments: np.ndarray

    @property
    def pattern(self) -> tuple[object, ...]:
        """State and kinds of all segments in cyclic order: the same on one smooth piece of the law.

        A segment as short as rounding (the period need not close on itself to the last bit) does not count.
        """
        real = self.segments[self.segments["end"] - self.segments["begin"] > 1e-11]
        kinds = real[["motion", "began", "direction"]].tolist()
        rows = [
            (motion, began, direction * (began == events.AFTER_SLIP)) for motion, began, direction in kinds
        ]
        turns = [tuple(rows[i:] + rows[:i]) for i in range(len(rows))]
        return (self.state, min(turns, default=()))


@cache
def tables(n_harmonics: int) -> tuple[np.ndarray, np.ndarray]:
    return grid_tables(grid_size(n_harmonics), n_harmonics)


def evaluate(case: Case) -> Answer:
    """Call the kernel."""
    n, m, top = case.U.size, case.N.size, max(case.n_harmonics, (case.N.size - 1) // 2)
    segments = new_segments(top)
    F, dF_dkt, dF_dmu = np.zeros(n), np.zeros(n), np.zeros(n)
    dF_dU, dF_dN = np.zeros((n, n)), np.zeros((n, m))
    state, count = contact_force(
        case.U, fourier.all_harmonics(case.n_harmonics), case.N, fourier.all_harmonics((m - 1) // 2), case.kt,
        case.mu, *tables(top), segments, dF_dU, dF_dkt, dF_dmu, dF_dN, F,
    )  # fmt: skip
    assert state != events.FAILED
    return Answer(
        F=F, dF_dU=dF_dU, dF_dkt=dF_dkt, dF_dmu=dF_dmu, dF_dN=dF_dN, state=STATES[state],
        segments=segments[:count].copy(),
    )  # fmt: skip


def random_case(rng: np.random.Generator, most_harmonics: int = 21) -> Case:
    """Return a contact of any kind: kt over six decades, mu over three, load with 1 to 4 harmonics."""
    H, load_harmonics = int(rng.integers(1, most_harmonics + 1)), int(rng.integers(1, 5))
    decay = np.repeat(np.arange(1, H + 1.0) ** -rng.uniform(0.5, 3.0), 2)
    U = np.concatenate([[rng.normal()], rng.normal(size=2 * H) * decay])
    N = np.concatenate([[1.0], rng.normal(size=2 * load_harmonics)])
    N[1:] *= 10.0 ** rng.uniform(-2.0, 0.5) / np.hypot(N[1::2], N[2::2]).sum()
    if rng.uniform() < 0.03:
        N[0] = -3.5
    mu, kt = 10.0 ** rng.uniform(-2.0, 1.0), 10.0 ** rng.uniform(1.0, 7.0)
    N *= 10.0 ** rng.uniform(0.0, 3.0)
    # Not always far beyond the limit: the motion is sized by the slip at which it is reached.
    U *= mu * abs(N[0]) / kt * 10.0 ** rng.uniform(-1.0, 2.5) / np.abs(U[1:]).max()
    return Case(U=U, N=N, kt=kt, mu=mu)


def closing_cases(rng: np.random.Generator) -> Iterator[Case]:
    """Yield contacts that stick or slip at once as they close, and slip briefly within a grid interval.

    With friction μ the function that reaches 0 where the limit does begins with slope 0, curved upward, and
    turns down again soon.
    """
    H, fall = int(rng.choice([3, 7, 11, 21, 41])), rng.uniform(0.0, 2.5)
    U = np.concatenate([[0.0], rng.normal(size=2 * H) * np.repeat(np.arange(1.0, H + 1) ** -fall, 2)])
    ratio = rng.uniform(1.05, 10.0)
    rate_n, soon = np.sqrt(ratio**2 - 1.0), 10.0 ** rng.uniform(-3.0, -0.5) * 2.0 * np.pi / grid_size(H)
    rate = fourier.derivative(U)
    tau = np.linspace(0.0, 2.0 * np.pi, 4001)
    along, bend = values(rate, tau), values(fourier.derivative(rate), tau)
    curve = np.sign(along) * bend - np.abs(along) / rate_n  # of kt |u| − μ N where N = 0, at the critical μ
    for i in np.flatnonzero((curve[:-1] > 0.0) & (curve[1:] < 0.0) & (along[:-1] * along[1:] > 0.0)):
        closes = tau[i] + (tau[1] - tau[0]) * curve[i] / (curve[i] - curve[i + 1]) - soon
        phase = closes + np.arccos(-1.0 / ratio)
        N = np.array([1.0, ratio * np.cos(phase), ratio * np.sin(phase)])
        yield Case(U=U, N=N, kt=1.0, mu=abs(values(rate, np.array([closes]))[0]) / rate_n)


def values(coefficients: np.ndarray, tau: np.ndarray) -> np.ndarray:
    return fourier.basis(tau, (coefficients.size - 1) // 2) @ coefficients


def load_zeros(N: np.ndarray) -> np.ndarray:
    """Return where the load crosses 0, from the roots of the polynomial in e^{i tau}."""
    amplitudes = fourier.to_complex(N)
    positive = amplitudes[1:] / 2.0
    roots = np.roots(np.concatenate([positive[::-1], [amplitudes[0]], positive.conj()]))
    return np.sort(np.angle(roots[np.abs(np.abs(roots) - 1.0) < 1e-9]) % (2.0 * np.pi))


@numba.njit
def _return_map(u: np.ndarray, limit: np.ndarray, kt: float, f: np.ndarray) -> None:
    """March the law sample by sample, two periods, from the unloaded state."""
    n = u.size
    f[0] = min(max(kt * u[0], -limit[0]), limit[0])
    now = f[0]
    for j in range(1, 2 * n):
        i, before = j % n, (j - 1) % n
        now = min(max(now + kt * (u[i] - u[before]), -limit[i]), limit[i])
        f[i] = now


def crude_force(case: Case, samples: int) -> np.ndarray:
    """Return force coefficients by a return map on a fine grid and the trapezoidal rule.

    The zeros of the load are samples too, so that the error is of second order in the step everywhere.
    """
    grid = 2.0 * np.pi / samples * np.arange(samples)
    extra = load_zeros(case.N)
    tau = np.concatenate([grid, extra])
    order = np.argsort(tau, kind="stable")
    u, load = (np.concatenate([_on_grid(q, samples), values(q, extra)])[order] for q in (case.U, case.N))
    f = np.empty(tau.size)
    _return_map(u, case.mu * np.maximum(load, 0.0), case.kt, f)
    tau = tau[order]
    gap = np.diff(np.concatenate([tau, [tau[0] + 2.0 * np.pi]]))
    weighted = np.empty(tau.size)
    weighted[order] = f * 0.5 * (gap + np.roll(gap, 1))
    H = case.n_harmonics
    spectrum = np.fft.rfft(weighted[:samples])[: H + 1] / np.pi
    F = fourier.to_real(spectrum) + fourier.basis(extra, H).T @ weighted[samples:] / np.pi
    F[0] *= 0.5
    return F


def _on_grid(coefficients: np.ndarray, samples: int) -> np.ndarray:
    spectrum = np.zeros(samples // 2 + 1, dtype=np.complex128)
    amplitudes = fourier.to_complex(coefficients)
    spectrum[: amplitudes.size] = 0.5 * amplitudes * samples
    spectrum[0] *= 2.0
    return np.fft.irfft(spectrum, samples)


def central_difference(function: Callable[[float], np.ndarray | None], step: float) -> np.ndarray | None:
    """Return Richardson's central difference at 0, or None where the function leaves its smooth piece."""
    sides = [function(x) for x in (step, -step, step / 2, -step / 2)]
    if any(side is None for side in sides):
        return None
    wide, narrow = (sides[0] - sides[1]) / (2 * step), (sides[2] - sides[3]) / step
    return (4.0 * narrow - wide) / 3.0


def derivative_errors(case: Case, relative_step: float = 1e-5) -> dict[str, float] | None:
    """Return the relative error of every derivative of the kernel against central differences.

    None if the law changes its smooth piece within the steps.
    """
    here = evaluate(case)

    def along(**change: np.ndarray | float) -> np.ndarray | None:
        def force(x: float) -> np.ndarray | None:
            moved = evaluate(replace(case, **{key: getattr(case, key) + x * d for key, d in change.items()}))
            return moved.F if moved.pattern == here.pattern else None

        size = max(np.abs(getattr(case, key)).max() / np.abs(d).max() for key, d in change.items())
        return central_difference(force, relative_step * size)

    differences = {
        "dF_dU": [along(U=row) for row in np.eye(case.U.size)],
        "dF_dN": [along(N=row) for row in np.eye(case.N.size)],
        "dF_dkt": [along(kt=1.0)],
        "dF_dmu": [along(mu=1.0)],
    }
    errors = {}
    for name, columns in differences.items():
        if any(column is None for column in columns):
            return None
        exact, difference = getattr(here, name).reshape(case.U.size, -1), np.array(columns).T
        size = np.abs(difference).max()
        errors[name] = float(np.abs(exact - difference).max() / size) if size > 0.0 else 0.0
    return errors
