"""Designs and studies in a few words, with units."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from solver.results import units
from solver.results.told import Summary
from solver.scene.parameter_paths import parameter
from solver.views.summary import Pairs, made

if TYPE_CHECKING:
    from optim.identification.result import Estimate, Identification
    from optim.results.design import DesignResult
    from optim.robust.result import RobustResult
    from optim.studies.crossings import CampbellDiagram
    from optim.studies.pareto_result import ParetoResult
    from optim.studies.sensitivity_result import SensitivityResult

_MOST_ROWS = 12


def of_design(result: DesignResult) -> Summary:
    """The optimum, its peak and band, and what holds it."""
    pairs: Pairs = [(name, parameter(name, value)) for name, value in result.optimum.items()]
    for name, (low, high) in result.plateau.items():
        pairs.append((f"{name}, as good", f"{parameter(name, low)} to {parameter(name, high)}"))
    if result.chosen_by is not None:
        pairs.append(("chosen by", result.chosen_by))
    if result.peak is not None:
        pairs.append(("peak", f"{units.length(result.peak.value)} at {result.peak.at:.6g} Hz"))
    if result.peak is not None:
        pairs.append(("stable", result.stability.line))
    pairs += [("warning", words) for words in result.warnings]
    if result.band_hz is not None and result.limit is not None:
        pairs.append(("band", f"{result.band_hz:.4g} Hz above {units.length(result.limit)}"))
    pairs += [(row.quantity.name, f"{row.value:.4g} {row.quantity.unit}") for row in result.further]
    if result.active:
        pairs.append(("held by", "; ".join(result.active)))
    pairs.append(("certain", result.certainty.value))
    pairs.append(("responses", str(result.evaluations)))
    pairs.append(("time", units.duration(result.seconds)))
    return made(f"{result.scene}, {result.method.value}", pairs, result.status.value)


def of_robust(result: RobustResult) -> Summary:
    """Both optima with their peaks, nominal and worst."""
    pairs: Pairs = []
    for name, side in (("nominal", result.nominal), ("robust", result.robust)):
        if side is not None:
            values = ", ".join(f"{path} = {parameter(path, v)}" for path, v in side.values.items())
            worst = "unknown" if math.isnan(side.worst_peak) else units.length(side.worst_peak)
            pairs.append((f"{name} optimum", f"{values}: peak {units.length(side.peak)}, worst {worst}"))
    pairs += [("warning", words) for words in result.design.warnings]
    pairs.append(("time", units.duration(result.seconds)))
    return made(f"{result.problem.scene.name}, {result.aim.value}", pairs, result.status.value)


def of_front(result: ParetoResult) -> Summary:
    """Both ends of a front and its knee."""
    points, pairs = result.points, []
    places = {"least peak": 0, "knee": result.knee, "narrowest band": len(points) - 1}
    for name, place in places.items():
        if points and place is not None:
            point = points[place]
            pairs.append((name, f"{units.length(point.peak)}, band {point.band_hz:.4g} Hz"))
    pairs += [("points", str(len(points))), ("time", units.duration(result.seconds))]
    return made(f"peak against band of {result.problem.scene.name}", pairs, result.status.value)


def of_campbell(diagram: CampbellDiagram) -> Summary:
    """What every order does at running speeds."""
    pairs: Pairs = []
    for one in diagram.orders:
        highest = one.highest_running
        text = "no response at running speeds"
        if highest is not None:
            error = highest.error_estimate
            known = "not known" if math.isnan(error) else units.length(error)
            text = f"at most {units.length(highest.amplitude)} ± {known}, at {highest.speed_rpm:.6g} rpm"
        pairs.append((f"order {one.order}", text))
    pairs.append(("time", units.duration(diagram.seconds)))
    low, high = diagram.speeds_rpm[0][0], diagram.speeds_rpm[-1][1]
    return made(f"{diagram.scene.name}, {low:g} to {high:g} rpm", pairs, diagram.status.value)


def of_sensitivities(result: SensitivityResult) -> Summary:
    """Per cent of the highest peak and of the band for one per cent of what matters most."""
    pairs: Pairs = []
    for row in result.rows[:_MOST_ROWS]:
        if row.relative and result.peaks:
            band = result.band_elasticity(row)
            text = f"peak {result.peak_elasticities(row)[0]:+.4f} %"
            pairs.append((row.path, text if math.isnan(band) else f"{text}, band {band:+.4f} %"))
    pairs.append(("time", units.duration(result.seconds)))
    return made(f"{result.scene.name}, for 1 % more of each", pairs, result.status.value)


def of_identification(result: Identification) -> Summary:
    """The estimates with their intervals, and what the data do not tell."""
    pairs: Pairs = [(one.name, estimate_words(one)) for one in result.estimates]
    pairs += [("not told", one.words) for one in result.untold]
    if not math.isnan(result.noise):
        pairs.append(("noise", f"{100.0 * result.noise:.3g} %"))
    if result.misfit:
        pairs.append(("warning", result.misfit))
    pairs.append(("time", units.duration(result.seconds)))
    return made(f"{result.scene}, {len(result.runs)} runs", pairs, result.status.value)


def estimate_words(one: Estimate) -> str:
    """An estimate with its standard error and interval, or that the data do not tell it."""
    if not one.told:
        ends = " and ".join(parameter(one.name, end) for end in (one.low, one.high))
        return f"not told by the data, between {ends}"
    low, high = one.interval
    edge = ", at its bound" if one.at_bound else ""
    value = parameter(one.name, one.value)
    return f"{value} ± {one.standard_error:.2g}, 95 % {low:.6g} to {high:.6g}{edge}"
