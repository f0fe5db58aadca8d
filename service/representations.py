"""Stored sweeps and lists in the formats that programs read: JSON, CSV, npz, Parquet, pictures."""

from __future__ import annotations

import importlib.util
import io
import threading
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.answers import SweepAnswer, SweepDetail
from service.arrays import decode
from service.errors import NotAcceptableError
from service.jobs import StoredArray
from service.negotiation import preferred
from service.repository import SweepRepository, SweepRow
from solver.csv_text import csv_text

JSON, CSV = "application/json", "text/csv"
NPZ, ZIP, PARQUET = "application/x-npz", "application/zip", "application/vnd.apache.parquet"
SWEEP_MEDIA = (JSON, CSV, NPZ, ZIP, PARQUET)
LIST_MEDIA = (JSON, CSV)
BY_FORMAT = {"json": JSON, "csv": CSV, "npz": NPZ, "parquet": PARQUET}
SUFFIXES = {CSV: "csv", NPZ: "npz", ZIP: "npz", PARQUET: "parquet"}

_NO_PARQUET = "Parquet needs pyarrow where the service runs: pip install 'stickslip[parquet]'"
_NOT_OF_LISTS = ("links", "request", "error")
# The same sweep gives the same bytes.
_ZIP_DATE = (1980, 1, 1, 0, 0, 0)
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


def sweep_body(row: SweepRow, media: str, repository: SweepRepository) -> bytes:
    """A stored sweep in a media type of `SWEEP_MEDIA`."""
    if media == JSON:
        return SweepDetail.load(row, repository).model_dump_json().encode()
    about = SweepAnswer.of_rows([row], repository)[0]
    stored = repository.arrays(row.id)
    if media == CSV:
        return _csv_of_sweep(stored)
    return _parquet(about, stored) if media == PARQUET else _npz(about, stored)


def sweep_picture(row: SweepRow, suffix: str, repository: SweepRepository) -> bytes:
    """The curve of a stored sweep as `svg` or `png`; its peak is marked, its band shaded."""
    from service.plots.stored import response_of
    from solver.plots.responses import response_figure
    from solver.plots.style import written

    sweep = SweepDetail.load(row, repository)
    # Matplotlib's settings belong to the process.
    with _drawing:
        return written(response_figure(response_of(sweep)), suffix)


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
            yield prefix + key, value


def _csv_of_sweep(stored: Mapping[str, StoredArray]) -> bytes:
    """One row a point: the arrays that have one number a point."""
    arrays = {name: decode(array) for name, array in stored.items()}
    columns = {name: array.tolist() for name, array in arrays.items() if array.ndim == 1}
    return _csv(list(columns), zip(*columns.values(), strict=True))


def _csv(columns: Sequence[str], rows: Iterable[Iterable[Any]]) -> bytes:
    return csv_text(columns, rows).encode()


def _npz(about: SweepAnswer, stored: Mapping[str, StoredArray]) -> bytes:
    """What `numpy.load` reads: the arrays, and the rest of the sweep as JSON in the text `about`."""
    archive = io.BytesIO()
    text = io.BytesIO()
    np.save(text, np.array(about.model_dump_json()), allow_pickle=False)
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as file:
        file.writestr(zipfile.ZipInfo("about.npy", _ZIP_DATE), text.getvalue())
        for name, array in stored.items():
            decode(array)  # refuses damaged bytes
            file.writestr(zipfile.ZipInfo(f"{name}.npy", _ZIP_DATE), array.data)
    return archive.getvalue()


def _parquet(about: SweepAnswer, stored: Mapping[str, StoredArray]) -> bytes:
    """One row a point, arrays with several numbers a point as lists; the rest of the sweep as metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {name: _column(decode(array)) for name, array in stored.items()}
    table = pa.table(columns).replace_schema_metadata({"stickslip": about.model_dump_json()})
    sink = io.BytesIO()
    pq.write_table(table, sink)
    return sink.getvalue()


def _column(array: NDArray[Any]) -> Any:
    import pyarrow as pa

    if array.ndim == 1:
        return pa.array(array)
    width = int(np.prod(array.shape[1:]))
    return pa.FixedSizeListArray.from_arrays(pa.array(array.reshape(-1)), width)
