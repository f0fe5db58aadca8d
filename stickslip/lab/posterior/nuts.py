"""The no-U-turn sampler with exact gradients, chains of it, and whether they agree.

M. D. Hoffman, A. Gelman, J. Mach. Learn. Res. 15 (2014) 1593, with multinomial draws along a trajectory (M.
Betancourt, arXiv:1701.02434, appendix A). The density is given in coordinates in which it is about round, so
there is no mass matrix to find. Split R̂ and the effective number of draws are those of A. Gelman et al.,
Bayesian Data Analysis, 3rd ed., 2013, sections 11.4 and 11.5.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from optim.problem.variables import Real

CHAINS = 4
AGREED, ENOUGH = 1.02, 200.0  # R̂ from which chains do not agree, and effective draws that are too few
_WANTED = 0.8  # mean acceptance the step is found for
_DEEPEST = 8  # doublings of a trajectory
_LOST = 1000.0  # energy beyond which a trajectory has left the density

Density = Callable[[Real], tuple[float, Real]]
"""The logarithm of a density at (n,), and its gradient; −∞ where it is nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chains:
    """Draws of several chains."""

    x: Annotated[Real, "(chains, draws, n)."]
    diverged: Annotated[int, "Trajectories that left the density."]

    @property
    def r_hat(self) -> float:
        """Largest split R̂ of all coordinates: 1 where the chains agree."""
        return max(_split(self.x[:, :, i])[0] for i in range(self.x.shape[2]))

    @property
    def effective(self) -> float:
        """Least effective number of draws of all coordinates."""
        return min(_split(self.x[:, :, i])[1] for i in range(self.x.shape[2]))

    @property
    def agree(self) -> bool:
        """Whether they can be trusted."""
        return self.r_hat < AGREED and self.effective >= ENOUGH and not self.diverged


class _Point(NamedTuple):
    """A place of a trajectory."""

    x: Real
    p: Real
    log: float
    slope: Real

    @property
    def energy(self) -> float:
        """Logarithm of the density of place and momentum."""
        return self.log - 0.5 * float(self.p @ self.p)


class _Tree(NamedTuple):
    """A stretch of a trajectory: its ends, the draw from it and its weight."""

    left: _Point
    right: _Point
    drawn: _Point
    weight: float
    turned: bool
    accepted: float
    points: int
    lost: bool


def nuts(density: Density, begin: Real, draws: int, warm: int, rng: np.random.Generator) -> Chains:
    """Sample a density that is about a standard normal one.

    Parameters
    ----------
    density : with its gradient.
    begin : places at which the chains begin, (chains, n).
    draws, warm : of each chain; the first `warm` find the step and are left out.
    """
    found, diverged = np.empty((len(begin), draws, begin.shape[1])), 0
    for chain, x in enumerate(begin):
        here = _Point(x, np.zeros_like(x), *density(x))
        step, mean, far, sum_h = 0.7, math.log(7.0), 0.0, 0.0
        for i in range(warm + draws):
            tree, here = _transition(density, here, step, rng)
            if i < warm:  # dual averaging, algorithm 5 of Hoffman and Gelman
                sum_h += (_WANTED - tree.accepted / tree.points - sum_h) / (i + 11.0)
                log_step = mean - math.sqrt(i + 1.0) / 0.05 * sum_h
                far += (log_step - far) * (i + 1.0) ** -0.75
                step = math.exp(far if i == warm - 1 else log_step)
            else:
                found[chain, i - warm] = here.x
                diverged += tree.lost
    return Chains(x=found, diverged=diverged)


def _transition(
    density: Density, here: _Point, step: float, rng: np.random.Generator
) -> tuple[_Tree, _Point]:
    """Return the trajectory from a place with a random momentum, and the draw from it."""
    here = here._replace(p=rng.normal(size=here.x.size))
    tree = _Tree(here, here, here, 0.0, False, 0.0, 0, False)
    for depth in range(_DEEPEST):
        forward = bool(rng.random() < 0.5)
        end = tree.right if forward else tree.left
        more = _grown(density, end, step if forward else -step, depth, here.energy, rng)
        drawn = tree.drawn
        if not more.turned and math.log(rng.random()) < more.weight - tree.weight:
            drawn = more.drawn
        tree = _joined(tree, more, drawn, forward=forward)
        if tree.turned:
            break
    return tree, tree.drawn


def _grown(
    density: Density, end: _Point, step: float, depth: int, energy: float, rng: np.random.Generator
) -> _Tree:
    """Return 2^depth further places beyond an end; weights are relative to `energy`."""
    if depth == 0:
        half = end.p + 0.5 * step * end.slope
        x = end.x + step * half
        log, slope = density(x)
        there = _Point(x, half + 0.5 * step * slope, log, slope)
        weight = there.energy - energy if math.isfinite(log) else -math.inf
        lost = not weight > -_LOST
        return _Tree(there, there, there, weight, lost, min(1.0, math.exp(min(weight, 0.0))), 1, lost)
    first = _grown(density, end, step, depth - 1, energy, rng)
    if first.turned:
        return first
    further = first.right if step > 0.0 else first.left
    second = _grown(density, further, step, depth - 1, energy, rng)
    share = second.weight - np.logaddexp(first.weight, second.weight)
    drawn = second.drawn if math.log(rng.random()) < share else first.drawn
    return _joined(first, second, drawn, forward=step > 0.0)


def _joined(first: _Tree, second: _Tree, drawn: _Point, *, forward: bool) -> _Tree:
    """Return two stretches as one; it has turned where its ends come nearer."""
    left, right = (first.left, second.right) if forward else (second.left, first.right)
    across = right.x - left.x
    turned = second.turned or float(across @ left.p) < 0.0 or float(across @ right.p) < 0.0
    return _Tree(
        left, right, drawn, float(np.logaddexp(first.weight, second.weight)), turned,
        first.accepted + second.accepted, first.points + second.points, first.lost or second.lost,
    )  # fmt: skip


def _split(x: Real) -> tuple[float, float]:
    """Return R̂ and the effective number of draws of one coordinate, (chains, draws)."""
    half = x.shape[1] // 2
    x = np.concatenate([x[:, :half], x[:, half : 2 * half]])
    m, n = x.shape
    within, between = float(x.var(axis=1, ddof=1).mean()), float(x.mean(axis=1).var(ddof=1))
    total = (n - 1) / n * within + between
    if not within > 0.0:
        return math.inf, 0.0
    away = x - x.mean(axis=1, keepdims=True)
    size = 2 * n
    power = np.abs(np.fft.rfft(away, size, axis=1)) ** 2
    lagged = np.fft.irfft(power, size, axis=1)[:, :n].mean(axis=0) / n
    rho = 1.0 - (within - lagged * n / (n - 1)) / total
    pairs = rho[0 : n - n % 2 : 2] + rho[1:n:2]  # Geyer's: positive and falling
    count = int(np.argmax(np.append(pairs <= 0.0, True)))
    tau = -1.0 + 2.0 * float(np.sum(np.minimum.accumulate(pairs[:count])))
    return math.sqrt(total / within), m * n / max(tau, 1.0 / math.log10(m * n))
