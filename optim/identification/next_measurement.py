"""Which further measurement tells most: by how much it raises the determinant of the information matrix.

A candidate is a run under other conditions with the points of one that was measured (D-optimality: Atkinson,
Donev, Tobias, Optimum Experimental Designs, 2007, chapter 11). The gain is ½ ln det(I + I_c) − ½ ln det I,
the factor exp(−gain) by which the volume of the confidence ellipsoid shrinks. I is of what is known so far;
the bounds count as uniform priors, so that a direction nobody has told yet is worth much, not infinitely
much.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from optim.identification.data.measured import MeasuredRows
from optim.identification.fit import LocalFit, Runs
from optim.identification.information import UNIFORM, Information
from optim.identification.unknowns import Unknowns
from optim.problem.checks import DesignError, is_number
from optim.problem.variables import Real
from solver.balance.parameter import Kind, resolve
from solver.errors import at
from solver.results.told import Piece
from solver.scene.parameter_paths import AMPLITUDE
from solver.scene.scene import Scene

CANDIDATES = "candidates"
MOST_CANDIDATES = 100
_POINTS = 24  # of a candidate run
_FACTORS = (0.3, 1.0, 3.0)
_MOST_PATHS = 2


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Candidate(Piece):
    """A measurement that could be made."""

    conditions: Annotated[Mapping[str, float], "Parameter path to value."]
    like: Annotated[str, "The run whose points it has."]
    gain: Annotated[
        float, "½ ln of the ratio of determinants; NaN where its responses could not be computed."
    ]
    tells: Annotated[str, "The unknown whose standard error falls most."]
    factor: Annotated[float, "What that standard error is multiplied by."]


def read_candidates(
    scene: Scene, runs: Sequence[MeasuredRows], unknowns: Unknowns,
    given: Mapping[str, Sequence[float]] | None,
) -> tuple[dict[str, float], ...]:  # fmt: skip
    """Return the conditions of all candidates: every combination of the values given.

    Without any: a third of the least, the geometric mean and three times the most of the excitation and of
    the first other condition of the data.

    Raises
    ------
    DesignError, SettingError
        An unknown path, one that is looked for, or values that are none.
    """
    if given is None:
        given = _usual(scene, runs, unknowns)
    if not isinstance(given, Mapping):
        raise DesignError(CANDIDATES, given, "must be a table of parameter paths and lists of values")
    for path, values in given.items():
        with at(CANDIDATES, path):
            parameter = resolve(scene, path)
        if parameter.kind is Kind.FREQUENCY or path in unknowns.paths:
            raise DesignError(
                (CANDIDATES, path), path, "must be a condition, neither looked for nor the frequency"
            )
        if not isinstance(values, Sequence) or not values or not all(is_number(value) for value in values):
            raise DesignError((CANDIDATES, path), values, "must be a list of numbers")
        with at(CANDIDATES, path):
            for value in values:
                scene.with_values({path: float(value)})
    made = [dict(zip(given, values, strict=True)) for values in itertools.product(*given.values())]
    if len(made) > MOST_CANDIDATES:
        raise DesignError(CANDIDATES, len(made), f"must be at most {MOST_CANDIDATES} combinations")
    return tuple({path: float(value) for path, value in one.items()} for one in made if one)


def _usual(scene: Scene, runs: Sequence[MeasuredRows], unknowns: Unknowns) -> dict[str, list[float]]:
    varied = dict.fromkeys(path for run in runs for path in run.conditions)
    paths = [path for path in (AMPLITUDE, *varied) if path not in unknowns.paths]
    usual: dict[str, list[float]] = {}
    for path in list(dict.fromkeys(paths))[:_MOST_PATHS]:
        values = [run.conditions.get(path, scene.value(path)) for run in runs]
        low, high = min(values), max(values)
        if low > 0.0:
            usual[path] = [low * _FACTORS[0], (low * high) ** 0.5, high * _FACTORS[2]]
    return usual


def rank(
    runs: Runs, best: LocalFit, known: Information, conditions: Sequence[Mapping[str, float]]
) -> tuple[Candidate, ...]:
    """Return the candidates, the most telling first."""
    before = known.total + np.eye(len(known.data)) / UNIFORM**2
    level = best.level if known.degrees else None
    found = [_judged(runs, best, before, level, one) for one in conditions]
    return tuple(sorted(found, key=lambda one: -one.gain if np.isfinite(one.gain) else np.inf))


def _judged(
    runs: Runs, best: LocalFit, before: Real, level: float | None, conditions: Mapping[str, float]
) -> Candidate:
    """Return what the best of the measured runs would tell under other conditions."""
    z, unknowns = best.fitted.z, runs.unknowns
    spread = np.sqrt(np.diag(np.linalg.inv(before)))
    tried = Candidate(conditions=dict(conditions), like="", gain=np.nan, tells="", factor=np.nan)
    seen: set[tuple[str, str]] = set()
    for run, part in zip(runs.runs, runs.slices, strict=True):
        sort = (type(run).__name__, str(getattr(run, "dof", getattr(run, "contact", ""))))
        if sort in seen:
            continue
        seen.add(sort)
        new = run.under(conditions, _POINTS)
        predicted = new.model(runs.scene, unknowns.paths, runs.harmonics).evaluate(unknowns.by_path(z))
        kept = predicted.reached
        if not kept.any():
            continue
        shape = new.noise_shape(np.where(kept, predicted.values, 0.0))[kept]
        noise = shape * (
            level if level is not None else float(np.median(best.sd[part] / _shape(runs, best, part)))
        )
        rows = unknowns.by_scaled(z, predicted.slopes[kept]) / noise[:, None]
        after = before + rows.T @ rows
        gain = 0.5 * (np.linalg.slogdet(after)[1] - np.linalg.slogdet(before)[1])
        if not gain <= tried.gain:
            shrunk = np.sqrt(np.diag(np.linalg.inv(after))) / spread
            i = int(np.argmin(shrunk))
            tried = Candidate(
                conditions=dict(conditions), like=run.words, gain=float(gain), tells=unknowns.names[i],
                factor=float(shrunk[i]),
            )  # fmt: skip
    return tried


def _shape(runs: Runs, best: LocalFit, part: slice) -> Real:
    """Return the noise shape of a run at its predictions, its data where a point was not reached."""
    run = next(one for one, at_part in zip(runs.runs, runs.slices, strict=True) if at_part == part)
    values = np.where(best.active[part], best.fitted.values[part], runs.observations[part])
    return run.noise_shape(values)
