"""Stored sweeps and lists in the formats that programs read: JSON, CSV, npz, Parquet, pictures."""

from __future__ import annotations

import importlib.util
import re
import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from service.db.repositories import ResultRepository
from service.errors import NotAcceptableError
from service.jobs.stored_figures import SweepRecord
from service.jobs.strict_json import digest
from service.schemas.answers import SweepDetail
from solver.results.files import Dataset, csv_text
from solver.results.known import OF_X
from solver.scene.parameter_paths import find_parameter, parameter_unit
from solver.scene.scene import Scene
from solver.views.io import written
from solver.views.to_dataset import attributes, point_variables

_RANGE = re.compile(r"([!#$%&'*+.^_`|~0-9a-z-]+)/([!#$%&'*+.^_`|~0-9a-z-]+)")
_LONGEST = 1000  # letters of a header; those of browsers have 150
_QUALITY = re.compile(r"(?:0(?:\.[0-9]{0,3})?|1(?:\.0{0,3})?)")


@dataclass(frozen=True, slots=True)
class _Range:
    kind: str
    subkind: str
    quality: float

    def specificity(self, offered: str) -> int:
        """How exactly it means a media type; 0 if it does not."""
        if f"{self.kind}/{self.subkind}" == offered:
            return 3
        if self.subkind == "*" and self.kind == offered.partition("/")[0]:
            return 2
        return int(self.kind == self.subkind == "*")


def preferred(accept: str | None, offered: Sequence[str]) -> str | None:
    """The media type of `offered` that an `Accept` header prefers (RFC 9110, 12.5.1), the first among equals.

    None if none will do; without the header every one will. What cannot be read in it is passed over.
    """
    if accept is None or not accept.strip():
        return offered[0] if offered else None
    # One that is longer is no wish of anybody.
    ranges = [found for part in accept[:_LONGEST].lower().split(",") if (found := _range(part)) is not None]
    rated = [(_quality(ranges, media), media) for media in offered]
    best = max(rated, key=lambda pair: pair[0], default=(0.0, ""))
    return best[1] if best[0] > 0.0 else None


def _quality(ranges: Sequence[_Range], offered: str) -> float:
    """The quality that the most specific range gives a media type; 0 if none means it."""
    specificity, quality = 0, 0.0
    for one in ranges:
        exact = one.specificity(offered)
        if exact > specificity or (exact == specificity > 0 and one.quality > quality):
            specificity, quality = exact, one.quality
    return quality


def _range(text: str) -> _Range | None:
    media, *parameters = (part.strip() for part in text.split(";"))
    found = _RANGE.fullmatch(media)
    if found is None:
        return None
    quality = 1.0
    for parameter in parameters:
        name, _, value = parameter.partition("=")
        if name.strip() == "q":
            if not _QUALITY.fullmatch(value.strip()):
                return None
            quality = float(value)
    return _Range(found[1], found[2], quality)


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

    NotAcceptableError if the client takes none of them, listing those there are.
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
    row: SweepRecord, media: str, repository: ResultRepository, scene: Mapping[str, Any] | None = None
) -> bytes:
    """A stored sweep in a media type of `SWEEP_MEDIA`: the files are those that `solver.save` writes.

    `scene`: that of its job.
    """
    if media == JSON:
        return SweepDetail.load(row, repository).model_dump_json().encode()
    return written(sweep_dataset(row, repository, scene), f".{SUFFIXES[media]}")


def sweep_picture(
    row: SweepRecord, suffix: str, repository: ResultRepository, scene: Mapping[str, Any] | None = None
) -> bytes:
    """The curve of a stored sweep as `svg` or `png`; its peak is marked, its band shaded.

    `scene`: that of its job; it names the axis only if it is the one that was swept.
    """
    from service.jobs.drawing import response_of
    from solver.views.plots import style
    from solver.views.plots.responses import response_figure

    sweep = SweepDetail.load(row, repository)
    same = scene is not None and digest(dict(scene)) == row.scene_hash
    measured = Scene.from_dict(scene).measured if same and scene is not None else OF_X
    # Matplotlib's settings belong to the process.
    with _drawing:
        return style.written(response_figure(response_of(sweep, measured)), suffix)


def csv_of_items(items: Iterable[Mapping[str, Any]]) -> bytes:
    """A list of answers as a table: one row each, nested keys joined by a dot, without links."""
    rows = [dict(_flat(item)) for item in items]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return csv_text(columns, ([row.get(name) for name in columns] for row in rows)).encode()


def _flat(item: Mapping[str, Any], prefix: str = "") -> Iterable[tuple[str, Any]]:
    for key, value in item.items():
        if isinstance(value, Mapping):
            if key not in _NOT_OF_LISTS:
                yield from _flat(value, f"{prefix}{key}.")
        elif key not in _NOT_OF_LISTS:
            texts = isinstance(value, list) and all(isinstance(one, str) for one in value)
            yield prefix + key, "; ".join(value) if texts else value


_COLUMNS = ("parameter", "amplitude", "half_peak_to_peak", "mean", "residual")


def _unit(path: str, scene: Scene | None) -> str:
    """The unit of the parameter swept; a part of the structure has one only where the scene is known."""
    found = None if scene is None else find_parameter(scene, path)
    return parameter_unit(path) if found is None else found.unit


def sweep_dataset(
    row: SweepRecord, repository: ResultRepository, scene: Mapping[str, Any] | None = None
) -> Dataset:
    """A stored sweep, a point a row.

    Sweeps that an earlier version stored have no column `residual` and none of the states. `scene`: that of
    its job; it is told only if it is the one that was swept.
    """
    arrays = {name: stored.array() for name, stored in repository.arrays(row.id).items()}
    names = [contact.name for contact in row.contacts]
    states = arrays.get("states")
    swept = None
    if scene is not None and digest(dict(scene)) == row.scene_hash:
        swept = Scene.from_dict(scene)
    variables = point_variables(
        row.parameter, _unit(row.parameter, swept),
        {name: arrays[name] for name in _COLUMNS if name in arrays},
        arrays.get("observed"), None if states is None else (names, states),
    )  # fmt: skip
    notes = attributes(
        row.status, swept, parameter=row.parameter, harmonics=row.harmonics,
        observed=None if swept is None else swept.observe.dof, peak=row.peak, peak_at=row.peak_at,
        band=row.band_hz, band_limit=row.limit, sweep=row.id, job=row.job_id,
    )  # fmt: skip
    return Dataset(kind="branch", rows=("point",), variables=variables, attributes=notes)
