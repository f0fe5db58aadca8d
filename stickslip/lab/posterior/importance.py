"""Adaptive importance sampling of a density from its mode, with a diagnosis of the weights.

Proposals are Student's t about the mode with the curvature there; after the first share of the draws one more
has mean and covariance of what was drawn. All draws count by the mixture of both (A. Owen, Y. Zhou, J. Am.
Stat. Assoc. 95 (2000) 135). The largest weights are smoothed by a generalised Pareto distribution, whose
shape k says whether their mean can be trusted (A. Vehtari, D. Simpson, A. Gelman, Y. Yao, J. Gabry, J. Mach.
Learn. Res. 25 (2024) 72). Weights of unnormalised densities give the evidence, ln ∫ density.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import gammaln, logsumexp

from optim.problem.variables import Real

TRUSTED = 0.7  # k above which the weights tell nothing
_DEGREES = 7.0  # of Student's t
_FIRST = 0.4  # share of the draws from the first proposal
_FEWEST = 5  # weights in a tail
_WIDER = 1.1  # factor on the deviations of the second


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighted:
    """Weighted draws of a density."""

    x: Annotated[Real, "(m, n)."]
    weights: Annotated[Real, "Their sum is 1, (m,)."]
    log_evidence: Annotated[float, "ln ∫ density."]
    log_evidence_error: Annotated[float, "Its standard error."]
    pareto_k: Annotated[float, "Shape of the tail of the weights."]

    @property
    def effective(self) -> float:
        """How many independent draws these are worth."""
        return float(1.0 / np.sum(self.weights**2))

    def moments(self) -> tuple[Real, Real]:
        """Return mean and covariance."""
        mean = self.weights @ self.x
        away = self.x - mean
        return mean, (self.weights[:, None] * away).T @ away

    def drawn(self, count: int, rng: np.random.Generator) -> Real:
        """Return so many draws of equal weight (systematic resampling, in random order), (count, n)."""
        places = (rng.random() + np.arange(count)) / count
        taken = np.searchsorted(np.cumsum(self.weights), places * float(self.weights.sum()))
        return np.asarray(self.x[rng.permutation(np.minimum(taken, len(self.x) - 1))])


class _StudentT:
    """A multivariate Student's t."""

    def __init__(self, mean: Real, covariance: Real) -> None:
        self._mean, self._root = mean, np.linalg.cholesky(covariance)

    def draw(self, count: int, rng: np.random.Generator) -> Real:
        normal = rng.normal(size=(count, self._mean.size)) @ self._root.T
        return np.asarray(self._mean + normal * np.sqrt(_DEGREES / rng.chisquare(_DEGREES, size=(count, 1))))

    def log_density(self, x: Real) -> Real:
        n = self._mean.size
        y = solve_triangular(self._root, (x - self._mean).T, lower=True)
        level = (
            gammaln(0.5 * (_DEGREES + n)) - gammaln(0.5 * _DEGREES) - 0.5 * n * math.log(math.pi * _DEGREES)
        )
        level -= float(np.sum(np.log(np.diag(self._root))))
        return np.asarray(level - 0.5 * (_DEGREES + n) * np.log1p(np.sum(y**2, axis=0) / _DEGREES))


def importance(
    density: Callable[[Real], float], mode: Real, covariance: Real, draws: int, rng: np.random.Generator
) -> Weighted:
    """Sample a density.

    Parameters
    ----------
    density : its logarithm at (n,); −∞ where it is nothing.
    mode, covariance : about which the first proposals are, (n,) and (n, n).
    draws : evaluations of the density.
    """
    first = max(int(_FIRST * draws), 1)
    proposals = [_StudentT(mode, covariance)]
    x = proposals[0].draw(first, rng)
    logs = np.array([density(one) for one in x])
    begun = _weighted(x, logs - proposals[0].log_density(x))
    shares = [1.0]
    if begun.effective > 2.0 * (mode.size + 1) and draws > first:
        mean, spread = begun.moments()
        proposals.append(_StudentT(mean, _WIDER**2 * (spread + 1e-3 * np.diag(np.diag(covariance)))))
        more = proposals[1].draw(draws - first, rng)
        x = np.concatenate([x, more])
        logs = np.append(logs, [density(one) for one in more])
        shares = [first / draws, 1.0 - first / draws]
    mixed = logsumexp(
        [math.log(s) + p.log_density(x) for s, p in zip(shares, proposals, strict=True)], axis=0
    )
    return _weighted(x, logs - mixed)


def _weighted(x: Real, logs: Real) -> Weighted:
    """Return draws with the logarithms of their weights."""
    smooth, k = smoothed(logs)
    total = float(logsumexp(smooth))
    weights = np.exp(smooth - total)
    spread = math.sqrt(max(float(np.sum(weights**2)) - 1.0 / logs.size, 0.0))
    return Weighted(
        x=x, weights=weights, log_evidence=total - math.log(logs.size), log_evidence_error=spread, pareto_k=k
    )


def smoothed(logs: Real) -> tuple[Real, float]:
    """Return logarithms of weights with their tail smoothed, and k of it; ∞ of too few to tell."""
    count = int(min(0.2 * logs.size, 3.0 * math.sqrt(logs.size)))
    order = np.argsort(logs)
    tail = order[-count:]
    if count < _FEWEST or not np.isfinite(logs[tail]).all() or logs[order[-count - 1]] == -math.inf:
        return logs, math.inf
    top, cut = float(logs[order[-1]]), float(logs[order[-count - 1]])
    beyond = np.exp(logs[tail] - top) - math.exp(cut - top)
    if not beyond[-1] > 1e-12:
        return logs, -math.inf  # all alike: the proposal is the density
    k, scale = _pareto(beyond)
    places = (np.arange(count) + 0.5) / count
    quantiles = scale * (np.expm1(-k * np.log1p(-places)) / k if abs(k) > 1e-9 else -np.log1p(-places))
    found = logs.copy()
    found[tail] = np.minimum(np.log(quantiles + math.exp(cut - top)), 0.0) + top
    return found, k


def _pareto(x: Real) -> tuple[float, float]:
    """Return shape and scale of a generalised Pareto distribution.

    J. Zhang, M. A. Stephens, Technometrics 51 (2009) 316, with the prior on k of Vehtari et al.; x rises.
    """
    n, x = x.size, np.maximum(x, 1e-300)
    grid = 30 + int(math.sqrt(n))
    b = 1.0 / x[-1] + (1.0 - np.sqrt(grid / (np.arange(grid) + 0.5))) / (3.0 * x[(n + 2) // 4 - 1])
    k = np.mean(np.log1p(-b[:, None] * x), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        likelihood = n * (np.log(-b / k) - k - 1.0)
    likelihood = np.where(np.isfinite(likelihood), likelihood, -math.inf)
    best = float(np.sum(b * np.exp(likelihood - logsumexp(likelihood))))
    shape = float(np.mean(np.log1p(-best * x)))
    scale = -shape / best
    return (n * shape + 5.0) / (n + 10.0), scale
