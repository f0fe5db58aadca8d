"""The posterior of parameters of a scene after measurements: `posterior`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from optim.problem.checks import DesignError
from optim.identification.fit import LEAST_LEVEL, LocalFit, Noise, Runs, search
from optim.identification.identify import misfit_of
from optim.identification.information import information
from stickslip.lab.posterior.importance import TRUSTED, Weighted, importance
from stickslip.lab.posterior.nuts import CHAINS, ENOUGH, nuts
from stickslip.lab.posterior.posterior_result import Marginal, Posterior, PosteriorStatus
from stickslip.lab.posterior.sampling import SAMPLING, Sampling
from stickslip.lab.posterior.target import Target
from optim.identification.reading import Given, read_data
from optim.identification.fit import read_unknowns
from optim.problem.variables import Real
from solver.balance.balance import resolve
from solver.jit.timer import clock
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.scene import Scene

_WORTH = 100.0  # independent draws below which importance sampling has failed
_WARM = 100  # draws of a chain that find its step
_LOST = 0.01  # share of places that may be lost


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sampled:
    """Draws of a target, or why there are none."""

    x: Annotated[Real, "Draws of equal weight, (draws, n); none where the diagnosis failed."]
    weighted: Annotated[Weighted | None, "That the evidence is of."]
    sampler: str
    r_hat: float = math.nan
    effective: float = math.nan


@shows_progress("posterior")
def posterior(
    scene: Scene,
    data: Sequence[Given],
    unknowns: Mapping[str, Sequence[float]],
    *,
    scaling: Mapping[str, str] | None = None,
    priors: Mapping[str, Sequence[float]] | None = None,
    sampling: Sampling = SAMPLING,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> Posterior:
    """Sample what is known of parameters after measurements, and how well the model explains them.

    Unknowns are uniform within their bounds (in their logarithm from a ratio of 5), times their priors.

    Parameters
    ----------
    scene, data, unknowns, scaling, priors : as of `identify`.
    sampling : noise, harmonics, starts and draws.
    on_progress, should_stop : as of `identify`.

    Raises
    ------
    DataError, DesignError, SettingError
        As `identify`; data without noise when none is given.
    """
    begun = clock()
    known = read_unknowns(scene, unknowns, scaling, priors)
    runs = Runs(scene, read_data(scene, data, known.paths), known, sampling.harmonics)
    found = search(
        runs, Noise(level=sampling.noise, robust=False), starts=sampling.starts, seed=sampling.seed,
        on_progress=on_progress, should_stop=should_stop,
    )  # fmt: skip
    if found.best is None:
        stopped = should_stop is not None and should_stop()
        nothing = PosteriorStatus.STOPPED if stopped else PosteriorStatus.NO_FIT
        return _result(runs, _none(len(known)), nothing, "", math.nan, begun)
    result = sampled(runs, found.best, sampling)
    return replace(result, seconds=clock() - begun)


def sampled(runs: Runs, best: LocalFit, sampling: Sampling) -> Posterior:
    """Return the posterior about a fit.

    Raises
    ------
    DesignError
        The data have no noise, and none was given.
    """
    begun = clock()
    if best.level <= LEAST_LEVEL:
        raise DesignError("noise", sampling.noise, "must be given: the data show none")
    level_known = best.level == 1.0
    info = information(runs, best, robust=False, level_known=level_known)
    misfit = misfit_of(runs, best, info, robust=False)
    noise = best.level if not level_known else math.nan if sampling.noise is None else sampling.noise
    if not best.active.all():
        return _result(runs, _none(len(runs.unknowns)), PosteriorStatus.LOST, misfit, noise, begun)
    target = Target(runs, best, sampling.noise)
    before = target.evaluations
    mode = target.mode()
    drawn = _none(target.dimensions) if mode is None else _drawn(target, *mode, sampling)
    status = PosteriorStatus.MODEL_DOUBTFUL if misfit else PosteriorStatus.SAMPLED
    if not len(drawn.x):
        status = PosteriorStatus.UNRELIABLE
    if target.lost > _LOST * (target.evaluations - before):
        drawn, status = replace(drawn, x=drawn.x[:0], weighted=None), PosteriorStatus.LOST
    result = _result(runs, drawn, status, misfit, noise, begun)
    return replace(result, evaluations=target.evaluations)


def _none(n: int) -> _Sampled:
    return _Sampled(x=np.zeros((0, n)), weighted=None, sampler="")


def _drawn(target: Target, mode: Real, covariance: Real, sampling: Sampling) -> _Sampled:
    """Return draws of a target by the sampler asked for."""
    draws, sampler, rng = sampling.draws, sampling.sampler, np.random.default_rng(sampling.seed)
    weighted = None
    if sampler != "nuts":
        weighted = importance(target.log, mode, covariance, draws, rng)
        good = _trusted(weighted)
        if good or sampler == "importance":
            x = weighted.drawn(draws if good else 0, rng)
            return _Sampled(x=x, weighted=weighted, sampler="importance", effective=weighted.effective)
    root = np.linalg.cholesky(covariance)

    def rounded(y: Real) -> tuple[float, Real]:
        at = target.at(mode + root @ y)
        return at.log, at.slope @ root

    begin = rng.normal(size=(CHAINS, mode.size))
    chains = nuts(rounded, begin, max(draws // CHAINS, int(ENOUGH) // 2), _WARM, rng)
    x = (mode + chains.x.reshape(-1, mode.size) @ root.T)[rng.permutation(chains.x.size // mode.size)]
    about = importance(target.log, x.mean(axis=0), np.atleast_2d(np.cov(x.T)), draws, rng)
    if not chains.agree and sampler == "auto" and _trusted(about):
        # Too few draws of the chains tell well enough where the density is to weigh others by it.
        x = about.drawn(draws, rng)
        return _Sampled(x=x, weighted=about, sampler="importance", effective=about.effective)
    return _Sampled(
        x=x if chains.agree else x[:0], weighted=about, sampler="nuts", r_hat=chains.r_hat,
        effective=chains.effective,
    )  # fmt: skip


def _trusted(weighted: Weighted) -> bool:
    return (
        weighted.pareto_k <= TRUSTED and weighted.effective >= _WORTH and math.isfinite(weighted.log_evidence)
    )


def _result(
    runs: Runs, drawn: _Sampled, status: PosteriorStatus, misfit: str, noise: float, begun: float
) -> Posterior:
    """Return the result of draws; evidence only of weights that can be trusted."""
    from scipy.special import ndtr

    unknowns, weighted = runs.unknowns, drawn.weighted
    z = np.asarray(ndtr(drawn.x))
    samples = np.array([unknowns.values(one) for one in z]).reshape(z.shape)
    told = samples if status is PosteriorStatus.SAMPLED else samples[:0]
    known = weighted is not None and weighted.pareto_k <= TRUSTED
    return Posterior(
        scene=runs.scene.name, status=status, names=unknowns.names,
        marginals=tuple(
            Marginal.of(variable.name, resolve(runs.scene, variable.paths[0]).unit, told[:, i])
            for i, variable in enumerate(unknowns.variables)
        ),
        samples=samples, scaled=z, sampler=drawn.sampler, r_hat=drawn.r_hat, effective=drawn.effective,
        log_evidence=weighted.log_evidence if weighted is not None and known else math.nan,
        log_evidence_error=weighted.log_evidence_error if weighted is not None and known else math.nan,
        pareto_k=math.nan if weighted is None else weighted.pareto_k, misfit=misfit, noise=noise,
        evaluations=runs.evaluations, seconds=clock() - begun,
    )  # fmt: skip
