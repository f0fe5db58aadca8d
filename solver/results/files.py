"""A result as named arrays, and files that appear whole or not at all: CSV, Parquet, NetCDF 3.

NetCDF 3 is what every reader knows; SciPy alone writes it.
"""

from __future__ import annotations

import csv
import io
import json
import math
import os
import secrets
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from solver.errors import MissingExtraError
from solver.results.told import Piece, Summary

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import xarray as xr

ROW = "row"
Attribute = str | float | int


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Variable(Piece):
    """An array with its dimensions."""

    dims: Annotated[tuple[str, ...], "One name for each axis of `values`."]
    values: Annotated[NDArray[Any], "Numbers, booleans or texts."]
    unit: Annotated[str, "SI; empty for a number without one."] = ""
    about: Annotated[str, "What it is, in words."] = ""

    @property
    def attributes(self) -> dict[str, str]:
        """Unit and description as NetCDF's conventions name them."""
        given = {"units": self.unit, "long_name": self.about}
        return {name: text for name, text in given.items() if text}


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Dataset(Piece):
    """Named arrays of one result."""

    kind: Annotated[str, "What it is of: ``branch``, ``map``, ``design`` …"]
    rows: Annotated[tuple[str, ...], "The dimensions whose combinations are the rows of a table."]
    variables: Annotated[
        Mapping[str, Variable], "A variable named like a dimension holds the coordinates along it."
    ]
    attributes: Annotated[
        Mapping[str, Attribute],
        "Version, status, and under ``scene`` the TOML that reproduces it, where that is known.",
    ] = field(default_factory=dict)

    def summary(self) -> Summary:
        """Every variable with its dimensions and its unit."""
        pairs = []
        for name, variable in self.variables.items():
            sizes = zip(variable.dims, variable.values.shape, strict=True)
            size = " x ".join(f"{dim} {length}" for dim, length in sizes) or "one value"
            pairs.append((name, f"{size} [{variable.unit}]" if variable.unit else size))
        return Summary(title=self.kind, pairs=tuple(pairs))

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The values of a variable."""
        return self.variables[name].values

    @property
    def sizes(self) -> dict[str, int]:
        """Length of every dimension."""
        return {
            dim: size
            for variable in self.variables.values()
            for dim, size in zip(variable.dims, variable.values.shape, strict=True)
        }

    def table(self) -> Dataset:
        """The same as columns of one length: dimensions that make no rows become columns of their own.

        Variables without a dimension of the rows are left out.
        """
        columns: dict[str, Variable] = {}
        for name, variable in self._ordered():
            others = [dim for dim in variable.dims if dim not in self.rows]
            order = [*[dim for dim in self.rows if dim in variable.dims], *others]
            values = np.transpose(variable.values, [variable.dims.index(dim) for dim in order])
            spread = self._spread(values, variable.dims)
            for index in np.ndindex(*(self.sizes[dim] for dim in others)):
                words = [str(self._label(dim, i)) for dim, i in zip(others, index, strict=True)]
                columns["_".join([name, *words])] = Variable(
                    dims=(ROW,), values=spread[(slice(None), *index)], unit=variable.unit,
                    about=variable.about,
                )  # fmt: skip
        return Dataset(kind=self.kind, rows=(ROW,), variables=columns, attributes=self.attributes)

    def _ordered(self) -> Iterator[tuple[str, Variable]]:
        """Coordinates of the rows first, then what depends on the rows."""
        first = [dim for dim in self.rows if dim in self.variables]
        yield from ((dim, self.variables[dim]) for dim in first)
        for name, variable in self.variables.items():
            if name not in first and any(dim in self.rows for dim in variable.dims):
                yield name, variable

    def _spread(self, values: NDArray[Any], dims: tuple[str, ...]) -> NDArray[Any]:
        """Repeat an array over the dimensions of the rows it lacks, and make those one axis."""
        sizes, have = self.sizes, [dim for dim in self.rows if dim in dims]
        rest = values.shape[len(have) :]
        shaped = values.reshape(*(sizes[dim] if dim in have else 1 for dim in self.rows), *rest)
        full = np.broadcast_to(shaped, (*(sizes[dim] for dim in self.rows), *rest))
        return full.reshape(math.prod(sizes[dim] for dim in self.rows), *rest)

    def _label(self, dim: str, index: int) -> object:
        return self.variables[dim].values[index] if dim in self.variables else index

    def to_pandas(self) -> pd.DataFrame:
        """A table with a row for each combination of `rows`; units and attributes are in ``.attrs``.

        Raises
        ------
        MissingExtraError
            pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise MissingExtraError("pandas", "data") from error
        columns = self.table().variables
        frame = pd.DataFrame({name: column.values for name, column in columns.items()})
        units = {name: column.unit for name, column in columns.items() if column.unit}
        frame.attrs = {**self.attributes, "kind": self.kind, "units": units}
        return frame

    def to_xarray(self) -> xr.Dataset:
        """Arrays with named dimensions, coordinates, units and attributes.

        Points along a parameter have it for their coordinate, in place of `point`: ``.sel(frequency=740,
        method="nearest")`` where the branch does not turn back.

        Raises
        ------
        MissingExtraError
            xarray is not installed.
        """
        try:
            import xarray as xr
        except ImportError as error:
            raise MissingExtraError("xarray", "data") from error
        arrays = {name: (v.dims, v.values, v.attributes) for name, v in self.variables.items()}
        along = {name: array for name, array in arrays.items() if array[0] == (name,)}
        rest = {name: array for name, array in arrays.items() if name not in along}
        made = xr.Dataset(rest, along, {"kind": self.kind, **self.attributes})
        parameter, path = self.variables.get("parameter"), str(self.attributes.get("parameter", ""))
        if parameter is None or not path or parameter.dims[0] in self.variables or path in self.variables:
            return made
        place = (parameter.dims, parameter.values, parameter.attributes)
        return made.assign_coords({path: place}).swap_dims({parameter.dims[0]: path})

    def to_polars(self) -> pl.DataFrame:
        """The same table as `to_pandas` for polars, which has no attributes.

        Raises
        ------
        MissingExtraError
            polars is not installed.
        """
        try:
            import polars as pl
        except ImportError as error:
            raise MissingExtraError("polars", "polars") from error
        return pl.DataFrame({name: column.values for name, column in self.table().variables.items()})


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Give a temporary name beside `path` to write to; it takes the place of `path` if the block succeeds.

    The suffix stays the same, so that whoever picks a format by it still does.
    """
    temporary = path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def csv_text(columns: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """RFC 4180 with a head. Numbers as Python writes them, which is exact; empty where there is none."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(columns)
    for row in rows:
        writer.writerow([_cell(value) for value in row])
    return text.getvalue()


