"""Parameters that differ from assembly to assembly: `reassemblies`, a level of its own above the posteriors.

Each assembly g has values of its own, drawn from a population, z_g ~ N(m, diag(t²)) in the scaled unknowns (a
logarithm where they are scaled so); unknowns that do not vary have t = 0 and one value for all. What the
data of an assembly alone tell is a posterior under a uniform prior, N(z; ẑ_g, Σ_g) by its moments, so that
its values are integrated out in closed form,

    p(data | m, t) ∝ ∏_g N(ẑ_g; m, Σ_g + diag(t²)),

m too, and p(t) = 1 up to the deviations of the bounds (A. Gelman et al., Bayesian Data Analysis, 3rd ed.,
2013, sections 5.4 to 5.7). t is sampled, and m given t is normal.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Annotated, ClassVar

import numpy as np
from scipy.optimize import minimize

from optim.problem.checks import DesignError
from stickslip.lab.posterior.importance import TRUSTED, importance
from stickslip.lab.posterior.posterior import posterior
from stickslip.lab.posterior.posterior_result import Marginal, Posterior
from stickslip.lab.posterior.sampling import SAMPLING, Sampling
from optim.identification.reading import Given
from optim.identification.fit import Unknowns, read_unknowns
from optim.problem.variables import Real
from solver.arrays import FloatOrNaN
from solver.balance.balance import resolve
from solver.jit.timer import clock
from solver.results.base import Drawn
from solver.results.base import Data, Views
from solver.results.watch import OnProgress, ShouldStop, part_of, shows_progress
from solver.scene.scene import Scene

_FEWEST = 3  # assemblies that tell a spread
_DRAWS = 4000  # of the spreads
_WIDEST = 1.0 / math.sqrt(12.0)  # deviation of the bounds, the largest spread
_LEAST = 1e-6  # of a spread, scaled
_SCENARIOS = 32


class ReassemblyStatus(Enum):
    """How it ended; the value is a sentence a user can act on."""

    KNOWN = "What differs from assembly to assembly is known within its intervals."
    ASSEMBLY_UNKNOWN = "What one assembly alone tells is not known: see its status."
    UNRELIABLE = "The diagnosis of the samples failed: take more assemblies, or fewer parameters that vary."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Population(Drawn):
    """A population of assemblies."""

    VIEWS: ClassVar = Views("stickslip.lab.posterior", "tables:told", "pictures:drawn")
    DATA: ClassVar = Data(
        "population", {"parameter=middles": "parameter=name mean sd low high", "draw parameter": "samples"},
        rows=("draw",),
    )  # fmt: skip
    JSON: ClassVar = "scene reached status middles spreads varied names samples pareto_k assemblies seconds"

    scene: Annotated[str, "Its name."]
    status: Annotated[ReassemblyStatus, "How it ended."]
    names: Annotated[tuple[str, ...], "The unknowns."]
    varied: Annotated[tuple[str, ...], "Those that differ from assembly to assembly."]
    middles: Annotated[tuple[Marginal, ...], "Median of each unknown over assemblies."]
    spreads: Annotated[
        tuple[Marginal, ...],
        "Standard deviation of each that varies, over assemblies: of its logarithm where scaled so, else "
        "in its unit.",
    ]
    samples: Annotated[Real, "Values of assemblies that may come, in the units of the unknowns, (draws, n)."]
    pareto_k: Annotated[FloatOrNaN, "Of the weights of the spreads."]
    assemblies: Annotated[tuple[Posterior, ...], "What each alone tells."]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def uncertain(self) -> list[dict[str, float]]:
        """Scenarios for a robust design: at most 32 assemblies that may come."""
        return [dict(zip(self.names, row, strict=True)) for row in self.samples[:_SCENARIOS].tolist()]


@shows_progress("reassemblies")
def reassemblies(
    scene: Scene,
    data: Sequence[Sequence[Given]],
    unknowns: Mapping[str, Sequence[float]],
    varied: Sequence[str],
    *,
    scaling: Mapping[str, str] | None = None,
    sampling: Sampling = SAMPLING,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> Population:
    """Find what differs from assembly to assembly, and by how much.

    Parameters
    ----------
    scene : what was measured again and again.
    data : of each assembly, at least three, its files or tables as of `identify`.
    unknowns : path to (low, high); wide enough that every assembly lies well within.
    varied : those of the unknowns that each assembly has a value of its own of.
    scaling, sampling : as of `posterior`; each assembly has a seed of its own.
    on_progress, should_stop : as of `identify`.

    Raises
    ------
    DataError, DesignError, SettingError
        As `posterior`; fewer than three assemblies, or `varied` that are no unknowns.
    """
    begun = clock()
    known = read_unknowns(scene, unknowns, scaling, None)
    if isinstance(data, (str, Mapping)) or len(data) < _FEWEST:
        raise DesignError(
            "data", len(data), f"must be the data of at least {_FEWEST} assemblies, each a list"
        )
    if not varied or not set(varied) <= set(known.names):
        raise DesignError("varied", list(varied), f"must be some of {', '.join(known.names)}")
    found = []
    for i, one in enumerate(data):
        progress = part_of(on_progress, i / len(data), (i + 1) / len(data), i)
        own = replace(sampling, seed=sampling.seed + i)  # else what few draws are wrong by is alike in all
        found.append(posterior(
            scene, one, unknowns, scaling=scaling, sampling=own, on_progress=progress,
            should_stop=should_stop,
        ))  # fmt: skip
    return population(scene, known, varied, found, seed=sampling.seed, begun=begun)


def population(
    scene: Scene,
    unknowns: Unknowns,
    varied: Sequence[str],
    found: Sequence[Posterior],
    *,
    seed: int,
    begun: float,
) -> Population:
    """Return the population of what each assembly alone tells."""
    names, rng = unknowns.names, np.random.default_rng(seed)
    at = np.array([names.index(name) for name in varied])
    n, m = len(names), np.zeros((0, len(names)))
    spreads, k, status = np.zeros((0, at.size)), math.nan, ReassemblyStatus.ASSEMBLY_UNKNOWN
    if all(one.reached for one in found):
        level = Level(
            np.array([one.scaled.mean(axis=0) for one in found]),
            np.array([np.atleast_2d(np.cov(one.scaled.T)) for one in found]), at,
        )  # fmt: skip
        spreads, m, k = level.drawn(_DRAWS, rng)
        status = ReassemblyStatus.KNOWN if k <= TRUSTED else ReassemblyStatus.UNRELIABLE
        if status is ReassemblyStatus.UNRELIABLE:
            spreads, m = spreads[:0], m[:0]
    z = m.copy()
    z[:, at] += spreads * rng.normal(size=spreads.shape)
    inside = z[((z > 0.0) & (z < 1.0)).all(axis=1)]
    units = [resolve(scene, variable.paths[0]).unit for variable in unknowns.variables]
    values = np.array([unknowns.values(np.clip(one, 0.0, 1.0)) for one in m]).reshape(len(m), n)
    widths = [unknowns.variables[i] for i in at.tolist()]
    told = tuple(
        Marginal.of(
            v.name, "" if v.logarithmic else units[i], spreads[:, j] * _width(v.low, v.high, v.logarithmic)
        )
        for j, (i, v) in enumerate(zip(at.tolist(), widths, strict=True))
    )
    return Population(
        scene=scene.name, status=status, names=names, varied=tuple(varied), spreads=told,
        middles=tuple(Marginal.of(name, units[i], values[:, i]) for i, name in enumerate(names)),
        samples=np.array([unknowns.values(one) for one in inside]).reshape(len(inside), n), pareto_k=k,
        assemblies=tuple(found), seconds=clock() - begun,
    )  # fmt: skip


def _width(low: float, high: float, logarithmic: bool) -> float:
    """Return what a scaled deviation of 1 is."""
    return math.log(high / low) if logarithmic else high - low


class Level:
    """The level of the population above normal assemblies.

    Parameters
    ----------
    means, covariances : of each assembly alone, (G, n) and (G, n, n).
    varied : numbers of the unknowns that differ.
    """

    def __init__(self, means: Real, covariances: Real, varied: np.ndarray) -> None:
        self._means, self._covariances, self._varied = means, covariances, varied

    def _given(self, spread: Real) -> tuple[float, Real, Real]:
        """Return ln p(data | spreads) but for a constant, and mean and covariance of m given them."""
        total = self._covariances.copy()
        total[:, self._varied, self._varied] += spread**2
        inverse = np.linalg.inv(total)
        precision = inverse.sum(axis=0)
        mean = np.linalg.solve(precision, np.einsum("gij,gj->i", inverse, self._means))
        away = self._means - mean
        log = -0.5 * float(
            np.sum(np.linalg.slogdet(total)[1]) + np.einsum("gi,gij,gj->", away, inverse, away)
        )
        return log - 0.5 * float(np.linalg.slogdet(precision)[1]), mean, np.linalg.inv(precision)

    def log(self, logs: Real) -> float:
        """Return the logarithm of the density of ln t; nothing beyond the bounds' own."""
        spread = np.exp(logs)
        if (spread > _WIDEST).any() or (spread < _LEAST).any():
            return -math.inf
        return self._given(spread)[0] + float(np.sum(logs))

    def drawn(self, count: int, rng: np.random.Generator) -> tuple[Real, Real, float]:
        """Return draws of the spreads, (count, varied), of m, (count, n), and k of their weights."""
        start = np.log(np.clip(self._means[:, self._varied].std(axis=0, ddof=1), 1e2 * _LEAST, 0.5 * _WIDEST))
        best = minimize(lambda x: -max(self.log(x), -1e12), start, method="Nelder-Mead").x
        width = 1.5 / math.sqrt(2.0 * len(self._means))
        found = importance(self.log, best, width**2 * np.eye(best.size), count, rng)
        spreads = np.exp(found.drawn(count, rng))
        given = [self._given(one) for one in spreads]
        m = np.array([rng.multivariate_normal(mean, covariance) for _, mean, covariance in given])
        return spreads, m, found.pareto_k
