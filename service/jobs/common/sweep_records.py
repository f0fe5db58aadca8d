"""From a branch of the solver and a design to a sweep and a design as they are stored."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from service.jobs.stored_figures import ContactValues, DesignRecord, StoredArray, SweepRecord, VariableValues
from service.jobs.strict_json import digest
from solver.results.told import json_number
from solver.scene.scene import AnyContact, Scene

if TYPE_CHECKING:
    from optim.results.design_result import DesignResult
    from optim.robust.robust_result import RobustResult
    from solver import AnyBranch

_STORED = tuple(field.name for field in fields(ContactValues) if field.name != "name")
_ARRAYS = ("amplitude", "half_peak_to_peak", "mean", "coefficients", "observed")


def sweep_record(
    branch: AnyBranch, frequency_hz: float | None = None, *, intermediate: bool = False
) -> SweepRecord:
    """The branch with the columns people filter by; the scene's values are those that stayed fixed.

    Parameters
    ----------
    branch : with at least one point.
    frequency_hz : excitation frequency [Hz], if another parameter was swept.
    intermediate : whether it was computed on the way to another result.
    """
    scene, parameter = branch.scene, branch.parameter
    peak = branch.peak
    band = branch.band if parameter == "frequency" else None
    amplitude = "excitation.amplitude"
    unstable = branch.bifurcations.unstable
    return SweepRecord(
        scene_name=scene.name, scene_hash=digest(scene.to_dict()), parameter=parameter,
        from_value=branch.start, to_value=branch.stop, frequency_hz=frequency_hz,
        excitation_amplitude=None if parameter == amplitude else scene.value(amplitude),
        harmonics=branch.n_harmonics, points=len(branch.values),
        peak=None if peak is None else peak.value, peak_at=None if peak is None else peak.at,
        limit=None if band is None else band.limit, band_hz=None if band is None else band.width,
        newton_iterations=branch.newton_iterations, rejected_steps=branch.rejected_steps,
        seconds=branch.seconds, completed=branch.reached, status=branch.status.value,
        error_estimate=json_number(branch.error_estimate),
        peaks_known=branch.peak_certificate.known, intermediate=intermediate,
        contacts=contact_values(scene, parameter),
        arrays={
            "parameter": StoredArray.of(branch.values),
            "residual": StoredArray.of(branch.residuals),
            "states": StoredArray.of(branch.states.astype(np.int8)),
        }
        | {name: StoredArray.of(getattr(branch, name)) for name in _ARRAYS}
        | ({"unstable": StoredArray.of(unstable.astype(np.int8))} if unstable.any() else {}),
    )  # fmt: skip


def sweep_records(branches: Iterable[AnyBranch], *, intermediate: bool = False) -> tuple[SweepRecord, ...]:
    """The frequency responses that have points, each once; `intermediate` as of `sweep_record`."""
    once = {id(branch): branch for branch in branches if len(branch.values)}
    return tuple(sweep_record(branch, intermediate=intermediate) for branch in once.values())


def packed(records: Iterable[SweepRecord]) -> tuple[list[dict[str, Any]], dict[str, StoredArray]]:
    """Records as the parts of a job give them back: JSON, and their arrays by names of their own."""
    tables: list[dict[str, Any]] = []
    arrays: dict[str, StoredArray] = {}
    for index, record in enumerate(records):
        tables.append({each.name: getattr(record, each.name) for each in fields(record)})
        tables[-1]["contacts"] = [asdict(contact) for contact in record.contacts]
        tables[-1]["arrays"] = {name: f"sweep-{index}-{name}" for name in record.arrays}
        arrays |= {f"sweep-{index}-{name}": array for name, array in record.arrays.items()}
    return tables, arrays


def unpacked(
    tables: Iterable[Mapping[str, Any]], arrays: Mapping[str, StoredArray]
) -> tuple[SweepRecord, ...]:
    """The records of `packed`."""
    return tuple(
        SweepRecord(
            **{
                **table,
                "contacts": tuple(ContactValues(**contact) for contact in table["contacts"]),
                "arrays": {name: arrays[key] for name, key in table["arrays"].items()},
            }
        )
        for table in tables
    )


def _record(result: DesignResult | RobustResult, **own: Any) -> DesignRecord:
    """The columns that a design and a robust one have alike, with its own."""
    problem = result.problem
    return DesignRecord(
        scene_name=problem.scene.name, scene_hash=digest(problem.scene.to_dict()), reached=result.reached,
        status=result.status.value, harmonics=problem.harmonics, seconds=result.seconds,
        variables=tuple(
            VariableValues(name=v.name, value=result.optimum.get(v.name), low=v.low, high=v.high)
            for v in problem.variables
        ),
        **own,
    )  # fmt: skip


def design_record(result: DesignResult) -> DesignRecord:
    """The design with the columns people filter by."""
    problem, evaluation, peak = result.problem, result.evaluation, result.peak
    feasible = False
    if evaluation is not None and evaluation.good:
        from optim.methods.linearised import KEPT

        feasible = evaluation.violation(problem.scales) <= KEPT
    return _record(
        result, method=result.method.value, robust=False, feasible=feasible,
        objective=None if evaluation is None else json_number(evaluation.objective),
        peak=None if peak is None else peak.value, peak_at=None if peak is None else peak.at,
        limit=result.limit, band_hz=result.band_hz, evaluations=result.evaluations,
        work=json_number(result.work),
    )  # fmt: skip


def robust_record(result: RobustResult) -> DesignRecord:
    """The robust design with the columns people filter by; its peak is the worst over the uncertainty."""
    side = result.robust
    worst = None if side is None or side.worst is None else side.worst
    rows = () if worst is None else worst.rows
    peak = max((r for r in rows if r.quantity.name == "peak"), key=lambda row: row.value, default=None)
    bands = [row.value for row in rows if row.quantity.name == "band"]
    return _record(
        result, method=result.aim.value, robust=True, feasible=side is not None and side.feasible,
        objective=json_number(result.objective), peak=None if peak is None else peak.value,
        peak_at=None if peak is None else json_number(peak.at_hz), limit=result.problem.limit,
        band_hz=max(bands, default=None), evaluations=result.designs, work=float(result.responses),
    )  # fmt: skip


def contact_values(scene: Scene, parameter: str) -> tuple[ContactValues, ...]:
    """The values of every contact; None for what changes while `parameter` does, and for what it has not."""
    owner, _, key = parameter.rpartition(".")
    return tuple(
        _values(contact, key if owner in (contact.name, contact.group) else "") for contact in scene.contacts
    )


def _values(contact: AnyContact, swept: str) -> ContactValues:
    kept = contact.parameters.keys() - contact.followers(swept)
    values = {key: contact.value_of(key) if key in kept else None for key in _STORED}
    return ContactValues(name=contact.name, **values)
