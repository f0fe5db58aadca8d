"""The performance curve as a method: the peak of one nonlinear mode in place of whole responses.

Coulomb friction scales: where one variable sets the normal load of every contact, the peak at a load v is
that of the load v₀ under v₀/v times the excitation, times v/v₀: one curve serves every design. Else a curve
is followed for each, and its peak has an exact gradient. One whole response at the optimum says how far the
curve is off; the correction estimates it without (both are of `solver.modes.peaks.peak_correction`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.evaluation import evaluate
from optim.methods.evaluator import SearchStoppedError, stop_if_asked
from optim.methods.linearised import of_one, quasi_random
from optim.problem.design_problem import Method, Problem
from optim.problem.variables import BoundedVariable, Real, by_variables, parameter_values, unscaled
from optim.results.design_result import CurveCheck, DesignResult, DesignStatus
from solver.jit.timer import clock
from solver.modes.peaks.peak_correction import CurvePeak, corrected_peak, peak_at_excitation
from solver.modes.peaks.performance import PerformanceCurve, performance_over
from solver.results.watch import OnProgress, ShouldStop
from solver.scene.scene import Scene

_PLACES = 65  # loads at which a shared curve is read
_LOOKS_ONE, _LOOKS_EACH = 9, 8  # designs a search begins with: of one variable, and for each of more
_STARTS = 2
_CLOSE, _TRIES = 1e-6, 40  # scaled variable, to which the least of a shared curve is known
_MOST_CURVES, _SETTLED = 15, 1e-6  # of a local search, and the relative change of the peak that ends it
_LEVEL = 1e-9  # relative change of the peak over all designs below which it depends on none
_EXACT_RESPONSES = 3.0  # the work of a tracked peak with two basins, at least (docs/modes.md)
_NEAR = (0.2, 1.0)  # factors on the excitation a curve of one design covers


@dataclass(slots=True, kw_only=True)
class _Curves:
    """The peak of one mode over the designs."""

    problem: Problem
    should_stop: ShouldStop
    on_progress: OnProgress
    count: int = 0
    seen: list[tuple[Real, float]] = field(default_factory=list)

    def scene(self, values: Mapping[str, float]) -> Scene:
        """Return the scene of a design."""
        problem = self.problem
        return problem.cases[0].scene.with_values(parameter_values(problem.variables, values))

    def curve(self, values: Mapping[str, float], factors: tuple[float, float]) -> PerformanceCurve:
        """Return the curve of a design; raises StoppedError if the caller stops it."""
        stop_if_asked(self.should_stop)
        self.count += 1
        if self.on_progress is not None:
            self.on_progress(min(0.9, self.count / 50.0), self.count)
        return performance_over(self.scene(values), factors, harmonics=self.problem.harmonics)

    def peak(self, z: Real) -> tuple[float, Real]:
        """Return the peak of a design in scaled variables, with its gradient; infinite if it has none."""
        variables = self.problem.variables
        values = unscaled(variables, z)
        found = peak_at_excitation(self.curve(values, _NEAR), 1.0, self.problem.paths)
        if not math.isfinite(found.peak):
            return math.inf, np.zeros(len(variables))
        by = by_variables(variables, found.gradient)
        slope = by * np.array([variable.slope(values[variable.name]) for variable in variables])
        self.seen.append((np.array(z), found.peak))
        return found.peak, np.where(np.isfinite(slope), slope, 0.0)


def curve_optimum(problem: Problem, *, on_progress: OnProgress, should_stop: ShouldStop) -> DesignResult:
    """Find the design that makes the peak of one nonlinear mode least, and compute its response.

    Parameters
    ----------
    problem : whose `why_no_curve` is None.
    on_progress : called with (share done, curves so far).
    should_stop : asked between curves.
    """
    begun = clock()

    def ended(
        status: DesignStatus, evaluation: DesignEvaluation | None = None, check: CurveCheck | None = None
    ) -> DesignResult:
        computed = int(evaluation is not None)
        return of_one(
            problem, Method.PERFORMANCE_CURVE, status, evaluation, basins=(), curve=check,
            evaluations=computed, work=float(computed),
        )  # fmt: skip

    curves = _Curves(problem=problem, should_stop=should_stop, on_progress=on_progress)
    try:
        shared = _shared(curves)
        z, curve = (_own(curves), None) if shared is None else shared
    except SearchStoppedError as stop:
        return ended(stop.status)
    if z is None:
        return ended(DesignStatus.NO_CURVE)
    peaks = [peak for _, peak in curves.seen]
    if max(peaks) - min(peaks) <= _LEVEL * max(peaks):
        return ended(DesignStatus.FLAT)
    values = unscaled(problem.variables, z)
    ratio = 1.0
    if curve is None:
        own = curves.curve(values, _NEAR)
    else:
        own, ratio = curve, values[problem.variables[0].name] / _middle(problem.variables[0])
    synthesised = ratio * peak_at_excitation(own, 1.0 / ratio).peak
    found = clock()
    corrected = ratio * corrected_peak(own, 1.0 / ratio).peak
    estimated = clock()
    evaluation = evaluate(problem, values, should_stop=should_stop)
    exact = evaluation.peaks[0].value if evaluation.good and evaluation.peaks else math.nan
    check = CurveCheck(
        mode=own.mode.mode, shared=curve is not None, curves=curves.count, synthesised=synthesised,
        corrected=corrected, exact=exact, tolerance=problem.tolerance, curve_seconds=found - begun,
        correction_seconds=estimated - found, response_seconds=clock() - estimated,
        exact_responses=_EXACT_RESPONSES,
    )  # fmt: skip
    if on_progress is not None:
        on_progress(1.0, curves.count)
    if not math.isfinite(exact):
        return ended(DesignStatus.NO_RESPONSE, evaluation, check)
    status = DesignStatus.APPROXIMATE if check.holds else DesignStatus.CURVE_OFF
    return ended(status, evaluation, check)


def sets_every_load(scene: Scene, variable: BoundedVariable) -> bool:
    """Return whether a variable is the mean load of every contact, in proportion to which the load varies."""
    wanted = set()
    for contact in scene.contacts:
        if getattr(contact, "N0", None) is None:
            return False
        load = contact.load
        if load is None or not load.in_proportion:
            return False
        wanted.add(f"{contact.name}.N0")
    return bool(wanted) and set(variable.paths) == wanted


def _middle(variable: BoundedVariable) -> float:
    """Return the load that a shared curve is of."""
    return math.sqrt(variable.low * variable.high)


def _shared(curves: _Curves) -> tuple[Real | None, PerformanceCurve] | None:
    """Return the best design by one curve for all, scaled, with the curve; None if one does not serve."""
    problem = curves.problem
    variable = problem.variables[0]
    scene = problem.cases[0].scene
    if len(problem.variables) > 1 or variable.low <= 0.0 or not sets_every_load(scene, variable):
        return None
    middle = _middle(variable)
    factors = middle / variable.high, middle / variable.low
    curve = curves.curve({variable.name: middle}, factors)
    if not curve.scales:
        return None

    def height(z: float, *, solved: bool) -> float:
        ratio = variable.outside(z) / middle
        if not solved:
            return ratio * curve.at_excitation(1.0 / ratio)[0]
        found: CurvePeak = peak_at_excitation(curve, 1.0 / ratio)
        return ratio * found.peak if math.isfinite(found.peak) else math.inf

    places = np.linspace(0.0, 1.0, _PLACES)
    heights = np.array([height(float(z), solved=False) for z in places])
    if not np.isfinite(heights).any():
        return None, curve
    curves.seen += [
        (np.array([z]), float(h)) for z, h in zip(places, heights, strict=True) if math.isfinite(h)
    ]
    i = int(np.nanargmin(heights))
    ends = float(places[max(i - 1, 0)]), float(places[min(i + 1, _PLACES - 1)])
    options = {"xatol": _CLOSE, "maxiter": _TRIES}
    refined = minimize_scalar(
        lambda z: height(z, solved=True), bounds=ends, method="bounded", options=options
    )
    # A bounded search stays a hair's breadth off the ends.
    best = min((refined.x, *ends, float(places[i])), key=lambda z: height(float(z), solved=True))
    return np.array([float(best)]), curve


def _own(curves: _Curves) -> Real | None:
    """Return the best design by a curve for each, scaled; None where no curve reaches the excitation."""
    n = len(curves.problem.variables)
    looks = np.linspace(0.0, 1.0, _LOOKS_ONE)[:, None] if n == 1 else quasi_random(n, _LOOKS_EACH * n)
    start = curves.problem.start
    if start is not None:
        own = [variable.inside(start[variable.name]) for variable in curves.problem.variables]
        looks = np.vstack([own, looks])
    heights = np.array([curves.peak(z)[0] for z in looks])
    order = np.argsort(heights)
    if not math.isfinite(heights[order[0]]):
        return None
    scale = float(heights[order[0]])

    def relative(z: Real) -> tuple[float, Real]:
        peak, slope = curves.peak(np.clip(z, 0.0, 1.0))
        return (peak / scale, slope / scale) if math.isfinite(peak) else (1e3, np.zeros(n))

    options = {"maxfun": _MOST_CURVES, "ftol": _SETTLED}
    for place in looks[order[: min(n, _STARTS)]]:
        minimize(relative, place, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * n, options=options)
    return min(curves.seen, key=lambda one: one[1])[0]
