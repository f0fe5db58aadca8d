"""The fit: what is looked for, predictions of all runs at once, least squares with noise that the fit tells.

The noise of an observation is in proportion to what the model says, not to what was measured: small readings
would else weigh too much, and amplitudes come out too low. Proportion and level are therefore found anew
between rounds of Gauss-Newton (iteratively reweighted least squares). Outliers weigh less: Huber's loss with
the level of the noise from the median of the residuals (Huber, Robust Statistics, 1981, sections 7.7 and
7.8). Of many starts, thinned runs rank places all over the bounds; from the best all runs are fitted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from optim.identification.data.measured import MeasuredRows, Predicted
from optim.methods.linearised import quasi_random
from optim.problem.checks import DesignError, is_number
from optim.problem.variables import (
    BoundedVariable,
    Real,
    by_variables,
    check_variables,
    parameter_values,
    slopes,
    unscaled,
)
from solver.jit.fourier import Integer
from solver.results.watch import OnProgress, ShouldStop
from solver.scene.scene import Scene

UNKNOWNS, PRIORS = "unknowns", "priors"
FIRMEST = (
    1e-6  # standard deviation of a prior relative to the width of the bounds, below which it is no unknown
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """A normal distribution of a parameter before the data: mean and standard deviation in its unit."""

    mean: float
    sd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Unknowns:
    """Parameters within bounds, each scaled to z from 0 to 1, logarithmically over wide ranges."""

    variables: Annotated[tuple[BoundedVariable, ...], "Tuple of Variable."]
    priors: Annotated[Mapping[str, Prior], "Name of a variable to what was known of it."]

    def __len__(self) -> int:
        return len(self.variables)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables, in order."""
        return tuple(variable.name for variable in self.variables)

    @property
    def paths(self) -> tuple[str, ...]:
        """The parameter paths of all variables, in the order derivatives have."""
        return tuple(path for variable in self.variables for path in variable.paths)

    def by_path(self, z: Real) -> dict[str, float]:
        """Return parameter path to value of scaled values."""
        return parameter_values(self.variables, unscaled(self.variables, z))

    def values(self, z: Real) -> Real:
        """Return the values of scaled ones, (n,), each in its unit."""
        return np.array(list(unscaled(self.variables, z).values()))

    def slopes(self, z: Real) -> Real:
        """Return d value / dz, (n,)."""
        return slopes(self.variables, unscaled(self.variables, z))

    def by_scaled(self, z: Real, by_paths: Real) -> Real:
        """Return derivatives by z, (rows, n), of derivatives by the paths (rows, n_paths)."""
        return np.asarray(by_variables(self.variables, by_paths.T).T * self.slopes(z))

    def prior_rows(self, z: Real) -> tuple[Real, Real]:
        """Return (value − mean)/sd of each prior, (n_priors,), and the derivatives by z, (n_priors, n)."""
        values, by = self.values(z), self.slopes(z)
        at = [i for i, name in enumerate(self.names) if name in self.priors]
        priors = [self.priors[self.names[i]] for i in at]
        rows = np.array([(values[i] - p.mean) / p.sd for i, p in zip(at, priors, strict=True)])
        jacobian = np.zeros((len(at), len(self)))
        for row, (i, p) in enumerate(zip(at, priors, strict=True)):
            jacobian[row, i] = by[i] / p.sd
        return rows, jacobian

    def start(self, scene: Scene) -> Real:
        """Return the scaled values of the scene, kept within the bounds; the middle where it has none."""
        values = [scene.value(variable.paths[0]) for variable in self.variables]
        return np.array([
            variable.inside(value) if variable.low <= value <= variable.high else 0.5
            for variable, value in zip(self.variables, values, strict=True)
        ])  # fmt: skip


