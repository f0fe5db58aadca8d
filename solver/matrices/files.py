"""Matrices and modes from files: NumPy, SciPy, MATLAB, MatrixMarket, Harwell-Boeing; chosen by the suffix."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat, mmread
from scipy.sparse import coo_array, issparse

from solver.matrices.harwell_boeing import read_harwell_boeing
from solver.matrices.values import Modes

FloatArray = NDArray[np.float64]
HARWELL_BOEING = (
    ".rb",
    ".hb",
    ".rsa",
    ".rua",
    ".rra",
    ".psa",
    ".pua",
    ".rse",
    ".isa",
    ".iua",
    ".csa",
    ".cua",
)
SUFFIXES = (".npz", ".npy", ".mat", ".mtx", *HARWELL_BOEING)
_DAMAGE = (ValueError, KeyError, TypeError, EOFError, IndexError, OverflowError, NotImplementedError,
           zipfile.BadZipFile, zlib.error)  # fmt: skip


class MatrixFileError(ValueError):
    """A file that holds no usable matrix; the message names the file and where it is damaged."""


def read_matrix(path: Path, key: str) -> coo_array:
    """Read the matrix `key` (``M``, ``C`` or ``K``) from a file.

    A file of several arrays (.npz, .mat) must hold one named `key`, or one alone.

    Raises
    ------
    MatrixFileError
        No such file, an unknown suffix, a damaged file, or no real matrix in it.
    """
    found = _read(path, lambda suffix: _matrix(path, suffix, key))
    array = found if issparse(found) else np.asarray(found)
    if array.dtype.kind == "c" and not np.any(np.imag(array.data if issparse(array) else array)):
        array = array.real
    if array.dtype.kind not in "fiu":
        raise MatrixFileError(f"{str(path)!r} must hold real numbers, got {array.dtype}")
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not array.shape[0]:
        shape = " x ".join(map(str, array.shape))
        raise MatrixFileError(f"{str(path)!r} must hold a square matrix, got {shape or 'a number'}")
    matrix = coo_array(array, dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(matrix.data))
    if bad.size:
        at = bad[0]
        where = f"row {matrix.row[at]}, column {matrix.col[at]} (zero-based)"
        raise MatrixFileError(f"{str(path)!r} must hold finite numbers, got {matrix.data[at]} in {where}")
    return matrix


def array_names(path: Path) -> list[str]:
    """Names of the arrays in a .npz or .mat file; none for a file of one matrix.

    Raises
    ------
    MatrixFileError
        No such file, an unknown suffix, or a damaged file.
    """
    names: list[str] = _read(path, lambda suffix: _names(path, suffix))
    return names


def _names(path: Path, suffix: str) -> list[str]:
    if suffix == ".mat":
        return list(_matlab(path))
    if suffix != ".npz":
        return []
    with _archive(path) as arrays:
        return list(arrays.files)


def read_modes(path: Path) -> Modes:
    """Read modes from a .npz or .mat file with `modes`, `omega2` or `frequencies_hz`, maybe `damping_ratio`.

    Raises
    ------
    MatrixFileError
        No such file, a damaged one, or one without these arrays.
    """
    arrays = _read(path, lambda suffix: _modes_arrays(path, suffix))
    for name, array in arrays.items():
        if array.dtype.kind not in "fiu":
            raise MatrixFileError(f"{str(path)!r}: `{name}` must hold real numbers, got {array.dtype}")
    wanted = ("omega2" in arrays) != ("frequencies_hz" in arrays)
    if not wanted or "modes" not in arrays:
        raise MatrixFileError(
            f"{str(path)!r} must hold `modes` and one of `omega2` [rad²/s²] and `frequencies_hz`, got "
            + (", ".join(f"`{name}`" for name in arrays) or "none of them")
        )
    try:
        return Modes.of(arrays)
    except ValueError as error:
        raise MatrixFileError(f"{str(path)!r}: {error}") from error


def _read(path: Path, reader: Callable[[str], Any]) -> Any:
    """Read with `reader`, every failure as a MatrixFileError that names the file."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise MatrixFileError(f"{str(path)!r} must end in {', '.join(SUFFIXES)}, got {suffix!r}")
    try:
        return reader(suffix)
    except MatrixFileError:
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        raise MatrixFileError(f"{str(path)!r} cannot be read: {reason}") from error
    except MemoryError as error:
        raise MatrixFileError(f"{str(path)!r} holds more than fits into memory") from error
    except _DAMAGE as error:
        reason = str(error).strip().rstrip(".") or type(error).__name__
        raise MatrixFileError(f"{str(path)!r} is damaged or not a {suffix} file: {reason[:300]}") from error


