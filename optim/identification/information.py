"""What the data tell, how surely, what they do not tell, and which further measurement would tell most.

All is in unknowns scaled to their bounds, 0 to 1. What a uniform distribution over the bounds is uncertain
by, 1/√12, is the measure: a direction along which the data leave more than that open, they do not tell.

A further measurement is worth by how much it raises the determinant of the information matrix. A candidate is
a run under other conditions with the points of one that was measured (D-optimality: Atkinson, Donev, Tobias,
Optimum Experimental Designs, 2007, chapter 11). The gain is ½ ln det(I + I_c) − ½ ln det I, the factor
exp(−gain) by which the volume of the confidence ellipsoid shrinks. I is of what is known so far; the bounds
count as uniform priors, so that a direction nobody has told yet is worth much, not infinitely much.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from optim.identification.data.measured import MeasuredRows
from optim.identification.fit import HUBER, LocalFit, Runs, Unknowns
from optim.problem.checks import DesignError, is_number
from optim.problem.variables import Real
from solver.balance.balance import Kind, resolve
from solver.contacts.kernels.stick_slip_events import SEPARATED, STUCK
from solver.contacts.laws.friction import FrictionContact
from solver.errors import at
from solver.jit.fourier import Integer
from solver.results.told import Piece
from solver.scene.parameter_paths import AMPLITUDE
from solver.scene.scene import Scene

UNIFORM = 1.0 / math.sqrt(12.0)
_TINY = 1e-12  # of the largest eigenvalue, below which information is rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class Information:
    """What data and priors tell of the scaled unknowns."""

    data: Annotated[Real, "Information matrix of the data, Jᵀ J in standard deviations of the noise, (n, n)."]
    prior: Annotated[Real, "That of the priors, (n, n)."]
    degrees: Annotated[int, "Degrees of freedom of the noise level; 0 where it was given."]
    reduced_chi2: Annotated[
        float, "Mean square of the residuals in standard deviations, over the degrees of freedom."
    ]

    @property
    def total(self) -> Real:
        """Of data and priors together."""
        return self.data + self.prior

    def covariance(self) -> Real:
        """Return the covariance, (n, n); along what nothing tells, that of the bounds."""
        spread, vectors = self._principal()
        return np.asarray(vectors * np.minimum(spread, UNIFORM) ** 2 @ vectors.T)

    def standard_errors(self) -> Real:
        """Return the standard deviation of each unknown, (n,), large without end where nothing tells it."""
        spread, vectors = self._principal()
        return np.asarray(np.sqrt((vectors * spread) ** 2 @ np.ones(spread.size)))

    def _principal(self) -> tuple[Real, Real]:
        """Return standard deviations along the principal directions, worst first, and these as columns."""
        values, vectors = np.linalg.eigh(self.total)
        floor = max(_TINY * float(values[-1]), 1e-300)
        return np.asarray(1.0 / np.sqrt(np.maximum(values, floor))), np.asarray(vectors, np.float64)

    def weak(self) -> tuple[tuple[float, Real], ...]:
        """Return the directions the data do not tell, (standard deviation, unit vector), worst first."""
        spread, vectors = self._principal()
        return tuple((float(spread[i]), vectors[:, i]) for i in range(spread.size) if spread[i] > UNIFORM)

    def quantile(self) -> float:
        """Return the factor of a standard error in a 95 % interval."""
        if not self.degrees:
            return 1.959963984540054
        from scipy.stats import t

        return float(t.ppf(0.975, self.degrees))


def information(runs: Runs, found: LocalFit, *, robust: bool, level_known: bool) -> Information:
    """Return what the data tell at an optimum."""
    rest = found.residuals(runs.observations)
    rows = found.fitted.jacobian[found.active] / found.sd[found.active, None]
    n, p = rest.size, runs.fitted
    free = max(n - p, 1)
    efficiency = 1.0
    if robust:
        # Huber (1981), eq. 7.6.13: cov = K² [Σψ²/(n − p)]/[mean ψ']² (JᵀJ)⁻¹, K = 1 + p/n (1 − m)/m.
        inside = float(np.mean(np.abs(rest) <= HUBER))
        psi = np.clip(rest, -HUBER, HUBER)
        correction = 1.0 + p / n * (1.0 - inside) / inside if inside > 0.0 else math.inf
        efficiency = inside**2 * free / (correction**2 * max(float(np.sum(psi**2)), 1e-300))
    _, prior_rows = runs.unknowns.prior_rows(found.fitted.z)
    return Information(
        data=efficiency * rows.T @ rows, prior=prior_rows.T @ prior_rows, degrees=0 if level_known else free,
        reduced_chi2=float(np.sum(rest**2)) / free,
    )  # fmt: skip


_SHARE = 0.15  # of a direction, below which an unknown has no part in it
_ALIKE = 0.1  # relative difference of two logarithmic changes that cancel each other
_CORRELATED = 0.95


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Untold(Piece):
    """A direction of the unknowns along which the data tell less than the bounds."""

    names: Annotated[tuple[str, ...], "The unknowns it is of."]
    direction: Annotated[tuple[float, ...], "Their share, of unknowns scaled to their bounds."]
    words: Annotated[str, "What that means, and why, as far as it shows."]


def untold(
    scene: Scene, unknowns: Unknowns, z: Real, known: Information, states: Sequence[Mapping[str, Integer]]
) -> tuple[Untold, ...]:
    """Return the directions the data do not tell, worst first.

    Parameters
    ----------
    states : of each run, contact to the codes it had at its points.
    """
    # The state codes every contact ever had, not reached ones left out.
    seen: dict[str, set[int]] = {}
    for run in states:
        for name, codes in run.items():
            seen.setdefault(name, set()).update(int(code) for code in np.unique(codes) if code >= 0)
    return tuple(_one(scene, unknowns, z, direction, seen) for _, direction in known.weak())


def strong_correlations(unknowns: Unknowns, known: Information) -> tuple[tuple[str, str, float], ...]:
    """Return pairs of unknowns whose correlation is above 0.95, though each may be told."""
    covariance, spread = known.covariance(), known.standard_errors()
    told = [i for i in range(len(unknowns)) if spread[i] < UNIFORM]
    found = []
    for a, i in enumerate(told):
        for j in told[a + 1 :]:
            share = float(covariance[i, j] / (spread[i] * spread[j]))
            if abs(share) > _CORRELATED:
                found.append((unknowns.names[i], unknowns.names[j], share))
    return tuple(found)


def _one(scene: Scene, unknowns: Unknowns, z: Real, direction: Real, seen: Mapping[str, set[int]]) -> Untold:
    at = [i for i in np.argsort(-np.abs(direction)) if abs(direction[i]) > _SHARE]
    names = tuple(unknowns.names[i] for i in at)
    if len(at) == 1:
        words = f"The data do not tell {names[0]}: {_why(scene, unknowns, at[0], seen)}"
    else:
        words = _together(unknowns, z, direction, at)
    return Untold(names=names, direction=tuple(float(direction[i]) for i in at), words=words)


def _why(scene: Scene, unknowns: Unknowns, i: int, seen: Mapping[str, set[int]]) -> str:
    """Return the reason why an unknown does not show, as far as the states of its contacts tell it."""
    for path in unknowns.variables[i].paths:
        owner, _, key = path.rpartition(".")
        contacts = [c.name for c in scene.contacts if owner in (c.name, c.group)]
        codes = set().union(*(seen.get(name, set()) for name in contacts)) if contacts else set()
        if codes and codes <= {SEPARATED}:
            return f"`{owner}` is open at every point measured. Measure with more load on it."
        if codes == {STUCK} and key != "kt":
            return (
                f"`{owner}` never slips at any point measured, and while it sticks {key} does not show. "
                "Measure with more excitation, or less load on it."
            )
        if codes and codes != {STUCK} and key == "kt":
            return (
                f"`{owner}` never sticks for long at any point measured, and while it slips its stiffness "
                f"hardly "
                "shows. Measure with less excitation, or more load on it."
            )
    return "the responses measured hardly depend on it within its bounds."


def _together(unknowns: Unknowns, z: Real, direction: Real, at: Sequence[int]) -> str:
    """Return in words that several unknowns show in one combination only."""
    changes = direction * unknowns.slopes(z) / unknowns.values(z)
    names = [unknowns.names[i] for i in at]
    if len(at) == 2:
        a, b = (float(changes[i]) for i in at)
        if abs(abs(a) - abs(b)) <= _ALIKE * max(abs(a), abs(b)):
            what, sign = ("product", " · ") if a * b < 0.0 else ("ratio", " / ")
            text = (
                f"The data tell only the {what} {names[0]}{sign}{names[1]}, not each: more of one with "
                f"{'less' if what == 'product' else 'as much more'} of the other changes no response "
                f"measured."
            )
            return f"{text} {_remedy(names)}"
    parts = ", ".join(f"{100.0 * changes[i] / abs(changes[at[0]]):+.3g} % of {unknowns.names[i]}" for i in at)
    return (
        f"The data cannot tell {', '.join(names[:-1])} and {names[-1]} apart: {parts} together change no "
        f"response "
        "measured by more than the noise."
    )


def _remedy(names: Sequence[str]) -> str:
    keys = {name.rpartition(".")[2] for name in names}
    if keys == FrictionContact.IN_THE_LIMIT:
        return (
            "Friction limits μN alone show: measure the load itself and give it as a condition of the "
            "data, or "
            "give one of both a prior."
        )
    return "Give one of both a prior, or measure where they act differently."


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
        noise = new.noise_shape(np.where(kept, predicted.values, 0.0))[kept]
        nearly = np.where(best.active[part], best.fitted.values[part], runs.observations[part])
        noise *= np.median(best.sd[part] / run.noise_shape(nearly)) if level is None else level
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