def read_unknowns(
    scene: Scene, unknowns: Mapping[str, Sequence[float]], scaling: Mapping[str, str] | None,
    priors: Mapping[str, Sequence[float]] | None,
) -> Unknowns:  # fmt: skip
    """Return the unknowns of a description.

    Parameters
    ----------
    unknowns : parameter path (several that share a value separated by commas) to (low, high).
    scaling : names to ``linear``, ``logarithmic`` or ``auto``.
    priors : names to (mean, standard deviation).

    Raises
    ------
    DesignError, SettingError
        Names the path, the value and what would be right.
    """
    if not isinstance(unknowns, Mapping) or not unknowns:
        raise DesignError(UNKNOWNS, unknowns, "must name at least one parameter path with (low, high)")
    variables = check_variables(scene, unknowns, scaling, key=UNKNOWNS)
    by_name = {variable.name: variable for variable in variables}
    known: dict[str, Prior] = {}
    for name, pair in (priors or {}).items():
        if name not in by_name:
            wanted = f"must be of an unknown, one of {', '.join(by_name)}"
            raise DesignError(PRIORS, name, wanted, place=(PRIORS, name))
        good = isinstance(pair, Sequence) and len(pair) == 2 and all(is_number(value) for value in pair)
        wide = by_name[name].high - by_name[name].low
        if not good or pair[1] < FIRMEST * wide:
            wanted = "must be a mean and a standard deviation > 0, both in the unit of the parameter"
            raise DesignError((PRIORS, name), pair, wanted)
        known[name] = Prior(mean=float(pair[0]), sd=float(pair[1]))
    return Unknowns(variables=variables, priors=known)


@dataclass(frozen=True, slots=True, kw_only=True)
class Fitted:
    """The predictions of all runs at one place."""

    z: Annotated[Real, "Scaled unknowns, (n,)."]
    values: Annotated[Real, "Predicted observations, NaN where not reached, (N,)."]
    jacobian: Annotated[Real, "By z, (N, n)."]
    reached: Annotated[np.ndarray, "(N,) of bool."]
    states: Annotated[tuple[Mapping[str, Integer], ...], "Of each run, contact to state codes."]


class Runs:
    """The models of all runs.

    Parameters
    ----------
    scene : what was measured.
    runs : the data.
    unknowns : what is looked for.
    harmonics : highest harmonic of the balance.
    slopes : compute derivatives; else the Jacobian is 0.
    """

    def __init__(
        self, scene: Scene, runs: Sequence[MeasuredRows], unknowns: Unknowns, harmonics: int,
        *, slopes: bool = True,
    ) -> None:  # fmt: skip
        self.scene, self.runs, self.unknowns, self.harmonics = scene, tuple(runs), unknowns, harmonics
        self._slopes = slopes
        self.models = [run.model(scene, unknowns.paths if slopes else (), harmonics) for run in self.runs]
        self.observations = np.concatenate([run.observations for run in self.runs])
        sizes = [run.observations.size for run in self.runs]
        self.slices = [slice(end - size, end) for end, size in zip(np.cumsum(sizes), sizes, strict=True)]
        self.fitted = len(unknowns) + sum(run.FITTED_BESIDES for run in self.runs)
        self.evaluations = 0
        self._last: Fitted | None = None

    def at(self, z: Real) -> Fitted:
        """Return the predictions at scaled unknowns; those just computed are kept."""
        if self._last is not None and np.array_equal(self._last.z, z):
            return self._last
        values = self.unknowns.by_path(z)
        found: list[Predicted] = [model.evaluate(values) for model in self.models]
        by_paths = np.concatenate([one.slopes for one in found])
        by_z = np.zeros((len(by_paths), len(self.unknowns)))
        self._last = Fitted(
            z=z.copy(), values=np.concatenate([one.values for one in found]),
            jacobian=self.unknowns.by_scaled(z, by_paths) if self._slopes else by_z,
            reached=np.concatenate([one.reached for one in found]),
            states=tuple(one.states for one in found),
        )  # fmt: skip
        self.evaluations += 1
        return self._last

    def forget(self) -> None:
        """Look for the branches of all responses anew."""
        self._last = None
        for model in self.models:
            model.forget()

    def noise(self, values: Real, level: float | None) -> tuple[Real, np.ndarray]:
        """Return the standard deviation of every observation, and which of them are known, (N,) each.

        Parameters
        ----------
        values : (N,) the observations as they truly are, or nearly.
        level : relative to the noise shape of each run; None where it is not known: the shape itself then.
        """
        sd, known = np.empty(values.size), np.empty(values.size, dtype=bool)
        for run, part in zip(self.runs, self.slices, strict=True):
            given = run.given_noise
            known[part] = given is not None or level is not None
            shape = run.noise_shape(values[part]) if given is None else given
            sd[part] = shape if given is not None or level is None else level * shape
        return sd, known

    def thinned(self, most: int) -> Runs:
        """Return the same with at most so many points of each run."""
        return Runs(self.scene, [run.thinned(most) for run in self.runs], self.unknowns, self.harmonics)

    def without_slopes(self) -> Runs:
        """Return the same without derivatives, at a part of the work."""
        return Runs(self.scene, self.runs, self.unknowns, self.harmonics, slopes=False)


