"""Designs and studies as named arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from solver.results.files import Dataset, Variable
from solver.scene.parameter_paths import parameter_unit
from solver.views.to_dataset import attributes, column
from solver.views.to_dataset import described as described  # of classes that say their data set

if TYPE_CHECKING:
    from optim.criteria.constraint_rows import DesignEvaluation
    from optim.identification.identification_result import Identification
    from optim.problem.variables import BoundedVariable as DesignVariable
    from optim.results.design_result import DesignResult
    from optim.results.studies_result import CampbellDiagram, ParetoResult, SensitivityResult
    from optim.robust.robust_result import RobustResult


def design_dataset(result: DesignResult) -> Dataset:
    """A design that was tried a row, with the optimum marked."""
    tried = [one for one in result.history if one.good]
    if result.evaluation is not None and result.evaluation.good and result.evaluation not in tried:
        tried.append(result.evaluation)
    variables = _values("design", result.problem.variables, [one.values for one in tried])
    tops = [(one.peaks[0].value, one.peaks[0].at_hz) if one.peaks else (math.nan, math.nan) for one in tried]
    heights, places = np.array(tops, dtype=np.float64).reshape(-1, 2).T
    bands = [math.nan if one.band is None else one.band.value for one in tried]
    variables |= {
        "peak": column("design", heights, "m", "highest peak"),
        "peak_frequency": column("design", places, "Hz", "where it is"),
        "band": column("design", np.array(bands), "Hz", "width of the widest resonance band"),
        "objective": column("design", np.array([one.objective for one in tried]), "", "what is minimised"),
        "optimum": column("design", np.array([one is result.evaluation for one in tried], dtype=bool)),
    }
    if len(result.problem.cases) > 1:
        variables |= _peaks_of_cases([case.name for case in result.problem.cases], tried)
    for row in result.further:
        values = [next((found.value for found in one.of(row.quantity)), math.nan) for one in tried]
        name, unit = row.quantity.name, row.quantity.unit
        variables[name.replace(" ", "_")] = column("design", np.array(values), unit, f"largest {name}")
    notes = attributes(
        result.status.value, result.problem.scene, method=result.method.value,
        active="; ".join(result.active), limit=result.limit,
    )  # fmt: skip
    return Dataset(kind="design", rows=("design",), variables=variables, attributes=notes)


def _peaks_of_cases(names: Sequence[str], tried: Sequence[DesignEvaluation]) -> dict[str, Variable]:
    """The highest peak of every load case, NaN where none of it competes."""
    found: dict[str, Variable] = {}
    for name in names:
        highest = [next((peak for peak in one.peaks if peak.case == name), None) for one in tried]
        heights = np.array([math.nan if peak is None else peak.value for peak in highest])
        places = np.array([math.nan if peak is None else peak.at_hz for peak in highest])
        found[f"peak_of_{name}"] = column("design", heights, "m", f"highest peak of {name}")
        found[f"peak_frequency_of_{name}"] = column("design", places, "Hz", "where it is")
    return found


def _values(
    dim: str, variables: Sequence[DesignVariable], designs: Sequence[Mapping[str, float]]
) -> dict[str, Variable]:
    """The values of the design variables, one column each."""
    return {
        v.name: column(
            dim, np.array([values[v.name] for values in designs], dtype=np.float64),
            parameter_unit(v.paths[0]), "design variable",
        )
        for v in variables
    }  # fmt: skip


def robust_dataset(result: RobustResult) -> Dataset:
    """A sample of the uncertainty a row, with the highest peak of both optima."""
    variables: dict[str, Variable] = {}
    for name, side in (("nominal", result.nominal), ("robust", result.robust)):
        if side is not None and side.spread.peaks:
            variables[f"{name}_peak"] = column(
                "sample", np.array(side.spread.peaks), "m", f"highest peak of the {name} optimum"
            )
    notes = attributes(
        result.status.value, result.problem.scene, aim=result.aim.value, quantile=result.quantile
    )
    for name, side in (("nominal", result.nominal), ("robust", result.robust)):
        values = {} if side is None else side.values
        notes |= {f"{name}_{path}": value for path, value in values.items()}
    return Dataset(kind="robust", rows=("sample",), variables=variables, attributes=notes)


def front_dataset(result: ParetoResult) -> Dataset:
    """A point of the front a row, from the least peak on."""
    points = result.points
    variables = _values("point", result.problem.variables, [point.values for point in points])
    for name, field, unit, about in (
        ("peak", "peak", "m", "highest peak"), ("peak_frequency", "at_hz", "Hz", "where it is"),
        ("band", "band_hz", "Hz", "width of the resonance band"),
        ("slope", "slope", "m/Hz", "d peak / d band along the front"),
    ):  # fmt: skip
        values = np.array([getattr(point, field) for point in points], dtype=np.float64)
        variables[name] = column("point", values, unit, about)
    knee = np.arange(len(points)) == (-1 if result.knee is None else result.knee)
    variables["knee"] = column("point", knee)
    notes = attributes(result.status.value, result.problem.scene, limit=result.problem.limit)
    return Dataset(kind="pareto", rows=("point",), variables=variables, attributes=notes)


def campbell_dataset(diagram: CampbellDiagram) -> Dataset:
    """A crossing of an order with a peak a row; beside it the response of every order."""
    found = [(one.order, crossing) for one in diagram.orders for crossing in one.crossings]
    variables = {
        "order": column("crossing", np.array([order for order, _ in found], dtype=np.int64)),
        "inside": column("crossing", np.array([c.inside for _, c in found], dtype=bool)),
    }
    for name, field, unit in (
        ("speed", "speed_rpm", "1/min"), ("frequency", "frequency_hz", "Hz"), ("amplitude", "amplitude", "m"),
        ("margin", "margin", ""),
    ):  # fmt: skip
        values = np.array([getattr(crossing, field) for _, crossing in found], dtype=np.float64)
        variables[name] = column("crossing", values, unit)
    for one in diagram.orders:
        dim = f"point_of_{one.order}"
        variables[f"frequency_of_{one.order}"] = column(dim, one.branch.values, "Hz")
        variables[f"amplitude_of_{one.order}"] = column(dim, one.branch.amplitude, "m")
    notes = attributes(
        diagram.status.value, diagram.scene, harmonics=diagram.n_harmonics, limit=diagram.limit
    )
    return Dataset(kind="campbell", rows=("crossing",), variables=variables, attributes=notes)


def sensitivities_dataset(result: SensitivityResult) -> Dataset:
    """A parameter a row: its value, and what one per cent of it does."""
    rows = result.rows
    shares = [result.peak_elasticities(row)[0] if row.peaks else math.nan for row in rows]
    variables = {
        "path": column("parameter", np.array([row.path for row in rows], dtype=np.str_)),
        "value": column("parameter", np.array([row.value for row in rows], dtype=np.float64)),
        "unit": column("parameter", np.array([row.unit for row in rows], dtype=np.str_)),
        "peak_percent": column("parameter", np.array(shares, dtype=np.float64), "%", "of the highest peak"),
        "band_percent": column(
            "parameter", np.array([result.band_elasticity(row) for row in rows], dtype=np.float64), "%",
            "of the resonance band",
        ),
    }  # fmt: skip
    notes = attributes(result.status.value, result.scene)
    return Dataset(kind="sensitivities", rows=("parameter",), variables=variables, attributes=notes)


def identification_dataset(result: Identification) -> Dataset:
    """An unknown a row; beside it data, fit and standard deviation of the fit of every run."""
    estimates = result.estimates
    variables = {
        "name": column("unknown", np.array([one.name for one in estimates], dtype=np.str_)),
        "unit": column("unknown", np.array([one.unit for one in estimates], dtype=np.str_)),
        "told": column("unknown", np.array([one.told for one in estimates], dtype=bool)),
    }
    for name, values in (
        ("value", [one.value for one in estimates]),
        ("standard_error", [one.standard_error for one in estimates]),
        ("low", [one.interval[0] for one in estimates]),
        ("high", [one.interval[1] for one in estimates]),
    ):
        variables[name] = column("unknown", np.array(values, dtype=np.float64), "", "in the unit of the row")
    for i, run in enumerate(result.runs):
        for key in ("x", "data", "fit", "fit_sd"):
            values = [math.nan if value is None else value for value in run[key]]
            variables[f"{key}_of_{i}"] = column(f"point_of_{i}", np.array(values, dtype=np.float64))
    notes = attributes(
        result.status.value, scene=None, name=result.scene, noise=result.noise, harmonics=result.harmonics
    )
    return Dataset(kind="identification", rows=("unknown",), variables=variables, attributes=notes)
