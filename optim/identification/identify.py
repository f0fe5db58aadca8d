"""Identification of parameters from measured responses and hysteresis loops: `identify`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from optim.identification.data.response import ResponseRun
from optim.identification.fit import (
    MOST_STARTS,
    STARTS,
    LocalFit,
    Noise,
    Runs,
    Searched,
    Unknowns,
    read_unknowns,
    search,
)
from optim.identification.identification_result import Estimate, Identification, IdentifyStatus, NotReached
from optim.identification.information import (
    UNIFORM,
    Information,
    information,
    rank,
    read_candidates,
    strong_correlations,
    untold,
)
from optim.identification.model_check import doubts
from optim.identification.reading import Given, read_data
from optim.problem.checks import DataError, DesignError, is_number, whole
from optim.problem.uncertainty_input import CONFIDENCE, read_uncertain
from optim.problem.variables import Real
from solver.balance.balance import check_harmonics, resolve
from solver.errors import SceneError, SettingError
from solver.jit.timer import clock
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.scene import Scene

_BOUND = 1e-6  # scaled distance from a bound within which an estimate lies on it
_IMPLAUSIBLE = 200.0  # ratio of measured to computed amplitudes, over a whole run, that is a wrong unit
_MOST_SCATTER = 0.15  # relative noise; responses of rigs repeat to a few per cent
_MISFIT = 2.0  # reduced χ² of given noise above which the model does not describe the data


@shows_progress("identify")
def identify(
    scene: Scene,
    data: Sequence[Given],
    unknowns: Mapping[str, Sequence[float]],
    *,
    scaling: Mapping[str, str] | None = None,
    priors: Mapping[str, Sequence[float]] | None = None,
    noise: float | None = None,
    robust: bool = False,
    candidates: Mapping[str, Sequence[float]] | None = None,
    harmonics: int = 11,
    starts: int = STARTS,
    seed: int = 0,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> Identification:
    """Find parameters of a scene from measurements, with how sure they are.

    Parameters
    ----------
    scene : what was measured; its values are one of the starts.
    data : files or tables, see `optim.identification.reading.read_data`.
    unknowns : parameter path (several that share a value separated by commas) to (low, high).
    scaling : unknown to ``linear``, ``logarithmic`` or ``auto``: logarithmic from a ratio of the bounds of 5.
    priors : unknown to (mean, standard deviation), what was known before.
    noise : standard deviation relative to the amplitude (of a loop, to its largest force), for data that do
        not say their own; found from what the fit leaves over if left out.
    robust : let outliers weigh less (Huber's loss).
    candidates : parameter path to values, conditions of measurements that could be made next; levels and
        loads around those measured if left out.
    harmonics : highest harmonic kept.
    starts, seed : how many places within the bounds are tried, and the seed of them.
    on_progress : called with (share done, evaluations).
    should_stop : asked now and then; True ends it with the status STOPPED.

    Returns
    -------
    The estimates; whatever happened, its status says what they are worth.

    Raises
    ------
    DataError
        Data that cannot be used: file, line and what would be right.
    DesignError, SettingError
        Bad unknowns, priors, candidates or settings.
    """
    begun = clock()
    known = read_unknowns(scene, unknowns, scaling, priors)
    check_fit(noise, starts, seed, harmonics)
    measured = read_data(scene, data, known.paths)
    conditions = read_candidates(scene, measured, known, candidates)
    runs, told = Runs(scene, measured, known, harmonics), Noise(level=noise, robust=robust)
    found = search(runs, told, starts=starts, seed=seed, on_progress=on_progress, should_stop=should_stop)
    if found.best is None:
        result = _nothing(runs, found, stopped=should_stop is not None and should_stop())
    else:
        _check_plausible(runs, found.best)
        level_known = found.best.level == 1.0
        info = information(runs, found.best, robust=robust, level_known=level_known)
        level = found.best.level if not level_known else math.nan if noise is None else noise
        misfit = misfit_of(runs, found.best, info, robust=robust)
        result = replace(
            _described(runs, found, found.best, info, misfit, level),
            candidates=rank(runs, found.best, info, conditions),
        )  # fmt: skip
    return replace(result, seconds=clock() - begun)


def check_fit(noise: float | None, starts: int, seed: int, harmonics: int) -> None:
    """Raise DesignError unless these are settings of a fit."""
    if noise is not None and not (is_number(noise) and 0.0 < noise < 1.0):
        raise DesignError(
            "noise", noise, "must be a relative standard deviation between 0 and 1, 0.02 for 2 %"
        )
    whole("starts", starts, least=1, most=MOST_STARTS)
    whole("seed", seed, least=0, most=2**53)
    check_harmonics(harmonics)


def _check_plausible(runs: Runs, best: LocalFit) -> None:
    """Refuse runs that are larger or smaller than anything within the bounds: a wrong unit, most likely."""
    for run, part in zip(runs.runs, runs.slices, strict=True):
        reached = best.active[part]
        if not reached.any():
            continue
        seen = float(np.abs(runs.observations[part][reached]).max())
        computed = float(np.abs(best.fitted.values[part][reached]).max())
        ratio = seen / computed if computed > 0.0 else math.inf
        if not 1.0 / _IMPLAUSIBLE < ratio < _IMPLAUSIBLE:
            wanted = (
                f"must be {run.UNIT_WORDS} such as the scene has under {run.words}, at most {computed:.3g} "
                "with the best values within the bounds: give the unit in the head of the column, "
                "`amplitude [mm]`, and look at the excitation"
            )
            size = seen / run.scale
            raise DataError(run.source, float(f"{size:.4g}"), wanted)


def _described(
    runs: Runs, found: Searched, best: LocalFit, info: Information, misfit: str, noise: float
) -> Identification:
    """Return everything but the candidates; intervals only of a model that describes the data."""
    unknowns, z = runs.unknowns, best.fitted.z
    covariance = info.covariance()
    slopes, values = unknowns.slopes(z), unknowns.values(z)
    estimates = _estimates(runs.scene, unknowns, z, info, doubtful=bool(misfit))
    in_units = covariance * np.outer(slopes, slopes)
    spread = np.sqrt(np.diag(covariance))
    missing = untold(runs.scene, unknowns, z, info, best.fitted.states)
    if misfit:
        # That a contact slips or sticks throughout in a fit that fails says nothing of the rig; products do.
        missing = tuple(one for one in missing if len(one.names) > 1)
    left_out = _not_reached(runs, best)
    status = IdentifyStatus.UNTOLD if missing else IdentifyStatus.KNOWN
    if left_out:
        status = IdentifyStatus.LEFT_OUT
    if misfit:
        status = IdentifyStatus.MODEL_DOUBTFUL
    if not best.converged:
        status = IdentifyStatus.NOT_CONVERGED
    by_path = unknowns.by_path(z)
    here = runs.scene.with_values(by_path)
    intervals = clipped(unknowns, np.array([one.interval for one in estimates]))
    others = [
        {**dict(zip(unknowns.names, unknowns.values(z_other).tolist(), strict=True)), "misfit": ratio}
        for z_other, ratio in found.others
    ]
    return Identification(
        scene=runs.scene.name, status=status, estimates=estimates, covariance=in_units,
        correlation=covariance / np.outer(spread, spread),
        noise=noise, reduced_chi2=info.reduced_chi2, misfit=misfit, untold=missing,
        correlated=strong_correlations(unknowns, info), candidates=(),
        runs=_curves(runs, best, covariance), not_reached=left_out,
        uncertain=uncertain_table(here, unknowns, values, in_units, intervals, told=not (missing or misfit)),
        values=by_path, other_optima=tuple(others), starts=found.starts, agreeing=found.agreeing,
        evaluations=runs.evaluations, harmonics=runs.harmonics, seconds=0.0,
    )  # fmt: skip


def misfit_of(runs: Runs, best: LocalFit, info: Information, *, robust: bool) -> str:
    """Return why the model does not describe the data, its one likeliest cause; empty if it does."""
    size = ""
    if best.level == 1.0 and info.reduced_chi2 > _MISFIT:
        size = (
            "The residuals are larger than the noise given: the model does not describe the data, or the "
            "noise is larger (leave `noise` out to judge by what is left over)."
        )
    elif best.level != 1.0 and best.level > _MOST_SCATTER:
        size = (
            f"The fit leaves {100.0 * best.level:.3g} % of the responses, far more than measurements "
            "scatter: the model does not describe the data."
        )
    cause = doubts(runs, best, robust=robust)
    if size and not cause:
        cause = (
            "Look at the fit: another parameter may have to be looked for, other bounds, or the data are of "
            "another structure, place or unit."
        )
    return f"{size} {cause}".strip()


def _estimates(
    scene: Scene, unknowns: Unknowns, z: Real, info: Information, *, doubtful: bool
) -> tuple[Estimate, ...]:
    """Return each unknown with its interval, which is symmetric in the scaled unknown."""
    factor, found, errors = info.quantile(), [], info.standard_errors().tolist()
    for i, variable in enumerate(unknowns.variables):
        sd, told = errors[i], errors[i] < UNIFORM and not doubtful
        value = variable.outside(float(z[i]))
        ends = [value + sign * factor * sd * variable.slope(value) for sign in (-1.0, 1.0)]
        if variable.logarithmic and told:
            stretch = math.exp(factor * sd * math.log(variable.high / variable.low))
            ends = [value / stretch, value * stretch]
        found.append(
            Estimate(
                name=variable.name, unit=resolve(scene, variable.paths[0]).unit, value=value,
                standard_error=sd * variable.slope(value) if told else math.nan,
                interval=(ends[0], ends[1]) if told else (variable.low, variable.high), told=told,
                at_bound=not _BOUND < z[i] < 1.0 - _BOUND, low=variable.low, high=variable.high,
            )
        )  # fmt: skip
    return tuple(found)


def _curves(runs: Runs, best: LocalFit, covariance: Real) -> tuple[dict[str, object], ...]:
    """Return data, fit and standard deviation of the fit of each run."""
    rows = np.where(np.isfinite(best.fitted.jacobian), best.fitted.jacobian, 0.0)
    spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", rows, covariance, rows), 0.0))
    return tuple(
        run.to_json(best.fitted.values[part], spread[part])
        for run, part in zip(runs.runs, runs.slices, strict=True)
    )


def _not_reached(runs: Runs, best: LocalFit) -> tuple[NotReached, ...]:
    """Return the points that do not count, of each run that has any."""
    found = []
    for run, part in zip(runs.runs, runs.slices, strict=True):
        lost = ~best.active[part]
        if lost.any():
            places = run.frequency_hz[lost[:: run.parts]].tolist() if isinstance(run, ResponseRun) else []
            found.append(NotReached(run=run.words, at=tuple(places)))
    return tuple(found)


def _nothing(runs: Runs, found: Searched, *, stopped: bool) -> Identification:
    """Return that there is no fit, and why."""
    empty, status = np.zeros((0, 0)), IdentifyStatus.STOPPED if stopped else IdentifyStatus.NO_START
    return Identification(
        scene=runs.scene.name, status=status, estimates=(), covariance=empty, correlation=empty,
        noise=math.nan, reduced_chi2=math.nan, misfit="", untold=(), correlated=(), candidates=(), runs=(),
        not_reached=(), uncertain={}, values={}, other_optima=(), starts=found.starts, agreeing=0,
        evaluations=runs.evaluations, harmonics=runs.harmonics, seconds=0.0,
    )  # fmt: skip


def uncertain_table(
    scene: Scene, unknowns: Unknowns, values: Real, covariance: Real, intervals: Real, *, told: bool
) -> dict[str, Any]:
    """Return what a robust design takes as not known.

    Parameters
    ----------
    scene : with the estimates.
    values, covariance : (n,), (n, n) in the units of the parameters.
    intervals : (n, 2) of 95 %, for where the ellipsoid leaves what the parameters may have.
    told : whether the data tell every unknown; else intervals.
    """
    names = list(unknowns.names)
    centre = {name: float(value) for name, value in zip(names, values, strict=True)}
    ellipsoid = {"centre": centre, "covariance": covariance.tolist(), "confidence": CONFIDENCE}
    if told:
        try:
            read_uncertain(scene, (), ellipsoid)
        except (SettingError, SceneError):
            pass  # it reaches beyond what a parameter may have: intervals do not
        else:
            return ellipsoid
    return {name: [float(low), float(high)] for name, (low, high) in zip(names, intervals, strict=True)}


def clipped(unknowns: Unknowns, intervals: Real) -> Real:
    """Return intervals within the bounds, and of some width."""
    low = np.array([variable.low for variable in unknowns.variables])
    high = np.array([variable.high for variable in unknowns.variables])
    found = np.column_stack([np.clip(intervals[:, 0], low, high), np.clip(intervals[:, 1], low, high)])
    flat = found[:, 1] <= found[:, 0]
    found[flat] = np.column_stack([low, high])[flat]
    return np.asarray(found)
