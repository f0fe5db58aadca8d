"""From the stored result of a job to its picture: as its kind says, and what the kinds share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from service.jobs.kind_registry import Json, NothingToDrawError, ReadSweep, Registry, StoredCurve, StoredSweep
from solver.results import units
from solver.results.known import Measured
from solver.views.plots.curves import Response, above, with_peak

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def response_of(sweep: StoredCurve, measured: Measured) -> Response:
    """The curve of a stored sweep with at least one point; its band is that of the polyline."""
    peak = None if sweep.peak is None else (sweep.peak.at, sweep.peak.value)
    values = np.asarray(sweep.arrays["parameter"], dtype=np.float64)
    amplitude = np.asarray(sweep.arrays["amplitude"], dtype=np.float64)
    unstable = np.asarray(sweep.arrays.get("unstable", np.zeros(values.size)), dtype=np.bool_)
    values, amplitude, unstable = with_peak(values, amplitude, peak, unstable)
    limit = sweep.limit
    return Response(
        scene=sweep.scene, parameter=sweep.parameter, values=values, amplitude=amplitude, measured=measured,
        peak=peak, limit=limit, intervals=() if limit is None else above(values, amplitude, limit),
        unstable=unstable,
    )  # fmt: skip


def result_figure(
    kind: str, result: Json, sweeps: Sequence[StoredSweep], read: ReadSweep, registry: Registry
) -> Figure:
    """The picture of a job.

    NothingToDrawError if the job found nothing, or stored no sweep.

    Parameters
    ----------
    kind : of the job.
    result : what it computed, as JSON.
    sweeps : those it stored.
    read : gives a stored sweep with its arrays.
    registry : the kinds there are; results of others are drawn as their stored sweep.
    """
    known = registry[kind].view.draw if kind in registry else None
    return (known or best_sweep_figure)(result, sweeps, read)


def best_sweep_figure(result: Json, sweeps: Sequence[StoredSweep], read: ReadSweep) -> Figure:
    """The sweep with the peak of the result: a design stores many."""
    from solver.views.plots.responses import response_figure

    peak = result.get("peak")
    if not sweeps or peak is None:
        raise NothingToDrawError("it stored no sweep to draw")
    best = min(sweeps, key=lambda s: abs(s.peak.value - peak["value"]) if s.peak else math.inf)
    return response_figure(response_of(read(best.id), Measured.of_result(result)))


def harmonics_of(result: Json) -> Figure:
    """The harmonics of one period."""
    from solver.views.plots.motion import harmonics_figure

    heights = np.array(result["harmonics"] or [], dtype=np.float64)
    if not np.isfinite(heights).any():
        raise NothingToDrawError("no response was found")
    place = f" at {units.hertz(result['frequency_hz'])}" if "frequency_hz" in result else ""
    return harmonics_figure(
        heights, f"{result.get('scene', 'last period')}{place}", dof=Measured.of_result(result).dof
    )  # fmt: skip
