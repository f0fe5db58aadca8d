"""The mistuning within bounds that makes the highest peak of a disk in a linear limit largest.

From many starts a quasi-Newton method within bounds (L-BFGS-B: Byrd, Lu, Nocedal, Zhu, SIAM J. Sci. Comput.
16 (1995) 1190) climbs with exact derivatives of the logarithm of the peak. Starts are drawn, or are what
makes one blade move as in Whitehead's worst case: of mode shape q the wave with 1 + √N on one blade, to which
K₀ q + Σ δ_j Δ_j q = ω² M q gives δ (D. S. Whitehead, J. Eng. Gas Turbines Power 120 (1998) 115). With little
damping the peak as a function of δ is full of narrow ridges, where modes meet: some climbs begin with more
damping, which is taken away step by step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.optimize import minimize

from solver.arrays import Complex, Real
from solver.errors import check_count
from stickslip.lab.worst_mistuning.linear_disk import DiskPeak, LinearDisk

LARGEST = 0.9  # deviation of a factor
MOST_STARTS = 100_000
CLIMB_STEPS = 200
EASED = ((1.0,), (100.0, 30.0, 10.0, 3.0, 1.0), (10.0, 3.0, 1.0))  # damping of climbs, times that of the disk
FLAT = 1e-10  # of the logarithm of a peak, at which a climb ends
ROUNDING = 1e-14
ALIKE = 1e-4  # relative difference of two peaks that are one
_SHIFTS = 5  # frequencies of a mode that is looked for
_KICK = 0.25  # of the bounds, by which the best patterns are changed to climb again
_KEPT = 3  # best patterns that are


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """Where the deviations δ of all factors may lie."""

    middle: Annotated[Real, "(N,)."]
    within: Annotated[float, "|δ_j − middle_j| at most."]
    rms: Annotated[float | None, "√mean (δ − middle)² at most."] = None

    def inside(self, delta: Real) -> Real:
        """Return deviations within the bounds near some."""
        off = np.clip(delta - self.middle, -self.within, self.within)
        size = root_mean_square(off)
        return self.middle + (off if self.rms is None or size <= self.rms else off * (self.rms / size))

    def hold(self, delta: Real) -> bool:
        """Whether deviations lie within the bounds."""
        return bool(np.abs(delta - self.inside(delta)).max() <= ROUNDING)

    def drawn(self, rng: np.random.Generator) -> Real:
        """Return random deviations within the bounds, of one size or another."""
        width = self.within * rng.choice([0.2, 0.5, 1.0])
        return self.inside(self.middle + width * rng.uniform(-1.0, 1.0, self.middle.size))

    def largest(
        self, rise: Callable[[Real], tuple[float, Real]], begin: Real, steps: int, flat: float
    ) -> Real:
        """Return the deviations, climbing from some, at which a function with its slopes is largest.

        Beyond the ball of `rms` the function counts as at the nearest point of the ball.
        """
        kept, highest = begin, -math.inf

        def fall(z: Real) -> tuple[float, Real]:
            nonlocal kept, highest
            off = self.within * z
            share = 1.0 if self.rms is None else min(1.0, self.rms / max(root_mean_square(off), 1e-300))
            value, slope = rise(self.middle + share * off)
            if value > highest:
                kept, highest = self.middle + share * off, value
            if share < 1.0:
                slope = share * (slope - z * float(z @ slope) / float(z @ z))
            return -value, -self.within * slope

        minimize(
            fall, np.clip((begin - self.middle) / self.within, -1.0, 1.0), jac=True, method="L-BFGS-B",
            bounds=[(-1.0, 1.0)] * begin.size, options={"maxiter": steps, "maxfun": 2 * steps, "ftol": flat},
        )  # fmt: skip
        return kept


@dataclass(frozen=True, slots=True)
class WorstSearch:
    """How the worst mistuning is searched for.

    Attributes
    ----------
    starts : int
        Climbs in each linear limit.
    climbs : int
        With the contacts solved: half of them from the worst patterns of the linear limits and those
        intentional ones that the bounds hold, the others from drawn ones.
    climb : int
        Responses computed on each of these, at most.
    seed : int
        Of the starts that are drawn.

    Raises
    ------
    SettingError
        A count that cannot be.
    """

    starts: int = 60
    climbs: int = 4
    climb: int = 30
    seed: int = 1

    def __post_init__(self) -> None:
        for key, least in (("starts", 1), ("climbs", 0), ("climb", 0)):
            check_count(key, getattr(self, key), least, MOST_STARTS)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorstPattern:
    """A pattern of a linear disk with its highest peak."""

    delta: Annotated[Real, "Deviations of the factors, (N,)."]
    peak: Annotated[DiskPeak, "Of any blade."]


def worst_patterns(
    disk: LinearDisk,
    bounds: Bounds,
    starts: int,
    seed: int,
    go_on: Callable[[], bool] = lambda: True,
    given: Sequence[Real] = (),
) -> list[WorstPattern]:
    """Return the patterns that climbs from so many starts end at, worst first; repeatable by the seed.

    Parameters
    ----------
    disk : in a linear limit.
    bounds : of the deviations.
    starts : climbs.
    seed : of the random starts.
    go_on : asked before each climb.
    given : patterns to climb from as well, those of them that the bounds hold.
    """
    rng = np.random.default_rng(seed)
    aimed = list(_aimed(disk, bounds))
    aimed = [aimed[i] for i in rng.permutation(len(aimed))]
    found = [climbed(disk, bounds, delta) for delta in given if bounds.hold(delta) and go_on()]
    for i in range(starts):
        if not go_on():
            break
        if i % 3 == 0 and aimed:
            begin = aimed.pop()
        elif i % 3 == 1 and i > starts // 3:
            best = sorted(found, key=lambda one: -one.peak.value)[:_KEPT]
            kick = _KICK * rng.choice([0.1, 0.3, 1.0]) * bounds.within * rng.standard_normal(disk.sectors)
            begin = bounds.inside(best[rng.integers(len(best))].delta + kick)
        else:
            begin = bounds.drawn(rng)
        found.append(climbed(disk, bounds, begin, EASED[i // 3 % len(EASED)]))
    return sorted(found, key=lambda one: -one.peak.value)


def climbed(disk: LinearDisk, bounds: Bounds, begin: Real, damping: Sequence[float] = (1.0,)) -> WorstPattern:
    """Return where climbs from a pattern end, one behind the other with so many times the damping."""
    tried = [WorstPattern(delta=begin, peak=disk.peak(begin))]
    for times in damping:
        here = disk if times == 1.0 else disk.damped(times)
        first = here.peak(tried[-1].delta)
        omega = first.omega

        def rise(delta: Real, here: LinearDisk = here, blade: int = first.blade) -> tuple[float, Real]:
            nonlocal omega
            omega, value, slope = here.summit(delta, blade, omega)
            return value, slope

        delta = bounds.largest(rise, tried[-1].delta, CLIMB_STEPS, FLAT)
        tried.append(WorstPattern(delta=delta, peak=disk.peak(delta)))
    return max(tried, key=lambda one: one.peak.value)


def _aimed(disk: LinearDisk, bounds: Bounds) -> Iterator[Real]:
    """Return patterns that make a blade move 1 ± √N times as far as the others, at several frequencies."""
    N, nothing = disk.sectors, np.zeros(disk.sectors)
    tuned = disk.peak(nothing)
    D = disk.stiffness(nothing, tuned.omega)[2]
    pick = np.linalg.svd(D)[2][0].conj()  # what a factor acts on most
    own = disk.rows.transpose(0, 2, 1).conj() @ pick.conj()  # (N, m): its force on the coordinates
    gain = complex(pick.conj() @ D @ pick)
    wave = own.conj() @ np.linalg.solve(disk.stiffness(nothing, tuned.omega)[0], disk.force)
    wave = wave / np.abs(wave).max()
    for shift in np.linspace(-1.0, 1.0, _SHIFTS):
        omega = tuned.omega * (1.0 + 0.5 * bounds.within * shift)
        Z = disk.stiffness(nothing, omega)[0]
        inverse = np.linalg.inv(own.conj() @ np.linalg.solve(0.5 * (Z + Z.conj().T), own.T))
        for share in (1.0, -1.0, 0.5, -0.5):
            yield bounds.inside(_of_mode(inverse, gain, wave, tuned.blade, share * math.sqrt(N)))


def _of_mode(inverse: Complex, gain: complex, wave: Complex, blade: int, more: float) -> Real:
    """Return δ with which a wave with `more` on a blade is a mode, as nearly as real numbers can."""
    q = np.where(np.abs(wave) > 1e-6, wave, 1e-6)
    q[blade] *= 1.0 + more if abs(1.0 + more) > 1e-3 else 1e-3
    return np.asarray(-((inverse @ q) / (gain * q)).real)


def root_mean_square(off: Real) -> float:
    """Return √mean δ²."""
    return math.sqrt(float(np.mean(off**2)))


def alike(found: Sequence[WorstPattern]) -> int:
    """Return how many patterns have the highest peak of all."""
    return sum(one.peak.value >= (1.0 - ALIKE) * found[0].peak.value for one in found)
