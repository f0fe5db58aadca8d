"""What a list shows of a run: its values, its figures, and the response as a small curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from service.db.models import JobState
from service.db.repositories.run_repository import RunRow
from service.jobs.stored_figures import SweepRecord
from service.queue.core import Service
from service.schemas.answers import Peak
from service.schemas.workbench_answers import RunSummary, SmallCurve

_FREQUENCY = "frequency"
_STATES = (JobState.SUCCESSFUL, JobState.FAILED)

Json = Mapping[str, Any]


def run_summary(service: Service, run: RunRow, points: int) -> RunSummary:
    """Return the summary of a run from the figures of its result, with a curve of at most so many points."""
    known = run.job.state in _STATES
    figures: Json = service.jobs.figures(run.job.result_of or run.id) if known else {}
    request = run.job.request or {}
    peak, worst = _peak(figures)
    sweep = _sweep(service, run, peak) if figures else None
    return RunSummary(
        id=run.id, request=request or None,
        values=_values(request, figures), peak=peak, worst=worst,
        band_hz=_number(figures, "robust.band_hz", "band_hz"),
        error_estimate=_number(figures, "error_estimate"),
        harmonics=_whole(figures.get("n_harmonics")) or _whole(request.get("harmonics")),
        found=_found(figures), curve=None if sweep is None else _curve(service, sweep, points),
    )  # fmt: skip


def _number(figures: Json, *keys: str) -> float | None:
    """The first of these that is a number."""
    found = (figures.get(key) for key in keys)
    numbers = (one for one in found if isinstance(one, int | float) and not isinstance(one, bool))
    return next(map(float, numbers), None)


def _whole(value: object) -> int | None:
    return value if isinstance(value, int) and not isinstance(value, bool) else None


_PEAKS = (
    ("robust.worst.peak", "robust.peak.at"),
    ("peak.value", "peak.at"),
    ("peak.peak", "peak.at"),
    ("optimum.value", "optimum.at"),
    ("optimum.peak", "optimum.at"),
    ("ridge.optimum.value", "ridge.optimum.at"),
    ("ridge.optimum.peak", "ridge.optimum.at"),
    ("points.peak", "points.at"),
)
"""Where results have their peak, and the place of it; that of a robust design is the worst one."""


def _peak(figures: Json) -> tuple[Peak | None, bool]:
    """The peak of a response, of an optimum, of the ridge of a map; whether it is the worst of several."""
    for value, at in _PEAKS:
        height, place = _number(figures, value), _number(figures, at)
        worst = value.startswith("robust.")
        if height is not None and (place is not None or worst or value.startswith("points.")):
            return Peak(value=height, at=place or 0.0), worst
    return None, False


def _values(request: Json, figures: Json) -> dict[str, float | None]:
    """Of a design its optimum, of an identification what was found, else what was set."""
    for prefix in ("optimum.", "values."):
        found = {key.removeprefix(prefix): one for key, one in figures.items() if key.startswith(prefix)}
        if found and "at" not in found and all(isinstance(one, int | float) for one in found.values()):
            return found
    given = request.get("set")
    return dict(given) if isinstance(given, Mapping) else {}


def _found(figures: Json) -> list[str]:
    kinds = (("basins", "optima"), ("points", "designs"), ("estimates", "parameters"))
    counts = ((figures.get(f"{key}.count", 0), words) for key, words in kinds)
    return [f"{count} {words}" for count, words in counts if count > 1]


def _sweep(service: Service, run: RunRow, peak: Peak | None) -> SweepRecord | None:
    """The stored response over the frequency whose peak is nearest to that of the result."""
    known: Sequence[SweepRecord] = service.stored.of_job(run.job.result_of or run.id)
    curves = [one for one in known if one.parameter == _FREQUENCY and one.points > 1 and one.peak is not None]
    if not curves:
        return None
    height = curves[0].peak if peak is None else peak.value
    return min(curves, key=lambda one: abs((one.peak or 0.0) - (height or 0.0)))


def _curve(service: Service, sweep: SweepRecord, points: int) -> SmallCurve:
    arrays = service.stored.arrays(sweep.id)
    frequency, amplitude = (
        np.asarray(arrays[name].array(), dtype=float) for name in ("parameter", "amplitude")
    )
    stretches = np.array_split(np.arange(frequency.size), min(points, frequency.size))
    tops = [part[int(np.argmax(amplitude[part]))] for part in stretches if part.size]
    good = [i for i in tops if np.isfinite(amplitude[i])]
    return SmallCurve(
        sweep=sweep.id,
        frequency_hz=[float(f"{frequency[i]:.6g}") for i in good],
        amplitude=[float(f"{amplitude[i]:.4g}") for i in good],
    )