HUBER = 1.345  # standard deviations from which a residual weighs less: 95 % efficient without outliers
FIRST_LEVEL = 0.03  # relative noise assumed before any fit has shown it
LEAST_LEVEL = 1e-9  # of relative noise: data without any, made by the model itself
_MOST_ROUNDS = 6
_SETTLED = 0.02  # standard errors by which a round may move an unknown once all has settled
_MOST_EVALUATIONS = 60
_NORMAL = 1.4826  # standard deviation over the median of |residual| of a normal distribution
_EDGE = 1e-9  # scaled distance from a bound at which a search begins


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """What is known of the noise, and how residuals count."""

    level: Annotated[float | None, "Relative standard deviation; None where the residuals shall tell."]
    robust: Annotated[bool, "Whether outliers weigh less."]


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalFit:
    """A local optimum."""

    fitted: Annotated[Fitted, "The predictions there."]
    sd: Annotated[Real, "Standard deviation of every observation, (N,)."]
    level: Annotated[
        float, "By which noise of unknown level was found to be in proportion; 1 if all is known."
    ]
    active: Annotated[np.ndarray, "The observations that counted, (N,) of bool: those reached."]
    cost: Annotated[float, "Half the sum of the losses, priors included."]
    converged: bool

    def residuals(self, observations: Real) -> Real:
        """Return (predicted − measured)/sd of what counted."""
        rest: Real = (self.fitted.values - observations) / self.sd
        return np.asarray(rest[self.active], np.float64)


def fit(runs: Runs, z: Real, noise: Noise, *, rounds: int = _MOST_ROUNDS) -> LocalFit:
    """Find a local optimum from scaled unknowns."""
    sd, known = runs.noise(runs.observations, noise.level)
    level = 1.0 if known.all() else FIRST_LEVEL
    for turn in range(rounds):
        weights = np.where(known, sd, level * sd)
        found = _search(runs, z, weights, noise.robust)
        moved = np.inf if turn == 0 else _moved(found, found.fitted.z - z)
        z, before = found.fitted.z, level
        filled = np.where(found.active, found.fitted.values, runs.observations)
        sd, known = runs.noise(filled, noise.level)
        level = before if known.all() else _level(runs, found, sd, known, robust=noise.robust)
        if moved < _SETTLED and abs(level - before) < 1e-2 * before:
            break
        if level <= LEAST_LEVEL:
            break
    final = np.where(known, sd, level * sd)
    return LocalFit(
        fitted=found.fitted, sd=final, level=level, active=found.active, cost=found.cost,
        converged=found.converged,
    )  # fmt: skip


def _level(runs: Runs, found: LocalFit, sd: Real, known: np.ndarray, *, robust: bool) -> float:
    """Return the level of the noise that is not known, from what a fit left over."""
    counted = found.active & ~known
    rest = ((found.fitted.values - runs.observations) / sd)[counted]
    share = rest.size / max(rest.size - runs.fitted, 1)
    if robust:
        return max(_NORMAL * float(np.median(np.abs(rest))) * math.sqrt(share), LEAST_LEVEL)
    return max(float(np.sqrt(np.mean(rest**2) * share)), LEAST_LEVEL)


def _moved(found: LocalFit, step: Real) -> float:
    """Return how far a round moved, in standard errors."""
    rows = found.fitted.jacobian[found.active] / found.sd[found.active, None]
    return float(np.linalg.norm(rows @ step) / np.sqrt(step.size))


