"""Results as files, and back: `save` and `load`; the suffix chooses the format."""

from __future__ import annotations

import csv
import io
import json
import re
import tempfile
from collections.abc import Callable, Iterable
from itertools import chain, count
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from solver.errors import MissingExtraError, ResultFileError, SettingError
from solver.results.base import Shown
from solver.results.files import (
    ROW,
    Attribute,
    Dataset,
    Variable,
    csv_text,
    read_netcdf,
    read_parquet,
    whole,
    write_netcdf,
    write_parquet,
)
from solver.scene.scene import Scene
from solver.scene.toml import toml_text

SUFFIXES = (".csv", ".parquet", ".nc", ".npz", ".mat", ".json")
_ABOUT = "stickslip"

Result: TypeAlias = Shown | Dataset


def save(result: Result, file: str | Path, *, scene: Scene | None = None) -> None:
    """Write a result to a file, whole or not at all.

    Parameters
    ----------
    result : anything the package computes, or a `Dataset`.
    file : ends in ``.csv`` or ``.parquet`` (a table), or in ``.nc``, ``.npz``, ``.mat`` or ``.json`` (every
        array, with units and attributes).
    scene : what it is of; for results that do not know it, such as those of `march`.

    Raises
    ------
    SettingError
        Not a result, or another suffix.
    MissingExtraError
        Parquet without pyarrow.
    """
    path = Path(file)
    write = _WRITERS.get(path.suffix.lower())
    if write is None:
        raise SettingError("file", str(file), f"must end in one of {', '.join(SUFFIXES)}")
    if not isinstance(result, (Shown, Dataset)):
        raise SettingError("result", type(result).__name__, "must be something the package computed")
    data = result if isinstance(result, Dataset) else result.to_dataset()
    if scene is not None:
        attributes = {**data.attributes, **scene_attributes(scene)}
        data = Dataset(kind=data.kind, rows=data.rows, variables=data.variables, attributes=attributes)
    with whole(path) as temporary:
        write(data, temporary)


def written(data: Dataset, suffix: str) -> bytes:
    """The bytes of the file that `save` writes; the same data gives the same bytes.

    Parameters
    ----------
    suffix : one of `SUFFIXES`.

    Raises
    ------
    MissingExtraError
        Parquet without pyarrow.
    """
    with tempfile.TemporaryDirectory(prefix="stickslip-") as folder:
        path = Path(folder) / f"result{suffix}"
        _WRITERS[suffix](data, path)
        return path.read_bytes()


def load(file: str | Path) -> Dataset:
    """Read what `save` wrote: every array of ``.nc``, ``.npz``, ``.mat``, ``.json``; a table of the others.

    Raises
    ------
    SettingError
        Another suffix.
    ResultFileError
        The file cannot be read, or it is not one of `save`.
    MissingExtraError
        Parquet without pyarrow.
    """
    path = Path(file)
    read = _READERS.get(path.suffix.lower())
    if read is None:
        raise SettingError("file", str(file), f"must end in one of {', '.join(SUFFIXES)}")
    try:
        return read(path)
    except MissingExtraError:
        raise
    except Exception as error:  # what four libraries raise at a damaged file is a long list, and grows
        raise ResultFileError(f"{str(file)!r} cannot be read as a result: {error}") from error


def scene_attributes(scene: Scene) -> dict[str, Attribute]:
    """The TOML that reproduces a scene, as an attribute."""
    return {"scene": toml_text(scene.to_dict())}


def _write_csv(data: Dataset, path: Path) -> None:
    columns = data.table().variables
    rows = zip(*(column.values.tolist() for column in columns.values()), strict=True)
    path.write_bytes(csv_text(list(columns), rows).encode())


def _read_csv(path: Path) -> Dataset:
    lines = list(csv.reader(io.StringIO(path.read_text("utf-8"), newline=""), strict=True))
    if not lines:
        raise ValueError("it is empty, and should begin with a line of names")
    names, *rows = lines
    for line, row in enumerate(rows, start=2):
        if len(row) != len(names):
            raise ValueError(f"line {line} must have {len(names)} cells as the first has, got {len(row)}")
    columns = [_column([row[i] for row in rows]) for i in range(len(names))]
    variables = {
        name: Variable(dims=(ROW,), values=values) for name, values in zip(names, columns, strict=True)
    }
    return Dataset(kind="table", rows=(ROW,), variables=variables)


def _column(texts: list[str]) -> NDArray[Any]:
    """Cells of a CSV as booleans, whole numbers, numbers or texts, whichever holds them all."""
    if texts and set(texts) <= {"true", "false"}:
        return np.array([text == "true" for text in texts])
    for kind in (np.int64, np.float64):
        try:
            return np.array([kind(text or "nan") for text in texts])
        except (ValueError, OverflowError):
            continue
    return np.array([text[1:] if text[:1] == "'" else text for text in texts])


