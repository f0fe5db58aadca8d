"""A result as named arrays with dimensions, units and attributes: what every file and table is made of."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
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
