"""Matrices and modes as values of a scene: frozen, compared by content, written as plain lists.

In a request they are lists or a table of entries; only `solver.load_scene` replaces the names of files by
what they hold (`solver.matrices.scene_files`), so that a scene from somewhere else never opens a path.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from solver.arrays import Real

# Forces over displacements, and moments over angles, in the units of the files: what they are in N/m and
# N m. Masses go with them, as seconds stay seconds: t, mm, N and lbf s²/in, in, lbf are consistent units.
UNITS = {"SI": (1.0, 1.0), "mm": (1e3, 1e-3), "in": (4.4482216152605 / 0.0254, 4.4482216152605 * 0.0254)}
METRES = {"SI": 1.0, "mm": 1e-3, "in": 0.0254}
"""The length of each."""


ArrayOf = TypeVar("ArrayOf", bound=NDArray[Any])
MOST_DOFS = 2000
ASYMMETRY = 1e-8  # largest difference from the transpose, relative to the largest entry, taken for rounding
MOST_MODES = 2000
_ENTRY_KEYS = ("size", "rows", "columns", "values")
MODES_KEYS = ("omega2", "frequencies_hz", "modes", "damping_ratio")
_SPARSE_BELOW = 0.3  # share of entries that are not zero below which a matrix is written entry by entry
_INLINE = "must be given inline here, as rows or as a table of entries: files are read by load_scene only"


class Tabled:
    """Data that scenes hold as a table: `read` makes them of one, or of themselves, `write` gives it back."""

    __slots__ = ()

    @classmethod
    def __get_pydantic_core_schema__(cls, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        made: Any = cls
        return core_schema.no_info_plain_validator_function(
            made.read, serialization=core_schema.plain_serializer_function_ser_schema(made.write)
        )


class ByContent(Tabled):
    """Arrays that are equal where the hashes of their contents are."""

    __slots__ = ()
    digest: str

    def _hold(self, arrays: Mapping[str, NDArray[Any]], *besides: object) -> None:
        """Keep checked arrays as fields, read-only, and the hash of them and of what is `besides`."""
        found = hashlib.sha256(repr(besides).encode())
        for key, array in arrays.items():
            object.__setattr__(self, key, frozen(array))
            found.update(f"{key}{array.shape}".encode() + array.tobytes())
        object.__setattr__(self, "digest", found.hexdigest())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


class Named(Tabled, tuple[str, ...]):
    """Names in their order with a value of each, equal where both are."""

    values: tuple[Any, ...]

    def __new__(cls, table: Mapping[str, Any]) -> Self:
        """Make them from a table of names and values."""
        made = super().__new__(cls, table)
        made.values = tuple(table.values())
        return made

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self.values == other.values and super().__eq__(other)

    def __hash__(self) -> int:
        return hash((tuple(self), self.values))

    def __reduce__(self) -> tuple[type[Self], tuple[dict[str, Any]]]:
        return type(self), (dict(zip(self, self.values, strict=True)),)


def frozen(array: ArrayOf) -> ArrayOf:
    """The array, read-only from now on."""
    array.setflags(write=False)
    return array


def _real(array: Any) -> Real:
    return np.ascontiguousarray(array, dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Matrix(ByContent):
    """A square matrix of a scene; equal to another with the same entries."""

    array: Annotated[Real, "Read-only, (n, n)."]
    digest: Annotated[str, "Hash of the content."] = field(init=False)

    def __post_init__(self) -> None:
        array = np.asarray(self.array)
        if array.ndim != 2 or array.shape[0] != array.shape[1] or not array.size:
            shape = " x ".join(map(str, array.shape))
            raise ValueError(f"a matrix must be square, with as many rows as columns, got {shape}")
        if array.shape[0] > MOST_DOFS:
            raise ValueError(
                f"a matrix may have {MOST_DOFS} rows, got {array.shape[0]}: set `keep_modes` in a scene "
                "file, which reduces it onto the DOFs in use, or give the modes instead"
            )
        bad = np.argwhere(~np.isfinite(array))
        if bad.size:
            i, j = bad[0]
            raise ValueError(f"a matrix must be finite, got {array[i, j]} in row {i}, column {j}")
        self._hold({"array": _real(array)})

    def __repr__(self) -> str:
        return f"Matrix({self.size} x {self.size}, {self.digest[:12]})"

    @property
    def size(self) -> int:
        """Number of rows."""
        return int(self.array.shape[0])

    @classmethod
    def read(cls, data: object) -> Matrix:
        """Read rows, or a table `size`, `rows`, `columns`, `values` of entries (zero-based, summed)."""
        if isinstance(data, Matrix):
            return data
        if isinstance(data, dict):
            if set(data) != set(_ENTRY_KEYS):
                got = ", ".join(sorted(map(str, data)))[:200]
                raise ValueError(
                    f"a matrix given by its entries has the keys {', '.join(_ENTRY_KEYS)}, got {got}"
                )
            size = data["size"]
            if isinstance(size, bool) or not isinstance(size, int) or not 1 <= size <= MOST_DOFS:
                raise ValueError(
                    f"`size` of a matrix must be a whole number from 1 to {MOST_DOFS}, got {str(size)[:80]}"
                )
            rows, columns, values = (_numbers(data[key] or [], f"`{key}`") for key in _ENTRY_KEYS[1:])
            if not rows.size == columns.size == values.size:
                raise ValueError(
                    "`rows`, `columns` and `values` must be of one length, "
                    f"got {rows.size}, {columns.size}, {values.size}"
                )
            for key, places in (("rows", rows), ("columns", columns)):
                bad = places[~((places >= 0) & (places < size) & (places == np.floor(places)))]
                if bad.size:
                    raise ValueError(f"`{key}` must be whole numbers from 0 to {size - 1}, got {bad[0]:g}")
            array = np.zeros((size, size))
            np.add.at(array, (rows.astype(np.int64), columns.astype(np.int64)), values)
            return cls(array)
        if isinstance(data, list | tuple):
            return cls(_rows(data, "a matrix", MOST_DOFS))
        if isinstance(data, str):
            raise ValueError(f"a matrix {_INLINE}, got the path {data[:80]!r}")
        raise ValueError(f"a matrix must be a list of rows or a table of entries, got {type(data).__name__}")

    def write(self) -> list[list[float]] | dict[str, object]:
        """Rows, or the entries that are not zero where these are few; `read` gives back the same matrix."""
        rows, columns = np.nonzero(self.array)
        if rows.size >= _SPARSE_BELOW * self.array.size:
            dense: list[list[float]] = self.array.tolist()
            return dense
        return {
            "size": self.size,
            "rows": rows.tolist(),
            "columns": columns.tolist(),
            "values": self.array[rows, columns].tolist(),
        }

    @classmethod
    def __get_pydantic_core_schema__(cls, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        def reader(data: object) -> Matrix:
            try:
                return cls.read(data)
            except ValueError as error:
                raise ValueError(
                    f"`{handler.field_name}`: {error}" if handler.field_name else str(error)
                ) from error

        return core_schema.no_info_plain_validator_function(
            reader, serialization=core_schema.plain_serializer_function_ser_schema(cls.write)
        )

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """As a scene file gives it: the name of a file, rows, or a table of entries."""
        rows = {"type": "array", "items": {"type": "array", "items": {"type": "number"}}}
        return {"anyOf": [{"type": "string"}, rows, {"type": "object"}]}


@dataclass(frozen=True, slots=True, eq=False)
class NormalModes(ByContent):
    """Mass-normalised modes of a structure: q'' + 2 ζ ω q' + ω² q = φᵀ f, x = φ q."""

    omega2: Annotated[Real, "Squares of the natural frequencies [rad²/s²], (m,); 0 of a rigid body."]
    modes: Annotated[Real, "One mode a column, φᵀ M φ = 1 [kg^-1/2], (n, m)."]
    damping_ratio: Annotated[Real | None, "ζ of each mode, (m,)."] = None
    digest: Annotated[str, "Hash of the content."] = field(init=False)

    def __post_init__(self) -> None:
        omega2, modes = np.asarray(self.omega2), np.asarray(self.modes)
        if omega2.ndim != 1 or modes.ndim != 2 or modes.shape[1] != omega2.size or not modes.size:
            raise ValueError(
                f"`modes` must have one column for each of the {omega2.size} frequencies, got {modes.shape}"
            )
        if omega2.size > MOST_MODES or modes.shape[0] > MOST_DOFS:
            raise ValueError(f"`modes` may have {MOST_DOFS} rows and {MOST_MODES} columns, got {modes.shape}")
        if not (np.isfinite(omega2).all() and np.isfinite(modes).all()):
            raise ValueError("`modes` must be finite, frequencies and shapes alike")
        if omega2.min() < 0.0:
            raise ValueError(f"`omega2` must be >= 0, got {omega2.min():g}")
        kept, ratio = {"omega2": _real(omega2), "modes": _real(modes)}, self.damping_ratio
        if ratio is not None:
            given = np.asarray(ratio, dtype=np.float64)
            if given.ndim > 1 or given.size not in (1, omega2.size):
                raise ValueError(f"`damping_ratio` must have 1 or {omega2.size} entries, got {given.size}")
            if not np.all((given >= 0.0) & (given <= 10.0)):
                raise ValueError(
                    f"`damping_ratio` must be from 0 to 10, got {given.min():g} to {given.max():g}"
                )
            kept["damping_ratio"] = np.broadcast_to(given, omega2.shape).copy()
        self._hold(kept)

    def __repr__(self) -> str:
        return f"Modes({self.modes.shape[0]} DOFs, {self.omega2.size} modes, {self.digest[:12]})"

    @property
    def size(self) -> int:
        """Number of DOFs the modes have."""
        return int(self.modes.shape[0])

    @classmethod
    def read(cls, data: object) -> NormalModes:
        """Read a table with `omega2` or `frequencies_hz`, `modes` (rows: DOFs) and maybe `damping_ratio`."""
        if isinstance(data, NormalModes):
            return data
        if isinstance(data, str):
            raise ValueError(f"`modes` {_INLINE}, got the path {data[:80]!r}")
        if not isinstance(data, dict):
            raise ValueError(f"`modes` must be a table, got {type(data).__name__}")
        unknown = [str(key) for key in data if key not in MODES_KEYS]
        if unknown:
            raise ValueError(
                f"`{unknown[0][:80]}` is not a key of modes; known keys: {', '.join(MODES_KEYS)}"
            )
        if ("omega2" in data) == ("frequencies_hz" in data) or "modes" not in data:
            raise ValueError(
                "`modes` must have the keys `modes` and one of `omega2` [rad²/s²] and `frequencies_hz`, got "
                + (", ".join(sorted(data)) or "none")
            )
        arrays = {key: _numbers(data[key], f"`{key}`") for key in data if key != "modes"}
        return cls.of({**arrays, "modes": _rows(data["modes"], "`modes`", MOST_DOFS)})

    @classmethod
    def of(cls, arrays: dict[str, Real]) -> NormalModes:
        """Modes from the arrays of a file or a table, under the keys of the table."""
        omega2 = arrays["omega2"] if "omega2" in arrays else (2.0 * np.pi * arrays["frequencies_hz"]) ** 2
        if "frequencies_hz" in arrays and np.any(arrays["frequencies_hz"] < 0.0):
            raise ValueError(f"`frequencies_hz` must be >= 0, got {arrays['frequencies_hz'].min():g}")
        return cls(omega2=omega2, modes=arrays["modes"], damping_ratio=arrays.get("damping_ratio"))

    def write(self) -> dict[str, object]:
        """The table that `read` reads."""
        table: dict[str, object] = {"omega2": self.omega2.tolist(), "modes": self.modes.tolist()}
        if self.damping_ratio is not None:
            table["damping_ratio"] = self.damping_ratio.tolist()
        return table