def _search(runs: Runs, z: Real, sd: Real, robust: bool) -> LocalFit:
    """Run Gauss-Newton with a trust region under given weights; points not reached at its start are left out.

    A trial that loses a point is no number, so that the trust region shrinks: no point leaves on the way.
    """
    # Loaded here: the words of a description need no search.
    from scipy.optimize import least_squares

    start = np.clip(z, _EDGE, 1.0 - _EDGE)
    active = runs.at(start).reached.copy()
    n_data, target, weights = int(active.sum()), runs.observations[active], sd[active]

    def residuals(x: Real) -> Real:
        found = runs.at(x)
        data = (found.values[active] - target) / weights
        data = np.where(found.reached[active], data, np.nan)
        return np.concatenate([data, runs.unknowns.prior_rows(x)[0]])

    def jacobian(x: Real) -> Real:
        rows = runs.at(x).jacobian[active] / weights[:, None]
        return np.concatenate([rows, runs.unknowns.prior_rows(x)[1]])

    def loss(squares: Real) -> Real:
        # Of Huber's loss two derivatives; the priors count plainly.
        value, slope, bend = squares.copy(), np.ones_like(squares), np.zeros_like(squares)
        far = np.flatnonzero(squares[: n_data if robust else 0] > HUBER**2)
        size = np.sqrt(squares[far])
        value[far] = 2.0 * HUBER * size - HUBER**2
        slope[far], bend[far] = HUBER / size, -0.5 * HUBER / size**3
        return np.stack((value, slope, bend))

    found = least_squares(
        residuals, start, jac=jacobian, bounds=(0.0, 1.0), method="trf", loss=loss if robust else "linear",
        ftol=1e-10, xtol=1e-10, gtol=1e-10, max_nfev=_MOST_EVALUATIONS,
    )  # fmt: skip
    return LocalFit(
        fitted=runs.at(np.asarray(found.x)), sd=sd, level=1.0, active=active, cost=float(found.cost),
        converged=bool(found.status > 0),
    )  # fmt: skip


STARTS, MOST_STARTS = 16, 1000
_POINTS = 12  # of a run in the first look
_SEARCHED = 3  # of the ranked places
_ENOUGH = 0.8  # share of the points that a place must reach to be a start
_COARSE = 0.1  # relative distance of a prediction from which it hardly matters how far it is
_APART = 0.02  # scaled distance between optima that are two
_WORSE = 0.5  # share of the progress that the first look is worth


@dataclass(frozen=True, slots=True, kw_only=True)
class Searched:
    """What the search found."""

    best: Annotated[
        LocalFit | None,
        "None where no place reached enough points, or the search was stopped before any fit.",
    ]
    others: Annotated[
        tuple[tuple[Real, float], ...],
        "Further local optima of the thinned runs, cost relative to that of the best.",
    ]
    starts: Annotated[int, "Places tried."]
    agreeing: Annotated[int, "Searches of the first look that ended at the best."]


def search(
    runs: Runs, noise: Noise, *, starts: int, seed: int, on_progress: OnProgress, should_stop: ShouldStop
) -> Searched:
    """Fit all runs from the best of many starts."""
    coarse = runs.thinned(_POINTS)
    ranked: list[tuple[float, Real]] = []
    # The scene's own values, the middle, and places of a Sobol sequence.
    n = len(runs.unknowns)
    middle = np.full(n, 0.5)
    rest = max(starts - 2, 0)
    sobol = quasi_random(n, max(rest, 1), seed)[:rest]
    places = [runs.unknowns.start(runs.scene), middle, *sobol][:starts]
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
        # Again with the solutions nearest to the data at the optimum, while that makes it better.
        for _ in range(3):
            runs.forget()
            again = fit(runs, best.fitted.z, noise)
            settled = np.allclose(again.fitted.z, best.fitted.z, atol=1e-4)
            best = again
            if settled:
                break
    if on_progress is not None:
        on_progress(1.0, runs.evaluations)
    return Searched(best=best, others=others, starts=len(places), agreeing=len(fits) - len(others))


def misfit(runs: Runs, found: Fitted) -> float:
    """Return how far predictions are from the data, of which no single one can matter too much."""
    shape, _ = runs.noise(runs.observations, 1.0)
    reached = found.reached
    rest = ((found.values - runs.observations) / (_COARSE * shape))[reached]
    prior, _ = runs.unknowns.prior_rows(found.z)
    return float(np.sum(np.log1p(rest**2)) * reached.size / max(int(reached.sum()), 1) + np.sum(prior**2))