def _write_json(data: Dataset, path: Path) -> None:
    about = _about(data)
    for name, variable in data.variables.items():
        about["variables"][name]["values"] = _plain(variable.values)
    path.write_text(json.dumps(about, allow_nan=False, ensure_ascii=False) + "\n", "utf-8")


def _read_json(path: Path) -> Dataset:
    about = json.loads(path.read_text("utf-8"))
    return _whole(about, {name: given["values"] for name, given in about["variables"].items()})


def _write_npz(data: Dataset, path: Path) -> None:
    arrays = {name: variable.values for name, variable in data.variables.items()}
    about = np.array(json.dumps(_about(data), ensure_ascii=False))
    np.savez_compressed(path, allow_pickle=False, **{_ABOUT: about}, **arrays)


def _read_npz(path: Path) -> Dataset:
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        about = json.loads(str(archive[_ABOUT]))
        return _whole(about, {name: archive[name] for name in about["variables"]})


def _write_mat(data: Dataset, path: Path) -> None:
    from scipy.io import savemat

    attributes = {"kind": data.kind, **data.attributes}
    fields, words = _fields(data.variables), _fields(attributes)
    struct: dict[str, Any] = {fields[name]: _for_matlab(v.values) for name, v in data.variables.items()}
    struct["units"] = {fields[name]: v.unit or "1" for name, v in data.variables.items()}
    struct["attributes"] = {words[name]: value for name, value in attributes.items()}
    struct["about"] = json.dumps(_about(data))
    savemat(path, {_ABOUT: struct}, long_field_names=True, oned_as="column", do_compression=True)


def _fields(names: Iterable[str]) -> dict[str, str]:
    """Names of fields that MATLAB allows, no two alike."""
    fields: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
        others = (f"{plain[: 62 - len(str(i))]}_{i}" for i in count(2))
        taken = set(fields.values())
        fields[name] = next(field for field in chain([plain[:63]], others) if field not in taken)
    return fields


def _for_matlab(values: NDArray[Any]) -> NDArray[Any]:
    """Texts as a cell array: a matrix of characters would pad them."""
    return values.astype(object) if values.dtype.kind == "U" else values


def _read_mat(path: Path) -> Dataset:
    from scipy.io import loadmat

    struct = loadmat(path, simplify_cells=True)[_ABOUT]
    about = json.loads(str(struct["about"]))
    return _whole(about, {name: struct[field] for name, field in _fields(about["variables"]).items()})


def _about(data: Dataset) -> dict[str, Any]:
    """Everything but the values, for JSON."""
    variables = {
        name: {
            "dims": list(v.dims), "shape": list(v.values.shape), "dtype": _dtype(v.values), "unit": v.unit,
            "about": v.about,
        }
        for name, v in data.variables.items()
    }  # fmt: skip
    return {
        "kind": data.kind,
        "rows": list(data.rows),
        "attributes": dict(data.attributes),
        "variables": variables,
    }


def _dtype(values: NDArray[Any]) -> str:
    return "text" if values.dtype.kind == "U" else values.dtype.name


def _whole(about: dict[str, Any], values: dict[str, Any]) -> Dataset:
    """Put a dataset together from what `_about` says and the values."""
    variables = {}
    for name, given in about["variables"].items():
        kind = np.str_ if given["dtype"] == "text" else np.dtype(given["dtype"])
        array = np.array(_filled(values[name], given["dtype"]), dtype=kind).reshape(given["shape"])
        variables[name] = Variable(
            dims=tuple(given["dims"]), values=array, unit=given["unit"], about=given["about"]
        )
    return Dataset(
        kind=about["kind"], rows=tuple(about["rows"]), variables=variables, attributes=about["attributes"]
    )


def _plain(values: NDArray[Any]) -> Any:
    """Lists for JSON; null for what is not a finite number."""
    if values.dtype.kind != "f":
        return values.tolist()
    objects = values.astype(object)
    objects[~np.isfinite(values)] = None
    return objects.tolist()


def _filled(values: Any, dtype: str) -> Any:
    """The values as NumPy takes them: null is NaN, and no text is an empty one."""
    if isinstance(values, list) and dtype.startswith("float"):
        return np.array(values, dtype=object).astype(float)
    if dtype == "text":
        # MATLAB's empty text is an empty array.
        return ["" if isinstance(one, np.ndarray) and not one.size else one for one in np.atleast_1d(values)]
    return values


_WRITERS: dict[str, Callable[[Dataset, Path], None]] = {
    ".csv": _write_csv,
    ".json": _write_json,
    ".npz": _write_npz,
    ".mat": _write_mat,
    ".nc": write_netcdf,
    ".parquet": write_parquet,
}
_READERS: dict[str, Callable[[Path], Dataset]] = {
    ".csv": _read_csv,
    ".json": _read_json,
    ".npz": _read_npz,
    ".mat": _read_mat,
    ".nc": read_netcdf,
    ".parquet": read_parquet,
}
