"""From the stored result of a job to its picture, for every kind."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from service.rendering.stored_curves import response_of
from service.schemas.answers import SweepAnswer, SweepDetail
from solver.jit.fourier import Real
from solver.views.plots.curves import Response

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solver.peaks.results import PeakTrack

Json = Mapping[str, Any]
Read = Callable[[str], SweepDetail]


class NothingToDrawError(Exception):
    """A result without anything a picture could show; the message says why."""


def result_figure(kind: str, result: Json, sweeps: Sequence[SweepAnswer], read: Read) -> Figure:
    """The picture of a job.

    Parameters
    ----------
    kind : of the job.
    result : what it computed, as JSON.
    sweeps : those it stored.
    read : gives a stored sweep with its arrays.

    Raises
    ------
    NothingToDrawError
        The job found nothing, or stored no sweep.
    """
    if kind == "design" and "nominal" in result:
        return _robust(result)
    draw = _BY_KIND.get(kind)
    if draw is not None:
        return draw(result)
    if kind == "campbell":
        return _campbell(result, [response_of(read(sweep.id)) for sweep in sweeps if sweep.points])
    return _best_sweep(result, sweeps, read)


def _best_sweep(result: Json, sweeps: Sequence[SweepAnswer], read: Read) -> Figure:
    """The sweep with the peak of the result: a design stores many."""
    from solver.views.plots.responses import response_figure

    peak = result.get("peak")
    if not sweeps or peak is None:
        raise NothingToDrawError("it stored no sweep to draw")
    best = min(sweeps, key=lambda s: abs(s.peak.value - peak["value"]) if s.peak else math.inf)
    return response_figure(response_of(read(best.id)))


def _robust(result: Json) -> Figure:
    from optim.views.plots.designs import robust_figure

    if result["nominal"] is None:
        raise NothingToDrawError("no design was found")
    return robust_figure(result)


def _pareto(result: Json) -> Figure:
    from optim.views.plots.pareto import pareto_figure

    if not result["points"]:
        raise NothingToDrawError("its front has no point")
    return pareto_figure(result)


def _accuracy(result: Json) -> Figure:
    from solver.views.plots.accuracy import accuracy_figure

    if not result["rows"]:
        raise NothingToDrawError("it has no rows")
    return accuracy_figure(result)


def _mistuning(result: Json) -> Figure:
    from solver.views.plots.disks import mistuning_figure

    if result["worst"] is None:
        raise NothingToDrawError("the peaks of no disk are known")
    return mistuning_figure(result)


def _harmonics(result: Json) -> Figure:
    from solver.views.plots.motion import harmonics_figure

    heights = _numbers(result["harmonics"] or [])
    if not np.isfinite(heights).any():
        raise NothingToDrawError("no response was found")
    place = f" at {result['frequency_hz']:.6g} Hz" if "frequency_hz" in result else ""
    return harmonics_figure(heights, f"{result.get('scene', 'last period')}{place}")


def _map(result: Json) -> Figure:
    from solver.studies.response_map import MapStatus, ResponseMap
    from solver.views.plots.tracks import map_figure

    found = ResponseMap(
        scene=result["scene"], parameter_path=result["parameter_path"], unit=result["unit"],
        parameter=_numbers(result["parameter"]), frequency=_numbers(result["frequency"]),
        amplitude=np.array([_numbers(row) for row in result["amplitude"]]),
        half_peak_to_peak=np.array([_numbers(row) for row in result["half_peak_to_peak"]]),
        ridge=None if result["ridge"] is None else _track(result["ridge"]),
        n_harmonics=result["n_harmonics"], largest_residual=result["largest_residual"],
        newton_iterations=result["newton_iterations"], status=MapStatus(result["status"]),
        seconds=result["seconds"],
    )  # fmt: skip
    if not np.isfinite(found.amplitude).any():
        raise NothingToDrawError("no point of it was solved")
    return map_figure(found, dof="x")


def _peaks(result: Json) -> Figure:
    from solver.views.plots.tracks import track_figure

    if not result["parameter"]:
        raise NothingToDrawError("no peak was tracked")
    return track_figure(_track(result), dof="x")


def _track(result: Json) -> PeakTrack:
    """A track as far as it is drawn; its sweeps are stored apart."""
    from solver.peaks.results import ActivePeak, CompetingPeak, LeastPeak, PeakTrack, TrackStatus

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
        competing=competing, exchanges=tuple((one["at"], one["peak"]) for one in result["exchanges"]),
        branches=(), n_harmonics=result["n_harmonics"], sweeps=result["sweeps"], status=status,
        seconds=result["seconds"],
    )  # fmt: skip


def _campbell(result: Json, curves: Sequence[Response]) -> Figure:
    """Each order with the stored response whose highest peak is its own."""
    from optim.views.plots.campbell import campbell_figure

    if not curves:
        raise NothingToDrawError("it stored no sweep to draw")

    def distance(curve: Response, order: Json) -> float:
        heights = [float(peak["value"]) for peak in order["peaks"]] or [math.nan]
        return abs(float(curve.amplitude.max()) - max(heights))

    chosen = [min(curves, key=lambda curve: distance(curve, order)) for order in result["orders"]]
    return campbell_figure(result, chosen)


def _numbers(values: Sequence[float | None]) -> Real:
    return np.array([_number(value) for value in values], dtype=np.float64)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


_BY_KIND: dict[str, Callable[[Json], Figure]] = {
    "pareto": _pareto,
    "accuracy": _accuracy,
    "mistuning": _mistuning,
    "solve": _harmonics,
    "march": _harmonics,
    "map": _map,
    "peaks": _peaks,
}
