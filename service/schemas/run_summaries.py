"""What a list shows of a run: its values, its figures, and the response as a small curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from service.db.models import JobState
from service.db.repositories.runs import RunRow
from service.jobs.figures import SweepRecord
from service.queue.core import Service
from service.schemas.answers import Peak
from service.schemas.workbench_answers import RunSummary, SmallCurve

_FREQUENCY = "frequency"
_STATES = (JobState.SUCCESSFUL, JobState.FAILED)

Json = Mapping[str, Any]


def run_summary(service: Service, run: RunRow, points: int) -> RunSummary:
    """Return the summary of a run, with a curve of at most so many points."""
    result: Json = {}
    if run.job.state in _STATES:
        result = service.jobs.result(run.job.result_of or run.id) or {}
    request = run.job.request or {}
    peak, worst = _peak(result)
    sweep = _sweep(service, run, peak) if result else None
    robust = result.get("robust") if isinstance(result.get("robust"), Mapping) else None
    band = (robust or result).get("band_hz")
    return RunSummary(
        id=run.id, request=request or None,
        values=_values(request, result), peak=peak, worst=worst,
        band_hz=band if isinstance(band, int | float) else None,
        error_estimate=_number(result, "error_estimate"),
        harmonics=_whole(result.get("n_harmonics")) or _whole(request.get("harmonics")),
        found=_found(result), curve=None if sweep is None else _curve(service, sweep, points),
    )  # fmt: skip


def _number(table: Json, key: str) -> float | None:
    value = table.get(key)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _whole(value: object) -> int | None:
    return value if isinstance(value, int) and not isinstance(value, bool) else None


def _peak(result: Json) -> tuple[Peak | None, bool]:
    """The peak of a response, of an optimum, of the ridge of a map; of a robust design the worst one."""
    robust = result.get("robust")
    if isinstance(robust, Mapping) and isinstance(robust.get("worst"), Mapping):
        value, own = _number(robust["worst"], "peak"), robust.get("peak") or {}
        return (None if value is None else Peak(value=value, at=_number(own, "at") or 0.0)), True
    ridge = result.get("ridge")
    places = [
        result.get("peak"),
        result.get("optimum"),
        *([ridge.get("optimum")] if isinstance(ridge, Mapping) else []),
    ]
    for place in places:
        if not isinstance(place, Mapping):
            continue
        value = _number(place, "value") if "value" in place else _number(place, "peak")
        at = _number(place, "at")
        if value is not None and at is not None:
            return Peak(value=value, at=at), False
    heights = [one for one in result.get("points") or () if isinstance(one, Mapping) and _number(one, "peak")]
    if heights:
        least = min(heights, key=lambda one: float(one["peak"]))
        return Peak(value=float(least["peak"]), at=_number(least, "at") or 0.0), False
    return None, False


def _values(request: Json, result: Json) -> dict[str, float | None]:
    """Of a design its optimum, of an identification what was found, else what was set."""
    for key in ("optimum", "values"):
        found = result.get(key)
        if (
            isinstance(found, Mapping)
            and found
            and all(value is None or isinstance(value, int | float) for value in found.values())
            and "at" not in found
        ):
            return dict(found)
    given = request.get("set")
    return dict(given) if isinstance(given, Mapping) else {}


def _found(result: Json) -> list[str]:
    counts = (
        (len(result[key]) if isinstance(result.get(key), list) else 0, words)
        for key, words in (("basins", "optima"), ("points", "designs"), ("estimates", "parameters"))
    )
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
