"""The frequency response by brute force over points: peaks and bands that no continuation has a share in.

Every point is solved at its own frequency. The frequencies lie close where a resonance may be: round every
natural frequency, and every fraction of one, of the structure with its contacts free and with every subset of
them stuck, down to an eighth of the half width; between them the intervals are halved until an interpolation
foretells what comes. A resonance of contacts that slip lies off those frequencies by an amount its width is
proportional to (friction that moves it damps it), so the geometric spacing finds it as well.
"""

import math
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from light_points import PointSolver
from scipy import linalg

from solver import Scene
from solver.jit.fourier import Real
from solver.linear.model import LinearModel
from solver.response.time_history import matrices

BASE = 160  # points over the band, half of them evenly spaced, half of them evenly in the logarithm
WIDEST = 3e-2  # relative distance from a natural frequency at which the cluster round it ends
PER_DECADE = 3.0
WITHIN = 0.125  # of the half width: the smallest distance
FORETOLD = 2e-4  # relative error of the interpolation up to which an interval is left
FLOOR = 5e-3  # amplitudes below this share of the highest need only be known relative to it
WIDER = 2.2  # times an interval beside it: how wide an interval may be without a look at its middle
MOST_ROUNDS = 60
MOST_THIRDS = 14  # rounds in which an extreme is narrowed down
FLAT = 1e-8  # relative difference to the points beside it at which it is


@dataclass(frozen=True, slots=True, kw_only=True)
class TruePeak:
    """A local maximum of max|x| inside the band: `value` [m] at `at` [Hz].

    `prominence` is its height above the higher of the two dips that part it from what is higher, as a share
    of its value. `history` is the relative difference between solutions from different starts: above rounding
    where a contact that sticks has a mean that history decides.
    """

    value: float
    at: float
    prominence: float
    history: float


@dataclass(slots=True)
class Truth:
    """Points of a response in the order of frequency, and what follows from them.

    `unsolved` are frequencies without a solution, of those where the amplitude counts.
    """

    solver: PointSolver
    hz: Real
    amplitude: Real
    peaks: tuple[TruePeak, ...] = ()
    rounds: int = 0
    unsolved: list[float] = field(default_factory=list)

    @property
    def highest(self) -> float:
        """The highest amplitude anywhere, the ends of the band included [m]."""
        return float(self.amplitude.max())

    def band(self, limit: float) -> list[tuple[float, float]]:
        """The intervals in which max|x| > limit [Hz]."""
        return _band(self, limit)


def natural(model: LinearModel, kt: Real, ks: list[int]) -> list[tuple[float, float]]:
    """Natural frequencies [Hz] over harmonics, with half widths relative to them, whatever sticks."""
    found: list[tuple[float, float]] = []
    ports = kt.size
    subsets = [c for n in range(ports + 1) for c in combinations(range(ports), n)]
    if ports > 4:
        subsets = [(), tuple(range(ports)), *((i,) for i in range(ports))]
    seen: dict[int, list[tuple[float, float]]] = {}
    for k in ks:
        if k == 0:
            continue
        diameter = (k * model.engine_order) % model.sectors
        if diameter not in seen:
            seen[diameter] = [pair for stuck in subsets for pair in _modes(model, kt, stuck, k)]
        found.extend((hz / k, width) for hz, width in seen[diameter])
    return found


def _modes(model: LinearModel, kt: Real, stuck: tuple[int, ...], k: int) -> list[tuple[float, float]]:
    """Natural frequencies [Hz] with damping ratios, by the undamped modes."""
    K, C, L = matrices(model, k)
    held = L[list(stuck)]
    omega2, shapes = linalg.eigh(K + held.conj().T @ (kt[list(stuck)][:, None] * held), model.M)
    omega = np.sqrt(np.maximum(omega2, 0.0))
    damping = np.real(np.einsum("ij,ik,kj->j", shapes.conj(), C, shapes))
    return [
        (float(w / (2.0 * math.pi)), float(min(max(d / (2.0 * w), 1e-9), 1.0)))
        for w, d in zip(omega, damping, strict=True)
        if w > 0.0
    ]


