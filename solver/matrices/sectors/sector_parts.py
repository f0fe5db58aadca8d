"""What a sector brings beside its matrices: parts that mistuning scales, matrices of nodal diameters."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Complex
from solver.errors import SettingError
from solver.matrices.sectors.outline import OutlineMotion
from solver.matrices.values import MOST_DOFS, ByContent, Matrix, Named, differs

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
    ahead: Annotated[Complex, "T(a)ᴴ P T(b), (n_parts, nd, nd, n, n)."]
    back: Annotated[Complex, "T(a)ᴴ P T(−b), (n_parts, nd, nd, n, n)."]
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
        stacks: dict[str, list[Complex]] = {"ahead": [], "back": []}
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


def _numbers(key: str, item: Any) -> Complex:
    if not isinstance(item, dict) or set(item) != {"real", "imag"}:
        raise ValueError(f"`parts`: `{key}` must be a table with `real` and `imag`")
    try:
        real, imag = (np.array(item[part], dtype=np.float64) for part in ("real", "imag"))
    except (TypeError, ValueError) as error:
        raise ValueError(f"`parts`: `{key}` must hold numbers alone") from error
    if real.shape != imag.shape:
        raise ValueError(f"`parts`: `{key}`: `real` and `imag` must be of one size")
    return np.asarray(real + 1j * imag)


_KEYS = ("diameters", "M", "K", "C", "parts", "motion")
_MOST = 5001  # nodal diameters of the largest disk


@dataclass(frozen=True, slots=True, eq=False)
class DiameterMatrices(ByContent):
    """M, K and maybe C of one sector at some nodal diameters; equal to another with the same content.

    The first coordinates are DOFs, the same at each nodal diameter; the others may be modes of their own.
    """

    diameters: Annotated[
        tuple[int, ...],
        "Ascending, each from 0 to half the number of sectors; that of n backward is the complex conjugate.",
    ]
    M: Annotated[Complex, "Hermitian and read-only, (nd, n, n)."]
    K: Annotated[Complex, "As M."]
    C: Annotated[Complex | None, "(nd, n, n)."] = None
    parts: Annotated[PartsAcross | None, "Parts that mistuning may scale, between the nodal diameters."] = (
        None
    )
    motion: Annotated[OutlineMotion | None, "Of the outline of the mesh, to be drawn."] = None
    digest: Annotated[str, "Hash of the content."] = field(init=False)

    def __post_init__(self) -> None:
        given = {"M": self.M, "K": self.K} | ({} if self.C is None else {"C": self.C})
        if not self.diameters or list(self.diameters) != sorted(set(self.diameters)) or self.diameters[0] < 0:
            raise ValueError(
                f"`diameters` must be ascending whole numbers >= 0, at least one, got {self.diameters}"
            )
        kept = {}
        for key, value in given.items():
            array = np.array(value, dtype=np.complex128)
            wanted = (len(self.diameters), array.shape[-1], array.shape[-1])
            if array.ndim != 3 or array.shape != wanted or not array.size:
                raise ValueError(
                    f"`{key}` must have a square matrix for each of the {len(self.diameters)} nodal "
                    f"diameters, got {' x '.join(map(str, array.shape))}"
                )
            if array.shape[-1] > MOST_DOFS or array.shape != np.shape(self.M):
                raise ValueError(f"`{key}` must have at most {MOST_DOFS} rows, as many as `M`")
            if not np.isfinite(array).all():
                raise ValueError(f"`{key}` must hold finite numbers")
            turned = np.swapaxes(array.conj(), 1, 2)
            if differs(array, turned):
                raise ValueError(f"`{key}` must be Hermitian at each nodal diameter")
            kept[key] = 0.5 * (array + turned)
        besides = [each.digest for each in (self.parts, self.motion) if each is not None]
        self._hold(kept, self.diameters, *besides)
        for n, mass in zip(self.diameters, self.M, strict=True):
            try:
                np.linalg.cholesky(mass)
            except np.linalg.LinAlgError as error:
                raise ValueError(f"`M` must be positive definite at nodal diameter {n}") from error
        if self.parts is not None:
            self.parts.check(len(self.diameters), self.size)
        if self.motion is not None:
            self.motion.check(len(self.diameters), self.size)

    def __repr__(self) -> str:
        listed = ", ".join(map(str, self.diameters))
        return f"DiameterMatrices({self.size} coordinates, nodal diameters {listed}, {self.digest[:12]})"

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.M.shape[1])

    def at(self, n: int, sectors: int) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """K, C and M at nodal diameter n, from 0 to half the sectors; real where the phase is.

        Raises
        ------
        SettingError
            The model was not reduced for it.
        """
        if n not in self.diameters:
            built = ", ".join(map(str, self.diameters))
            raise SettingError(
                "nodal diameter",
                n,
                f"must be one that the model was reduced for ({built}): harmonics of this engine order call "
                "for it; reduce again with more of them, or ask for fewer harmonics",
            )
        i = self.diameters.index(n)
        C = np.zeros_like(self.K[i]) if self.C is None else self.C[i]
        found = self.K[i], C, self.M[i]
        return found if 2 * n % sectors else (found[0].real, found[1].real, found[2].real)

    @classmethod
    def read(cls, data: object) -> DiameterMatrices:
        """Read a table of `diameters`, lists `M`, `K`, `C` of tables `real`, `imag`; `parts`, `motion`."""
        if isinstance(data, DiameterMatrices):
            return data
        if isinstance(data, str):
            raise ValueError(
                "`diameters` must be given inline here: files are read by load_scene only, got the path "
                f"{data[:80]!r}"
            )
        if not isinstance(data, dict) or not {"diameters", "M", "K"} <= set(data) <= set(_KEYS):
            got = ", ".join(map(str, data))[:200] if isinstance(data, dict) else type(data).__name__
            raise ValueError(f"`diameters` must be a table with the keys {', '.join(_KEYS)}, got {got}")
        counts = data["diameters"]
        good = isinstance(counts, list | tuple) and 0 < len(counts) <= _MOST
        if not good or any(isinstance(n, bool) or not isinstance(n, int) for n in counts):
            raise ValueError("`diameters` must be a list of whole numbers")
        given = ("M", "K") if data.get("C") is None else ("M", "K", "C")
        arrays = {key: _stack(key, data[key], len(counts)) for key in given}
        parts = None if data.get("parts") is None else PartsAcross.read(data["parts"])
        motion = None if data.get("motion") is None else OutlineMotion.read(data["motion"])
        return cls(diameters=tuple(counts), parts=parts, motion=motion, **arrays)

    def write(self) -> dict[str, object]:
        """The table that `read` reads."""
        table: dict[str, object] = {"diameters": list(self.diameters)}
        given = {"M": self.M, "K": self.K, "C": self.C}
        for key, value in given.items():
            if value is not None:
                table[key] = [_written(matrix) for matrix in value]
        if self.parts is not None:
            table["parts"] = self.parts.write()
        if self.motion is not None:
            table["motion"] = self.motion.write()
        return table


def _stack(key: str, data: object, count: int) -> Complex:
    if not isinstance(data, list | tuple) or len(data) != count:
        raise ValueError(f"`{key}` must have a table `real`, `imag` for each of the {count} nodal diameters")
    return np.array([_complex(key, item) for item in data])


def _complex(key: str, item: Any) -> Complex:
    if not isinstance(item, dict) or not {"real"} <= set(item) <= {"real", "imag"}:
        raise ValueError(f"`{key}` must hold tables with the keys `real` and `imag`")
    real = Matrix.read(item["real"]).array
    imag = Matrix.read(item["imag"]).array if "imag" in item else np.zeros_like(real)
    if imag.shape != real.shape:
        raise ValueError(f"`{key}`: `real` and `imag` must be of one size")
    return np.asarray(real + 1j * imag, dtype=np.complex128)


def _written(matrix: Complex) -> dict[str, object]:
    table: dict[str, object] = {"real": Matrix(matrix.real).write()}
    if np.any(matrix.imag):
        table["imag"] = Matrix(matrix.imag).write()
    return table