def _cell(value: Any) -> Any:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    # A spreadsheet takes such a text for a formula.
    if isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t", "\r"):
        return "'" + value
    return value


_ROWS, _KIND = "stickslip_rows", "kind"
_TEXT = "string_of_"  # dimensions of characters, joined to texts by readers


def write_netcdf(data: Dataset, path: Path) -> None:
    """Write every variable with its unit; texts as characters, booleans and integers as NetCDF has them."""
    from scipy.io import netcdf_file

    with netcdf_file(path, "w", version=2) as file:
        for dim, size in data.sizes.items():
            file.createDimension(dim, size)
        for name, variable in data.variables.items():
            values, dims, extra = _encoded(name, variable)
            if len(dims) > len(variable.dims):
                file.createDimension(dims[-1], values.shape[-1])
            target = file.createVariable(name, values.dtype, dims)
            target[:] = values
            for key, text in {**variable.attributes, **extra}.items():
                setattr(target, key, text.encode())
        file.Conventions = b"CF-1.10"
        given = {_KIND: data.kind, _ROWS: json.dumps(list(data.rows)), **data.attributes}
        for key, value in given.items():
            exact = np.float64(value) if isinstance(value, float) else value  # of 4 bytes otherwise
            setattr(file, key, exact.encode() if isinstance(exact, str) else exact)