def as_json(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of a structure with its matrices, modes and nodal diameters as lists of numbers."""
    return {key: _plain(item) for key, item in tables.items()}


def _plain(item: Any) -> Any:
    """A value of the scene as it writes itself, in tables too; numbers and words as they are."""
    if isinstance(item, dict):
        return as_json(item)
    return item.write() if hasattr(item, "write") else item


def _numbers(data: object, what: str) -> Real:
    """A number or a list of numbers; texts, truth values and nested lists are refused."""
    listed = data if isinstance(data, list | tuple) else [data]
    for i, value in enumerate(listed):
        if isinstance(value, bool) or not isinstance(value, int | float | np.number):
            raise ValueError(f"{what} must hold numbers, got {str(value)[:80]!r} as entry {i}")
    try:
        return np.array(listed, dtype=np.float64)
    except OverflowError:
        raise ValueError(f"{what} must be finite, got a whole number too large for it") from None


def _rows(data: object, what: str, most: int) -> Real:
    if (
        not isinstance(data, list | tuple)
        or not all(isinstance(row, list | tuple) for row in data)
        or not data
    ):
        raise ValueError(f"{what} must be a list of rows, each a list of numbers")
    if len(data) > most:
        raise ValueError(f"{what} may have {most} rows, got {len(data)}")
    width = len(data[0])
    for i, row in enumerate(data):
        if len(row) != width:
            raise ValueError(f"{what}: row {i} has {len(row)} numbers where row 0 has {width}")
    return np.array([_numbers(row, f"{what}, row {i},") for i, row in enumerate(data)]).reshape(-1, width)


def differs(array: NDArray[Any], turned: NDArray[Any]) -> bool:
    """Whether an array differs from what it should be when turned over, by more than rounding."""
    return bool(np.abs(array - turned).max() > ASYMMETRY * np.abs(array).max())


_NAME = re.compile(r"[A-Za-z0-9_-]{1,80}(@[0-9]{1,9})?")


class DofTable(Named):
    """Names of DOFs in order, with the row of each in the matrices."""

    @property
    def rows(self) -> tuple[int, ...]:
        """Zero-based."""
        return self.values

    @classmethod
    def read(cls, data: object) -> DofTable:
        """Read a table ``{name: row}``, or a list of names for the rows 0, 1, 2, …"""
        if isinstance(data, DofTable):
            return data
        if isinstance(data, list | tuple):
            if not all(isinstance(name, str) for name in data):
                raise ValueError("`dofs` must be a table of names and rows, or a list of names")
            table: dict[str, int] = {}
            for row, name in enumerate(data):
                if table.setdefault(name, row) != row:
                    raise ValueError(f"`dofs` names {name[:80]!r} twice; each row needs a name of its own")
            data = table
        if not isinstance(data, dict):
            raise ValueError(f"`dofs` must be a table of names and rows, got {type(data).__name__}")
        if not data:
            raise ValueError("`dofs` must name at least one DOF, got none")
        owner: dict[int, str] = {}
        for name, row in data.items():
            if not isinstance(name, str) or not _NAME.fullmatch(name):
                raise ValueError(
                    f"`dofs`: a name may have only letters, digits, _ and -, got {str(name)[:80]!r}"
                )
            if isinstance(row, bool) or not isinstance(row, int) or row < 0:
                raise ValueError(
                    f"`dofs`: {name!r} must have a row number >= 0 (zero-based), got {str(row)[:80]}"
                )
            if row in owner:
                raise ValueError(f"`dofs`: row {row} is named twice, {owner[row]!r} and {name!r}; keep one")
            owner[row] = name
        return cls(data)

    def write(self) -> dict[str, int]:
        """The table that `read` reads."""
        return dict(zip(self, self.rows, strict=True))


def one_triangle(array: Any) -> str | None:
    """What to do about a matrix, dense or sparse, of which one triangle alone is there; None if both are."""
    rows, columns = array.nonzero()
    apart = np.sign(rows - columns)
    sides = set(apart[apart != 0].tolist())
    if len(sides) != 1:
        return None
    side = "lower" if sides == {1} else "upper"
    return (
        f"its {side} triangle alone is there; fill the other one (A + A.T - diagonal), or write a format "
        "that says it (MatrixMarket with `symmetric` in its first line, Harwell-Boeing RSA)"
    )


def symmetric(key: str, matrix: Matrix) -> Matrix:
    """The matrix without the rounding by which it differs from its transpose.

    Raises
    ------
    ValueError
        It differs by more than that.
    """
    array = matrix.array
    difference = np.abs(array - array.T)
    worst = float(difference.max())
    if worst == 0.0:
        return matrix
    if worst > ASYMMETRY * float(np.abs(array).max()):
        i, j = sorted(int(at) for at in np.unravel_index(np.argmax(difference), array.shape))
        triangle = one_triangle(array)
        if triangle is not None:
            raise ValueError(f"`{key}` must be symmetric: {triangle}")
        raise ValueError(
            f"`{key}` must be symmetric to {ASYMMETRY:g} of its largest entry, "
            f"got {array[i, j]:.10g} in row {i}, column {j} and {array[j, i]:.10g} in row {j}, column {i}"
            + ("" if key not in ("K", "C") else "; if it is meant so, set `symmetric` = false")
        )
    return Matrix(0.5 * (array + array.T))


def antisymmetric(key: str, matrix: Matrix) -> Matrix:
    """The matrix without the rounding by which it differs from minus its transpose.

    Raises
    ------
    ValueError
        It differs by more than that.
    """
    array = matrix.array
    difference = np.abs(array + array.T)
    if float(difference.max()) > ASYMMETRY * float(np.abs(array).max()):
        i, j = (int(at) for at in np.unravel_index(np.argmax(difference), array.shape))
        raise ValueError(
            f"`{key}` must be antisymmetric to {ASYMMETRY:g} of its largest entry, "
            f"got {array[i, j]:.10g} in row {i}, column {j} and {array[j, i]:.10g} in row {j}, column {i}"
        )
    return Matrix(0.5 * (array - array.T))


def check_matrices(
    M: Matrix | None,
    K: Matrix | None,
    C: Matrix | None,
    modes: NormalModes | None,
    dofs: DofTable,
    others: Mapping[str, Matrix],
    *,
    joined: bool = False,
) -> None:
    """Raise ValueError unless matrices or modes are there, of one size that has the rows of the DOFs.

    Parameters
    ----------
    joined : whether boundaries of a sector are to be joined first, before M must be definite.
    """
    given = {key: value for key, value in (("M", M), ("K", K), ("C", C)) if value is not None}
    given |= others
    if modes is not None and given:
        raise ValueError(f"`modes` stands in place of the matrices: remove {', '.join(given)} or `modes`")
    if modes is None and (M is None or K is None):
        missing = "M" if M is None else "K"
        raise ValueError(f"`{missing}` is missing: a matrices structure needs M and K, or `modes`")
    size = modes.size if modes is not None else given["M"].size
    for key, value in given.items():
        if value.size != size:
            raise ValueError(f"`{key}` must have {size} rows as `M` has, got {value.size}")
    for name, row in dofs.write().items():
        if row >= size:
            raise ValueError(f"`dofs`: {name!r} must have a row from 0 to {size - 1}, got {row}")
    if M is not None and not joined:
        check_definite(M.array)


def check_definite(M: NDArray[Any]) -> None:
    """Raise ValueError unless a mass matrix, symmetric or Hermitian, is positive definite."""
    diagonal = np.diag(M).real
    if diagonal.min() <= 0.0:
        row = int(diagonal.argmin())
        raise ValueError(
            f"`M` must be positive definite, got {diagonal[row]:g} on the diagonal of row {row}: "
            "a DOF without mass must be condensed out first"
        )
    try:
        np.linalg.cholesky(M)
    except np.linalg.LinAlgError as error:
        least = float(np.linalg.eigvalsh(M)[0])
        raise ValueError(f"`M` must be positive definite, got the eigenvalue {least:g}") from error
