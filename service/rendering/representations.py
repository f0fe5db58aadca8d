"""Stored sweeps and lists in the formats that programs read: JSON, CSV, npz, Parquet, pictures."""

from __future__ import annotations

import importlib.util
import threading
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from service.db.models import Sweep
from service.db.repositories import SweepRepository
from service.errors import NotAcceptableError
from service.rendering.negotiation import preferred
from service.rendering.sweep_datasets import sweep_dataset
from service.schemas.answers import SweepDetail
from solver.results.csv import csv_text
from solver.views.io import written

JSON, CSV = "application/json", "text/csv"
NPZ, ZIP, PARQUET = "application/x-npz", "application/zip", "application/vnd.apache.parquet"
SWEEP_MEDIA = (JSON, CSV, NPZ, ZIP, PARQUET)
LIST_MEDIA = (JSON, CSV)
BY_FORMAT = {"json": JSON, "csv": CSV, "npz": NPZ, "parquet": PARQUET}
SUFFIXES = {CSV: "csv", NPZ: "npz", ZIP: "npz", PARQUET: "parquet"}

_NO_PARQUET = "Parquet needs pyarrow where the service runs: pip install 'stickslip[parquet]'"
_NOT_OF_LISTS = ("links", "request", "error", "best")
_drawing = threading.Lock()


def parquet_available() -> bool:
    """Whether Parquet can be written here."""
    return importlib.util.find_spec("pyarrow") is not None


def chosen(accept: str | None, media: Sequence[str]) -> str:
    """The media type to answer with.

    Raises
    ------
    NotAcceptableError
        If the client takes none of them, listing those there are.
    """
    there = [one for one in media if one != PARQUET or parquet_available()]
    found = preferred(accept, there)
    if found is not None:
        return found
    detail = f"there is {', '.join(there)} here, `Accept` takes none of it: {accept!r:.200}"
    if preferred(accept, media) == PARQUET:
        detail += f"; {_NO_PARQUET}"
    raise NotAcceptableError(detail)


def sweep_body(
    row: Sweep, media: str, repository: SweepRepository, scene: Mapping[str, Any] | None = None
) -> bytes:
    """A stored sweep in a media type of `SWEEP_MEDIA`: the files are those that `solver.save` writes.

    Parameters
    ----------
    scene : that of its job.
    """
    if media == JSON:
        return SweepDetail.load(row, repository).model_dump_json().encode()
    return written(sweep_dataset(row, repository, scene), f".{SUFFIXES[media]}")


def sweep_picture(row: Sweep, suffix: str, repository: SweepRepository) -> bytes:
    """The curve of a stored sweep as `svg` or `png`; its peak is marked, its band shaded."""
    from service.jobs.stored_curves import response_of
    from solver.views.plots import style
    from solver.views.plots.responses import response_figure

    sweep = SweepDetail.load(row, repository)
    # Matplotlib's settings belong to the process.
    with _drawing:
        return style.written(response_figure(response_of(sweep)), suffix)


def csv_of_items(items: Iterable[Mapping[str, Any]]) -> bytes:
    """A list of answers as a table: one row each, nested keys joined by a dot, without links."""
    rows = [dict(_flat(item)) for item in items]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return _csv(columns, ([row.get(name) for name in columns] for row in rows))


def _flat(item: Mapping[str, Any], prefix: str = "") -> Iterable[tuple[str, Any]]:
    for key, value in item.items():
        if isinstance(value, Mapping):
            if key not in _NOT_OF_LISTS:
                yield from _flat(value, f"{prefix}{key}.")
        elif key not in _NOT_OF_LISTS:
            yield prefix + key, "; ".join(map(str, value)) if _texts(value) else value


def _texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(one, str) for one in value)


def _csv(columns: Sequence[str], rows: Iterable[Iterable[Any]]) -> bytes:
    return csv_text(columns, rows).encode()