def grid(model: LinearModel, kt: Real, ks: list[int], band: tuple[float, float]) -> Real:
    """The frequencies to begin with [Hz]."""
    low, high = band
    even, logarithmic = np.linspace(low, high, BASE // 2), np.geomspace(low, high, BASE // 2)
    points, gaps = [even, logarithmic], [np.full(even.size, even[1] - even[0]), np.gradient(logarithmic)]
    for hz, ratio in set(natural(model, kt, ks)):
        if low * (1.0 - WIDEST) <= hz <= high * (1.0 + WIDEST):
            least = min(WITHIN * ratio, WIDEST / 10.0)
            off = np.geomspace(least, WIDEST, 2 + int(PER_DECADE * math.log10(WIDEST / least)))
            points.append(hz * np.concatenate([1.0 - off, [1.0], 1.0 + off]))
            gap = off * (off[1] / off[0] - 1.0)
            gaps.append(hz * np.concatenate([gap, [least], gap]))
    every, gap = np.concatenate(points), np.concatenate(gaps)
    inside = (every >= low) & (every <= high)
    return _thinned(every[inside], gap[inside])


def _thinned(hz: Real, gap: Real) -> Real:
    """Frequencies, ascending, without those nearer to the one before than half the gap they are to leave."""
    order = np.argsort(hz, kind="stable")
    kept = [float(hz[order[0]])]
    for i in order[1:]:
        if hz[i] - kept[-1] > max(0.5 * gap[i], 1e-9 * hz[i]):
            kept.append(float(hz[i]))
    kept[-1] = float(hz[order[-1]])
    return np.array(kept)


def true_response(scene: Scene, harmonics: int) -> Truth:
    """Peaks and points of the response over the scene's band."""
    solver = PointSolver(scene, harmonics)
    kt = solver.model.port_stiffnesses if scene.contacts else np.zeros(0)
    hz = grid(solver.model, kt, [int(k) for k in solver.ks], scene.observe.band)
    truth = Truth(solver=solver, hz=hz, amplitude=solver.amplitudes(hz))
    _drop_unsolved(truth)
    _halve(truth)
    maxima = _polish(truth, _extremes(truth.amplitude), +1.0)
    truth.peaks = tuple(sorted((_peak(truth, at) for at in maxima), key=lambda peak: -peak.value))
    beside = np.interp(truth.unsolved, truth.hz, truth.amplitude)
    truth.unsolved = [hz for hz, a in zip(truth.unsolved, beside, strict=True) if a > FLOOR * truth.highest]
    return truth


def _drop_unsolved(truth: Truth) -> None:
    bad = np.isnan(truth.amplitude)
    truth.unsolved.extend(truth.hz[bad].tolist())
    truth.hz, truth.amplitude = truth.hz[~bad], truth.amplitude[~bad]


def _insert(truth: Truth, hz: Real) -> None:
    """Solve at frequencies, ascending, and sort them in."""
    hz = np.setdiff1d(hz, truth.hz)
    both = np.append(truth.hz, hz)
    order = np.argsort(both, kind="stable")
    values = np.append(truth.amplitude, truth.solver.amplitudes(hz))
    truth.hz, truth.amplitude = both[order], values[order]
    _drop_unsolved(truth)


def _halve(truth: Truth) -> None:
    """Halve intervals until their middle is foretold by the points beside it, and none is far wider."""
    fresh = np.ones(truth.hz.size - 1, bool)  # intervals not looked at, by their left end
    for truth.rounds in range(1, MOST_ROUNDS + 1):
        floor = FLOOR * truth.highest
        left = np.flatnonzero(fresh | _far_wider(truth.hz))
        left = left[truth.hz[left + 1] - truth.hz[left] > 1e-10 * truth.hz[left]]
        left = left[np.maximum(truth.amplitude[left], truth.amplitude[left + 1]) > 0.1 * floor]
        if not left.size:
            return
        middle = 0.5 * (truth.hz[left] + truth.hz[left + 1])
        guesses = _foretold(truth, left, middle)
        values = truth.solver.amplitudes(middle)
        error = np.min(np.abs(guesses - values), axis=0) / np.maximum(np.nan_to_num(values), floor)
        again = np.nan_to_num(error, nan=1.0) > FORETOLD
        marks = np.zeros(truth.hz.size, bool)
        marks[left[again]] = True
        order = np.argsort(np.append(truth.hz, middle), kind="stable")
        truth.hz = np.append(truth.hz, middle)[order]
        truth.amplitude = np.append(truth.amplitude, values)[order]
        marks = np.append(marks, again)[order]
        fresh = marks[~np.isnan(truth.amplitude)][:-1]
        _drop_unsolved(truth)


def _far_wider(hz: Real) -> np.ndarray:
    """Which intervals are far wider than one beside them: what made that one narrow may reach into them."""
    gap = np.diff(hz)
    beside = np.minimum(np.append(np.inf, gap[:-1]), np.append(gap[1:], np.inf))
    return gap > WIDER * beside


def _foretold(truth: Truth, left: np.ndarray, middle: Real) -> Real:
    """Two interpolations by cubics through four points, of log(a) and of 1/a², (2, intervals)."""
    n = truth.hz.size
    first = np.clip(left - 1, 0, n - 4)
    at = first[:, None] + np.arange(4)
    x = (truth.hz[at] - middle[:, None]) / (truth.hz[at[:, 3]] - truth.hz[at[:, 0]])[:, None]
    weights = np.ones_like(x)
    for i in range(4):
        for j in range(4):
            if i != j:
                weights[:, i] *= x[:, j] / (x[:, j] - x[:, i])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        a = truth.amplitude[at]
        by_log = np.exp((weights * np.log(a)).sum(axis=1))
        by_square = 1.0 / np.sqrt((weights / a**2).sum(axis=1))
    return np.nan_to_num(np.array([by_log, by_square]), nan=np.inf, posinf=np.inf)


def _extremes(amplitude: Real) -> np.ndarray:
    """Where a local maximum stands, of a plateau its first point; not at the ends."""
    inner = amplitude[1:-1]
    return 1 + np.flatnonzero((inner > amplitude[:-2]) & (inner >= amplitude[2:]))


def _polish(truth: Truth, at: np.ndarray, sign: float) -> Real:
    """Narrow maxima (sign 1) or minima (-1) down between their neighbours; their frequencies in the end."""
    at = at[truth.amplitude[at] > FLOOR * truth.highest]
    middles = truth.hz[at]
    flat = np.zeros(at.size, bool)
    for _ in range(MOST_THIRDS):
        if flat.all():
            break
        here = np.searchsorted(truth.hz, middles[~flat])
        low, middle, high = (truth.hz[here + i] for i in (-1, 0, 1))
        thirds = [end + share * (middle - end) for end in (low, high) for share in (1 / 3, 2 / 3)]
        _insert(truth, np.unique(np.concatenate(thirds)))
        for n, (first, last) in zip(np.flatnonzero(~flat), np.stack([low, high], axis=1), strict=True):
            i, j = np.searchsorted(truth.hz, [first, last])
            top = i + 1 + int(np.argmax(sign * truth.amplitude[i + 1 : j]))
            middles[n] = truth.hz[top]
            beside = truth.amplitude[[top - 1, top + 1]]
            flat[n] = np.abs(beside - truth.amplitude[top]).max() <= FLAT * truth.amplitude[top]
    return middles


def _peak(truth: Truth, hz: float) -> TruePeak:
    """What is told of a maximum: how far it stands out, and whether its mean is history."""
    here = int(np.searchsorted(truth.hz, hz))
    value = float(truth.amplitude[here])
    dips = []
    for side in (truth.amplitude[:here][::-1], truth.amplitude[here + 1 :]):
        above = np.flatnonzero(side > value)
        # An end of the band is a valley that may go on falling.
        dips.append(float(side[: above[0] + 1].min()) if above.size else float(side.min(initial=value)))
    higher = max(dips)
    again = truth.solver.from_nothing(hz)
    return TruePeak(
        value=value, at=float(hz), prominence=1.0 - higher / value, history=abs(again / value - 1.0)
    )


def _band(truth: Truth, limit: float) -> list[tuple[float, float]]:
    dips = _extremes(-truth.amplitude)
    near = dips[(truth.amplitude[dips] > limit) & (truth.amplitude[dips] < 1.05 * limit)]
    if near.size:
        _polish(truth, near, -1.0)
    above = truth.amplitude > limit
    low = np.flatnonzero(above[1:] != above[:-1])
    left, right = truth.hz[low].copy(), truth.hz[low + 1].copy()
    values = [truth.amplitude[low] - limit, truth.amplitude[low + 1] - limit]
    for turn in range(60):
        if not left.size or np.all(right - left <= 1e-12 * right):
            break
        share = values[0] / (values[0] - values[1])
        share = np.clip(share, 0.0, 1.0) if turn % 3 else np.full_like(share, 0.5)
        at = np.clip(left + share * (right - left), left, right)
        found = truth.solver.amplitudes(at) - limit
        same = (found > 0.0) == (values[0] > 0.0)
        left, right = np.where(same, at, left), np.where(same, right, at)
        values = [np.where(same, found, values[0]), np.where(same, values[1], found)]
        if np.all(np.abs(found) <= 1e-11 * limit):
            left = right = at
            break
    crossings = (0.5 * (left + right)).tolist()
    ends = [truth.hz[0], *crossings, truth.hz[-1]]
    first = 0 if above[0] else 1
    return [(float(a), float(b)) for a, b in zip(ends[first::2], ends[first + 1 :: 2], strict=False)]
