"""Many starts: thinned runs rank places all over the bounds; from the best of them all runs are fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optim.identification.fit.evaluation import Fitted, Runs
from optim.identification.fit.least_squares import LocalFit, Noise, fit
from optim.problem.variables import Real
from solver.results.watch import OnProgress, ShouldStop

STARTS, MOST_STARTS = 16, 1000
_POINTS = 12  # of a run in the first look
_SEARCHED = 3  # of the ranked places
_ENOUGH = 0.8  # share of the points that a place must reach to be a start
_COARSE = 0.1  # relative distance of a prediction from which it hardly matters how far it is
_APART = 0.02  # scaled distance between optima that are two
_WORSE = 0.5  # share of the progress that the first look is worth


@dataclass(frozen=True, slots=True, kw_only=True)
class Searched:
    """What the search found.

    Attributes
    ----------
    best : LocalFit or None
        None where no place reached enough points, or the search was stopped before any fit.
    others : tuple of (z, cost)
        Further local optima of the thinned runs, cost relative to that of the best.
    starts : int
        Places tried; agreeing : searches of the first look that ended at the best.
    agreeing : int
    """

    best: LocalFit | None
    others: tuple[tuple[Real, float], ...]
    starts: int
    agreeing: int


def search(
    runs: Runs, noise: Noise, *, starts: int, seed: int, on_progress: OnProgress, should_stop: ShouldStop
) -> Searched:
    """Fit all runs from the best of many starts."""
    coarse = runs.thinned(_POINTS)
    ranked: list[tuple[float, Real]] = []
    places = _places(runs, starts, seed)
    for i, z in enumerate(places):
        if should_stop is not None and should_stop():
            return Searched(best=None, others=(), starts=i, agreeing=0)
        coarse.forget()
        found = coarse.at(z)
        if found.reached.mean() >= _ENOUGH:
            ranked.append((misfit(coarse, found), z))
        if on_progress is not None:
            on_progress(_WORSE * (i + 1) / len(places), i + 1)
    ranked.sort(key=lambda pair: pair[0])
    fits: list[LocalFit] = []
    for _, z in ranked[:_SEARCHED]:
        if should_stop is not None and should_stop():
            break
        coarse.forget()
        fits.append(fit(coarse, z, noise, rounds=2))
    if not fits:
        return Searched(best=None, others=(), starts=len(places), agreeing=0)
    fits.sort(key=lambda one: misfit(coarse, one.fitted))
    first = fits[0].fitted
    away = [np.abs(one.fitted.z - first.z).max() > _APART for one in fits]
    ratio = [misfit(coarse, one.fitted) / max(misfit(coarse, first), 1e-300) for one in fits]
    others = tuple((one.fitted.z, r) for one, far, r in zip(fits, away, ratio, strict=True) if far)
    best = fit(runs, first.z, noise)
    if any(not model.unique for model in runs.models):
        best = _on_its_branches(runs, best, noise)
    if on_progress is not None:
        on_progress(1.0, runs.evaluations)
    return Searched(best=best, others=others, starts=len(places), agreeing=len(fits) - len(others))


def _on_its_branches(runs: Runs, best: LocalFit, noise: Noise) -> LocalFit:
    """Fit again with the solutions nearest to the data at the optimum, while that makes it better."""
    for _ in range(3):
        runs.forget()
        again = fit(runs, best.fitted.z, noise)
        settled = np.allclose(again.fitted.z, best.fitted.z, atol=1e-4)
        best = again
        if settled:
            break
    return best


def misfit(runs: Runs, found: Fitted) -> float:
    """Return how far predictions are from the data, of which no single one can matter too much."""
    shape, _ = runs.noise(runs.observations, 1.0)
    reached = found.reached
    rest = ((found.values - runs.observations) / (_COARSE * shape))[reached]
    prior, _ = runs.unknowns.prior_rows(found.z)
    return float(np.sum(np.log1p(rest**2)) * reached.size / max(int(reached.sum()), 1) + np.sum(prior**2))


def _places(runs: Runs, starts: int, seed: int) -> list[Real]:
    """Return the scene's own values, the middle, and places of a Sobol sequence."""
    from scipy.stats import qmc

    n = len(runs.unknowns)
    middle = np.full(n, 0.5)
    rest = max(starts - 2, 0)
    sobol = qmc.Sobol(n, seed=seed).random_base2(max(int(np.ceil(np.log2(max(rest, 1)))), 0))[:rest]
    return [runs.unknowns.start(runs.scene), middle, *sobol][:starts]