def read_netcdf(path: Path) -> Dataset:
    """Read what `write_netcdf` wrote.

    Raises
    ------
    OSError, ValueError, TypeError, KeyError
        Not a NetCDF 3 file, or not one of these.
    """
    from scipy.io import netcdf_file

    with netcdf_file(path, "r", mmap=False) as file:
        attributes = {key: _plain(value) for key, value in file._attributes.items()}
        variables = {name: _decoded(variable) for name, variable in file.variables.items()}
    rows, kind = json.loads(str(attributes.pop(_ROWS))), str(attributes.pop(_KIND))
    attributes.pop("Conventions", None)
    return Dataset(kind=kind, rows=tuple(rows), variables=variables, attributes=attributes)


def _encoded(name: str, variable: Variable) -> tuple[NDArray[Any], tuple[str, ...], dict[str, str]]:
    """The values as NetCDF 3 can hold them, their dimensions, and what a reader must know to undo it."""
    values, dims = variable.values, variable.dims
    if values.dtype.kind == "U":
        packed = np.char.encode(values, "utf-8")
        wide = max(packed.dtype.itemsize, 1)
        characters = np.ascontiguousarray(packed.astype(f"S{wide}")).view("S1").reshape(*values.shape, wide)
        return characters, (*dims, _TEXT + name), {"_Encoding": "utf-8"}
    if values.dtype.kind == "b":
        return values.astype(np.int8), dims, {"dtype": "bool"}
    if values.dtype.kind in "iu":
        fits = not values.size or np.abs(values).max() < 2**31
        return values.astype(np.int32 if fits else np.float64), dims, {"stickslip_dtype": values.dtype.name}
    return values.astype(np.float64), dims, {}


def _decoded(variable: Any) -> Variable:
    about = {key: _plain(value) for key, value in variable._attributes.items()}
    values, dims = np.array(variable[:]), tuple(variable.dimensions)
    if dims and dims[-1].startswith(_TEXT):
        rows = np.ascontiguousarray(values).reshape(-1, values.shape[-1])
        texts = [b"".join(row.tolist()).rstrip(b"\0").decode() for row in rows]
        values, dims = np.array(texts, dtype=np.str_).reshape(values.shape[:-1]), dims[:-1]
    elif about.get("dtype") == "bool":
        values = values.astype(bool)
    else:
        values = values.astype(str(about.get("stickslip_dtype", "float64")))
    return Variable(
        dims=dims, values=values, unit=str(about.get("units", "")), about=str(about.get("long_name", ""))
    )


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode()
    return value.item() if isinstance(value, (np.generic, np.ndarray)) else value


_KEY = b"stickslip"


def write_parquet(data: Dataset, path: Path) -> None:
    """Write the table of a dataset; MissingExtraError without pyarrow."""
    pa, pq = _pyarrow()
    columns = data.table().variables
    fields = [pa.field(name, _type(pa, v), metadata=v.attributes or None) for name, v in columns.items()]
    about = json.dumps({"kind": data.kind, "attributes": dict(data.attributes)})
    schema = pa.schema(fields, metadata={_KEY: about.encode()})
    pq.write_table(pa.table([pa.array(v.values) for v in columns.values()], schema=schema), path)


def read_parquet(path: Path) -> Dataset:
    """Read a table that `write_parquet` wrote, or any other.

    Raises
    ------
    OSError, ValueError
        Not a Parquet file.
    MissingExtraError
        pyarrow is not installed.
    """
    _, pq = _pyarrow()
    table = pq.read_table(path)
    about = json.loads((table.schema.metadata or {}).get(_KEY, b"{}"))
    variables = {}
    for column_field, column in zip(table.schema, table.columns, strict=True):
        notes = {key.decode(): text.decode() for key, text in (column_field.metadata or {}).items()}
        values = column.to_numpy()
        variables[column_field.name] = Variable(
            dims=(ROW,), values=values.astype(np.str_) if values.dtype.kind == "O" else values,
            unit=notes.get("units", ""), about=notes.get("long_name", ""),
        )  # fmt: skip
    return Dataset(
        kind=about.get("kind", "table"), rows=(ROW,), variables=variables,
        attributes=about.get("attributes", {}),
    )  # fmt: skip


def _type(pa: Any, variable: Variable) -> Any:
    kind = variable.values.dtype
    return pa.string() if kind.kind == "U" else pa.from_numpy_dtype(kind)


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise MissingExtraError("pyarrow", "parquet") from error
    return pa, pq
