"""From the stored result of a job to its picture: as its kind says, and what the kinds share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from service.jobs.registry import Json, NothingToDrawError, ReadSweep, Registry, StoredCurve, StoredSweep
from solver.jit.fourier import Real
from solver.views.plots.curves import Response, above, with_peak

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solver.studies.peaks.results import PeakTrack


def response_of(sweep: StoredCurve) -> Response:
    """The curve of a stored sweep with at least one point; its band is that of the polyline."""
    peak = None if sweep.peak is None else (sweep.peak.at, sweep.peak.value)
    values = np.asarray(sweep.arrays["parameter"], dtype=np.float64)
    amplitude = np.asarray(sweep.arrays["amplitude"], dtype=np.float64)
    unstable = np.asarray(sweep.arrays.get("unstable", np.zeros(values.size)), dtype=np.bool_)
    values, amplitude, unstable = with_peak(values, amplitude, peak, unstable)
    limit = sweep.limit
    return Response(
        scene=sweep.scene,
        parameter=sweep.parameter,
        values=values,
        amplitude=amplitude,
        peak=peak,
        limit=limit,
        intervals=() if limit is None else above(values, amplitude, limit),
        unstable=unstable,
    )


def result_figure(
    kind: str, result: Json, sweeps: Sequence[StoredSweep], read: ReadSweep, registry: Registry
) -> Figure:
    """The picture of a job.

    Parameters
    ----------
    kind : of the job.
    result : what it computed, as JSON.
    sweeps : those it stored.
    read : gives a stored sweep with its arrays.
    registry : the kinds there are; results of others are drawn as their stored sweep.

    Raises
    ------
    NothingToDrawError
        The job found nothing, or stored no sweep.
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
    return response_figure(response_of(read(best.id)))


def harmonics_of(result: Json) -> Figure:
    """The harmonics of one period."""
    from solver.views.plots.motion import harmonics_figure

    heights = _numbers(result["harmonics"] or [])
    if not np.isfinite(heights).any():
        raise NothingToDrawError("no response was found")
    place = f" at {result['frequency_hz']:.6g} Hz" if "frequency_hz" in result else ""
    return harmonics_figure(heights, f"{result.get('scene', 'last period')}{place}")


def map_of(result: Json) -> Figure:
    """A map with its ridge."""
    from solver.studies.study_results import MapStatus, ResponseMap
    from solver.views.plots.tracks import map_figure

    found = ResponseMap(
        scene=result["scene"], parameter_path=result["parameter_path"], unit=result["unit"],
        parameter=_numbers(result["parameter"]), frequency=_numbers(result["frequency"]),
        amplitude=np.array([_numbers(row) for row in result["amplitude"]]),
        half_peak_to_peak=np.array([_numbers(row) for row in result["half_peak_to_peak"]]),
        ridge=None if result["ridge"] is None else track_of(result["ridge"]),
        n_harmonics=result["n_harmonics"], largest_residual=result["largest_residual"],
        newton_iterations=result["newton_iterations"], status=MapStatus(result["status"]),
        seconds=result["seconds"],
    )  # fmt: skip
    if not np.isfinite(found.amplitude).any():
        raise NothingToDrawError("no point of it was solved")
    return map_figure(found, dof="x")


def track_of(result: Json) -> PeakTrack:
    """A track as far as it is drawn; its sweeps are stored apart."""
    from solver.studies.peaks.results import (
        ActivePeak,
        CompetingPeak,
        Exchange,
        LeastPeak,
        PeakTrack,
        TrackStatus,
    )

    status, best = TrackStatus(result["status"]), result["optimum"]
    optimum = LeastPeak(
        status=status, at=_number(best["at"]), peak=_number(best["peak"]),
        active=tuple(ActivePeak(**peak) for peak in best["active"]), basins=(), branch=None,
        sweeps=result["sweeps"], work=math.nan, seconds=result["seconds"],
    )  # fmt: skip
    competing = tuple(
        CompetingPeak(
            parameter=_numbers(line["parameter"]), peak=_numbers(line["peak"]),
            frequency=_numbers(line["frequency"]), slope=np.full(len(line["peak"]), np.nan),
            ends=(line["ends"][0], line["ends"][1]), at_band_end=line["at_band_end"],
        )
        for line in result["competing"]
    )  # fmt: skip
    return PeakTrack(
        scene=result["scene"], parameter_path=result["parameter_path"], unit=result["unit"],
        parameter=_numbers(result["parameter"]), peak=_numbers(result["peak"]),
        frequency=_numbers(result["frequency"]), slope=_numbers(result["slope"]), optimum=optimum,
        competing=competing, exchanges=tuple(Exchange(**one) for one in result["exchanges"]),
        branches=(), n_harmonics=result["n_harmonics"], sweeps=result["sweeps"], status=status,
        seconds=result["seconds"],
    )  # fmt: skip


def _numbers(values: Sequence[float | None]) -> Real:
    """An array of the numbers of a result; NaN for null."""
    return np.array([_number(value) for value in values], dtype=np.float64)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
