"""Matrices and modes from files of mathematics and of finite-element programs; chosen by the suffix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_array, issparse

from solver.matrices.readers import registry
from solver.matrices.readers.reader import MatrixFileError as MatrixFileError
from solver.matrices.readers.reader import Reader
from solver.matrices.readers.triplets import MOST_ROWS, Labelled
from solver.matrices.values import Modes


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
    found = _read(path, lambda reader: _matrix(reader, path, key))
    if isinstance(found, Labelled):
        return Labelled(
            matrix=_checked(found.matrix, path), labels=found.labels, held=found.held, sized=found.sized
        )
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
    names: list[str] = _read(path, lambda reader: [] if reader.names is None else reader.names(path))
    return names


def read_modes(path: Path) -> Modes:
    """Read modes from a file (.npz, .mat) with `modes`, `omega2` or `frequencies_hz`, maybe `damping_ratio`.

    Raises
    ------
    MatrixFileError
        No such file, a damaged one, or one without these arrays.
    """
    arrays = _read(path, lambda reader: _modes_arrays(reader, path))
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


def _read(path: Path, read: Callable[[Reader], Any]) -> Any:
    """Read with the reader of the file, every failure as a MatrixFileError that names the file."""
    suffix = path.suffix.lower()
    try:
        return read(registry.reader_of(path))
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


def _matrix(reader: Reader, path: Path, key: str) -> Any:
    if reader.matrix is None:
        raise TypeError(f"{reader.name} holds no matrices")
    return reader.matrix(path, key)


def _modes_arrays(reader: Reader, path: Path) -> dict[str, Any]:
    if reader.modes is None:
        known, suffix = " and ".join(registry.modes_suffixes()), path.suffix.lower()
        raise MatrixFileError(f"{str(path)!r}: modes are read from {known} files, got {suffix!r}")
    return reader.modes(path)
