"""Matrices and modes from files of mathematics and of finite-element programs; chosen by the suffix."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.sparse import coo_array, issparse

from solver.matrices.readers.abaqus import is_matrix_market, read_abaqus
from solver.matrices.readers.calculix import CALCULIX, read_calculix
from solver.matrices.readers.dmig import DMIG, read_dmig
from solver.matrices.readers.harwell_boeing import read_harwell_boeing
from solver.matrices.readers.matrix_market import read_matrix_market
from solver.matrices.readers.output4 import read_output4
from solver.matrices.readers.triplets import MOST_ROWS, Labelled
from solver.matrices.values import Modes

FloatArray = NDArray[np.float64]
HARWELL_BOEING = (
    ".matrix",  # what Ansys calls them (HBMAT)
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
SUFFIXES = (".npz", ".npy", ".mat", ".mtx", ".op4", *DMIG, *CALCULIX, *HARWELL_BOEING)
# What names of matrices begin with in Nastran and elsewhere, for each of ours.
_NAMES = {"M": ("M",), "K": ("K", "STIF"), "C": ("C", "B", "DAMP")}


class MatrixFileError(ValueError):
    """A file that holds no usable matrix; the message names the file and where it is damaged."""


def read_matrix(path: Path, key: str) -> coo_array:
    """Read the matrix `key` (``M``, ``C`` or ``K``) from a file.

    A file of several arrays (.npz, .mat, .op4, DMIG) must hold one named `key`, or one alone; Nastran's names
    (KAAX, MAAX, BAAX) count too.

    Raises
    ------
    MatrixFileError
        No such file, an unknown suffix, a damaged file, or no real matrix in it.
    """
    return read_labelled(path, key).matrix


def read_labelled(path: Path, key: str) -> Labelled:
    """Read the matrix `key` as `read_matrix` does, with the labels of its rows if the file has them.

    Raises
    ------
    MatrixFileError
        As for `read_matrix`.
    """
    found = _read(path, lambda suffix: _matrix(path, suffix, key))
    if isinstance(found, Labelled):
        return Labelled(matrix=_checked(found.matrix, path), labels=found.labels, held=found.held)
    return Labelled(matrix=_checked(found if issparse(found) else np.asarray(found), path))


def _checked(array: Any, path: Path) -> coo_array:
    """A square matrix of finite real numbers."""
    if array.dtype.kind == "c" and not np.any(np.imag(array.data if issparse(array) else array)):
        array = array.real
    if array.dtype.kind not in "fiu":
        raise MatrixFileError(f"{str(path)!r} must hold real numbers, got {array.dtype}")
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not array.shape[0]:
        shape = " x ".join(map(str, array.shape))
        raise MatrixFileError(f"{str(path)!r} must hold a square matrix, got {shape or 'a number'}")
    if array.shape[0] > MOST_ROWS:
        raise MatrixFileError(f"{str(path)!r} may hold {MOST_ROWS} rows, got {array.shape[0]}")
    matrix = coo_array(array, dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(matrix.data))
    if bad.size:
        at = bad[0]
        where = f"row {matrix.row[at]}, column {matrix.col[at]} (zero-based)"
        raise MatrixFileError(f"{str(path)!r} must hold finite numbers, got {matrix.data[at]} in {where}")
    return matrix


def array_names(path: Path) -> list[str]:
    """Names of the arrays in a file that may hold several; none for a file of one matrix.

    Matrices of Nastran are named M, K and C if their own names say so.

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
    if suffix == ".op4" or suffix in DMIG:
        names = list(read_output4(path) if suffix == ".op4" else read_dmig(path))
        roles = {name: key for key in _NAMES for name in _alike(names, key)}
        return [roles.get(name, name) for name in names]
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
    except Exception as error:
        reason = str(error).strip().rstrip(".") or type(error).__name__
        raise MatrixFileError(f"{str(path)!r} is damaged or not a {suffix} file: {reason[:300]}") from error


def _matrix(path: Path, suffix: str, key: str) -> Any:
    if suffix in HARWELL_BOEING:
        return read_harwell_boeing(path)
    if suffix == ".mtx":
        return _text_matrix(path)
    if suffix in CALCULIX:
        return read_calculix(path)
    if suffix == ".op4":
        return _of_nastran(read_output4(path), key, path)
    if suffix in DMIG:
        return _of_nastran(read_dmig(path), key, path)
    if suffix == ".npy":
        return np.load(path, allow_pickle=False)
    if suffix == ".mat":
        return _chosen(_matlab(path), key, path)
    with _archive(path) as arrays:
        if {"format", "shape", "data"} <= set(arrays.files):
            return _sparse(arrays)
        return _chosen({name: arrays[name] for name in _wanted(arrays.files, key, path)}, key, path)


def _text_matrix(path: Path) -> Any:
    """MatrixMarket, which begins with %%, or a matrix of Abaqus."""
    with path.open("rb") as file:
        start = file.readline(200)
    if not is_matrix_market(start):
        return read_abaqus(path)
    return read_matrix_market(path)


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


def _alike(names: list[str], key: str) -> list[str]:
    """The names that begin as those of the matrix `key` do (K4…: structural damping); none for other keys."""
    starts = _NAMES.get(key, ())
    return [name for name in names if name.upper().startswith(starts) and not name.upper().startswith("K4")]


def _chosen(arrays: Mapping[str, Any], key: str, path: Path) -> Any:
    return arrays[_wanted(list(arrays), key, path)[0]]


def _of_nastran(arrays: Mapping[str, Any], key: str, path: Path) -> Any:
    """A matrix by Nastran's names, of the square ones: loads and recovery matrices stand beside them."""
    shapes = {name: getattr(found, "matrix", found).shape for name, found in arrays.items()}
    square = {name: found for name, found in arrays.items() if shapes[name][0] == shapes[name][1]}
    arrays = square or arrays
    alike = _alike(list(arrays), key)
    return arrays[alike[0]] if len(alike) == 1 else _chosen(arrays, key, path)


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