def _matrix(path: Path, suffix: str, key: str) -> Any:
    if suffix in HARWELL_BOEING:
        return read_harwell_boeing(path)
    if suffix == ".mtx":
        return _matrix_market(path)
    if suffix == ".npy":
        return np.load(path, allow_pickle=False)
    if suffix == ".mat":
        return _chosen(_matlab(path), key, path)
    with _archive(path) as arrays:
        if {"format", "shape", "data"} <= set(arrays.files):
            return _sparse(arrays)
        return _chosen({name: arrays[name] for name in _wanted(arrays.files, key, path)}, key, path)


def _matrix_market(path: Path) -> Any:
    with path.open("rb") as file:
        banner = file.readline(200).decode("ascii", "replace").lower().split()
    if "pattern" in banner:
        raise MatrixFileError(f"{str(path)!r}, line 1: a pattern has no values")
    return mmread(path, spmatrix=False)


@contextmanager
def _archive(path: Path) -> Iterator[Any]:
    """Open a .npz file; what is not one is named by its first bytes."""
    with path.open("rb") as file:
        start = file.read(4)
        if start[:2] != b"PK":
            raise MatrixFileError(
                f"{str(path)!r} is not a .npz file: it begins with {start!r} at byte 0, not PK"
            )
        file.seek(0)
        with np.load(file, allow_pickle=False) as arrays:
            yield arrays


def _sparse(arrays: Any) -> coo_array:
    """A matrix that scipy.sparse.save_npz wrote, its indices checked: SciPy trusts the file."""
    from scipy.sparse import bsr_array, csc_array, csr_array, dia_array

    kind, shape, data = arrays["format"].item(), tuple(int(n) for n in arrays["shape"]), arrays["data"]
    kind = kind.decode("ascii") if isinstance(kind, bytes) else str(kind)
    if kind == "coo":
        places = arrays["coords"] if "coords" in arrays.files else np.array([arrays["row"], arrays["col"]])
        return coo_array((data, tuple(places)), shape=shape)
    if kind == "dia":
        return dia_array((data, arrays["offsets"]), shape=shape).tocoo()
    made = {"csr": csr_array, "csc": csc_array, "bsr": bsr_array}.get(kind)
    if made is None:
        raise MatrixFileError(f"a sparse matrix of the format {kind!r} cannot be read: save it as csr")
    matrix = made((data, arrays["indices"], arrays["indptr"]), shape=shape)
    matrix.check_format(full_check=True)
    return matrix.tocoo()


def _matlab(path: Path) -> dict[str, Any]:
    with path.open("rb") as file:
        start = file.read(128)
    if b"MATLAB 7.3" in start:
        raise MatrixFileError(f"{str(path)!r} is a MATLAB 7.3 file: save it with -v7")
    return {name: value for name, value in loadmat(path, spmatrix=False).items() if not name.startswith("__")}


def _wanted(names: list[str], key: str, path: Path) -> list[str]:
    if key in names or len(names) == 1:
        return [key] if key in names else names
    known = ", ".join(f"`{name}`" for name in names[:20]) or "nothing"
    raise MatrixFileError(
        f"{str(path)!r} must hold an array named `{key}`, or one array alone; it holds {known}"
    )


def _chosen(arrays: Mapping[str, Any], key: str, path: Path) -> Any:
    return arrays[_wanted(list(arrays), key, path)[0]]


def _modes_arrays(path: Path, suffix: str) -> dict[str, FloatArray]:
    names = ("omega2", "frequencies_hz", "modes", "damping_ratio")
    if suffix == ".mat":
        found = _matlab(path)
        arrays = {name: np.asarray(found[name]) for name in names if name in found}
        return {name: array if name == "modes" else array.reshape(-1) for name, array in arrays.items()}
    if suffix != ".npz":
        raise MatrixFileError(f"{str(path)!r}: modes are read from .npz and .mat files, got {suffix!r}")
    with _archive(path) as archive:
        return {name: archive[name] for name in names if name in archive.files}
