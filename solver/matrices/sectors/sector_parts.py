"""Parts of a sector that mistuning scales: their matrices, and what a reduction leaves of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from solver.matrices.values import ByContent, Matrix, Named, differs

ComplexArray = NDArray[np.complex128]
WHOLE = ("K", "M")  # names for the stiffness and the mass of a whole sector
_NAME = re.compile(r"[A-Za-z0-9_-]{1,80}")


def check_part_names(names: Sequence[object]) -> None:
    """Raise ValueError unless these can be names of parts of a sector."""
    for name in names:
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise ValueError(
                f"`parts`: a name may have only letters, digits, _ and -, got {str(name)[:80]!r}"
            )
        if name in WHOLE:
            raise ValueError(f"`parts`: {name!r} stands for that of the whole sector: choose another name")


class PartMatrices(Named):
    """Names of parts of a full sector, with the stiffness of each over all rows of the sector."""

    @property
    def matrices(self) -> tuple[Matrix, ...]:
        """[N/m], symmetric; part of K, which they are contained in."""
        return self.values

    @classmethod
    def read(cls, data: object) -> PartMatrices:
        """Read a table of names and matrices."""
        if isinstance(data, PartMatrices):
            return data
        if not isinstance(data, dict) or not data:
            raise ValueError(f"`parts` must be a table of names and matrices, got {str(data)[:80]}")
        check_part_names(list(data))
        table = {}
        for name, given in data.items():
            try:
                table[name] = Matrix.read(given)
            except ValueError as error:
                raise ValueError(f"`parts`: {name!r}: {error}") from error
            if differs(table[name].array, table[name].array.T):
                raise ValueError(f"`parts`: {name!r} must be symmetric")
        return cls(table)

    def write(self) -> dict[str, object]:
        """The table that `read` reads."""
        return {name: matrix.write() for name, matrix in zip(self, self.matrices, strict=True)}


@dataclass(frozen=True, slots=True, eq=False)
class PartsAcross(ByContent):
    """Parts P of a sector that was reduced with a basis T(n) at each nodal diameter: P between all of them.

    A mistuned disk is no wave: its nodal diameters move together. Of a part with the factor 1 + δ_j in sector
    j they get the matrices T(n)ᴴ P T(m) 1/N Σ_j δ_j e^{i(m−n)jα}, with T(−n) the complex conjugate of T(n)
    (component modes of mistuned disks: R. Bladh, M. P. Castanier, C. Pierre, J. Eng. Gas Turbines Power 123
    (2001) 100, doi:10.1115/1.1338948).
    """

    names: Annotated[tuple[str, ...], "Tuple of str."]
    ahead: Annotated[ComplexArray, "T(a)ᴴ P T(b), (n_parts, nd, nd, n, n)."]
    back: Annotated[ComplexArray, "T(a)ᴴ P T(−b), (n_parts, nd, nd, n, n)."]
    digest: Annotated[str, "Hash of the content."] = field(init=False)

    def __post_init__(self) -> None:
        if not self.names or len(set(self.names)) < len(self.names):
            raise ValueError("`parts` must have names, each once")
        check_part_names([name for name in self.names if name not in WHOLE])
        kept = {}
        for key, given in (("ahead", self.ahead), ("back", self.back)):
            array = np.array(given, dtype=np.complex128)
            shape = array.shape
            if array.ndim != 5 or shape[0] != len(self.names) or shape[1] != shape[2] or shape[3] != shape[4]:
                raise ValueError(f"`parts`: `{key}` must have a matrix for each pair of nodal diameters")
            if not np.isfinite(array).all():
                raise ValueError(f"`parts`: `{key}` must hold finite numbers")
            turned = array.transpose(0, 2, 1, 4, 3)
            turned = turned.conj() if key == "ahead" else turned
            if differs(array, turned):
                raise ValueError(f"`parts`: `{key}` must be that of a symmetric matrix")
            kept[key] = array
        if self.ahead.shape != self.back.shape:
            raise ValueError("`parts`: `ahead` and `back` must be of one size")
        self._hold(kept, self.names)

    def check(self, diameters: int, size: int) -> None:
        """Raise ValueError unless they are of so many nodal diameters and coordinates."""
        if self.ahead.shape[1:4] != (diameters, diameters, size):
            got = " x ".join(map(str, self.ahead.shape[1:4]))
            raise ValueError(
                f"`parts` must be of {diameters} x {diameters} nodal diameters and {size} coordinates, "
                f"got {got}"
            )

    @classmethod
    def read(cls, data: object) -> PartsAcross:
        """Read tables `ahead` and `back` of `real` and `imag`, by the names of the parts."""
        if isinstance(data, PartsAcross):
            return data
        if not isinstance(data, dict) or not data:
            raise ValueError("`parts` must be a table by the names of the parts")
        stacks: dict[str, list[ComplexArray]] = {"ahead": [], "back": []}
        for name, table in data.items():
            if not isinstance(table, dict) or set(table) != set(stacks):
                raise ValueError(f"`parts`: {str(name)[:80]!r} must be a table with `ahead` and `back`")
            for key, stack in stacks.items():
                stack.append(_numbers(f"{name}.{key}", table[key]))
        try:
            ahead, back = (np.array(stack) for stack in stacks.values())
        except ValueError as error:
            raise ValueError("`parts` must all be of one size") from error
        return cls(tuple(data), ahead, back)

    def write(self) -> dict[str, object]:
        """The table that `read` reads."""
        return {
            name: {
                key: {"real": stack[i].real.tolist(), "imag": stack[i].imag.tolist()}
                for key, stack in (("ahead", self.ahead), ("back", self.back))
            }
            for i, name in enumerate(self.names)
        }


def _numbers(key: str, item: Any) -> ComplexArray:
    if not isinstance(item, dict) or set(item) != {"real", "imag"}:
        raise ValueError(f"`parts`: `{key}` must be a table with `real` and `imag`")
    try:
        real, imag = (np.array(item[part], dtype=np.float64) for part in ("real", "imag"))
    except (TypeError, ValueError) as error:
        raise ValueError(f"`parts`: `{key}` must hold numbers alone") from error
    if real.shape != imag.shape:
        raise ValueError(f"`parts`: `{key}`: `real` and `imag` must be of one size")
    return np.asarray(real + 1j * imag)
