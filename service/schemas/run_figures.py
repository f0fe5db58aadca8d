"""Runs in figures: one as a list shows it, with its response as a small curve; two side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from service.auth.callers import Caller
from service.db.models import JobState
from service.db.repositories.run_repository import RunRow
from service.jobs.common.scene_requests import CHECKED_BY
from service.jobs.stored_figures import SweepRecord
from service.jobs.strict_json import digest
from service.queue.core import Service
from service.schemas.answers import Peak
from service.schemas.workbench_answers import (
    Comparison,
    Figure,
    InputDifference,
    RunAnswer,
    RunSummary,
    SmallCurve,
)

SCENE, SETTINGS = "scene", "settings"
_CONTACTS = "contacts"
_LONGEST = 500  # characters of a value that is shown as it is

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Difference:
    """An input that is not the same; None where it is not given."""

    part: str
    path: str
    a: Any
    b: Any


def differences(a: Json, b: Json) -> Iterator[Difference]:
    """Yield what differs between two specs, the scene first.

    Rows of a table that have names (contacts, springs) are compared by name, other rows by their number. A
    value of a contact has the path that `set` takes, such as ``damper.N0``.
    """
    yield from (
        Difference(SCENE, _shown_path(path), one, other)
        for path, one, other in _differences((), a.get(SCENE), b.get(SCENE))
    )
    rest = ({key: value for key, value in spec.items() if key != SCENE} for spec in (a, b))
    yield from (
        Difference(SETTINGS, ".".join(path), one, other) for path, one, other in _differences((), *rest)
    )


def _shown_path(path: tuple[str, ...]) -> str:
    """Of a contact as parameters are named."""
    return ".".join(path[1:] if path[:1] == (_CONTACTS,) and len(path) > 1 else path)


def _differences(path: tuple[str, ...], a: Any, b: Any) -> Iterator[tuple[tuple[str, ...], Any, Any]]:
    if a == b:
        return
    one, other = _table(a), _table(b)
    if (one is None and a is not None) or (other is None and b is not None) or (one is other is None):
        yield path, _shown(a), _shown(b)
        return
    one, other = one or {}, other or {}
    for key in dict.fromkeys((*one, *other)):
        yield from _differences((*path, key), one.get(key), other.get(key))


def _table(value: Any) -> Json | None:
    """A table: an object, or a list of objects by their names or numbers; None for anything else."""
    if isinstance(value, Mapping):
        return value
    if not isinstance(value, list) or not value or not all(isinstance(row, Mapping) for row in value):
        return None
    names = [row.get("name") for row in value]
    named = all(isinstance(name, str) for name in names) and len(set(names)) == len(names)
    return dict(zip(names if named else map(str, range(len(value))), value, strict=True))


def _shown(value: Any) -> Any:
    """A value; of a long one what it is, with a digest that tells it apart."""
    if not isinstance(value, str | Sequence | Mapping) or len(repr(value)) <= _LONGEST:
        return value
    kind = "text" if isinstance(value, str) else "table" if isinstance(value, Mapping) else "list"
    rows = isinstance(value, list) and isinstance(value[0], list)
    size = f"{len(value)} x {len(value[0])}" if rows else str(len(value))
    return f"{kind} of {size}, sha256 {digest(value)[:16]}"


_MOST_INPUTS = 500
_MOST_COUNTED = 10_000


def comparison(service: Service, a: str, b: str, caller: Caller) -> Comparison:
    """What differs between two runs of which the caller sees both (NotFoundError if not)."""
    rows = [service.runs.seen(one, caller.sees) for one in (a, b)]
    specs = [_inputs(service, row) for row in rows]
    ours, theirs = (service.jobs.figures(row.job.result_of or row.job.id) for row in rows)
    names = dict.fromkeys((*ours, *theirs))
    found = differences(*specs)
    told = [InputDifference(part=d.part, path=d.path, a=d.a, b=d.b) for d in islice(found, _MOST_INPUTS)]
    return Comparison(
        a=RunAnswer.of_run(rows[0]),
        b=RunAnswer.of_run(rows[1]),
        inputs=told,
        more_inputs=sum(1 for _ in islice(found, _MOST_COUNTED)),
        results=[Figure(name=name, a=ours.get(name), b=theirs.get(name)) for name in names],
    )


def _inputs(service: Service, row: RunRow) -> dict[str, Any]:
    """What a run computes: its kind, its scene with every value, its settings."""
    spec = service.jobs.spec(row.job.id)
    return {"kind": row.job.kind, **{key: value for key, value in spec.items() if key != CHECKED_BY}}


_FREQUENCY = "frequency"
_STATES = (JobState.SUCCESSFUL, JobState.FAILED)


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
    ("robust.worst.peak", "robust.peak.at"), ("peak.value", "peak.at"), ("peak.peak", "peak.at"),
    ("optimum.value", "optimum.at"), ("optimum.peak", "optimum.at"),
    ("ridge.optimum.value", "ridge.optimum.at"), ("ridge.optimum.peak", "ridge.optimum.at"),
    ("points.peak", "points.at"),
)  # fmt: skip
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
