"""Matrices, modes and names of rows from files, by their suffix; and which of several files holds what."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_array, issparse

from solver.matrices.readers import reader_registry as registry
from solver.matrices.readers.numbers_in_text import Label
from solver.matrices.readers.reader_registry import MOST_ROWS, ROLES, Labelled, Reader
from solver.matrices.readers.reader_registry import MatrixFileError as MatrixFileError
from solver.matrices.values import NormalModes

_LABELS_OF_ONES_OWN = ".dof"


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


def read_modes(path: Path) -> NormalModes:
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
        return NormalModes.of(arrays)
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
        known, suffix = " and ".join(registry.suffixes("modes")), path.suffix.lower()
        raise MatrixFileError(f"{str(path)!r}: modes are read from {known} files, got {suffix!r}")
    return reader.modes(path)


def read_labels(path: Path) -> tuple[Label, ...]:
    """Read the labels of all rows from a file that names them; one of an unknown ending as `.dof`.

    Raises
    ------
    FormatError
        With the line that holds no label, or one of another row again.
    OSError
        The file cannot be read.
    """
    suffix = path.suffix.lower()
    suffix = suffix if suffix in registry.suffixes("labels") else _LABELS_OF_ONES_OWN
    read = next(one.labels for one in registry.readers() if one.labels is not None and suffix in one.suffixes)
    return read(path)


def labels_beside(path: Path) -> Path | None:
    """The file of labels that stands beside a matrix under the same name, if there is one."""
    for suffix in registry.suffixes("labels"):
        for name in (path.with_suffix(suffix), path.with_suffix(suffix.upper())):
            if name.is_file():
                return name
    return None


MODES, MAPPING = "modes", "mapping"
_WORDS = {
    "M": ("M", "MASS", "MASSE"),
    "K": ("K", "STIF", "STIFF", "STIFFNESS"),
    "C": ("C", "DAMP", "DAMPING", "DMPV"),
}


def sorted_files(files: Sequence[Path], mapping: Path | None = None) -> dict[str, Path]:
    """The file of each of ``M``, ``K``, ``C`` or of ``modes``, and ``mapping`` if one names the rows.

    Several files are told by a word of their names or their suffix, else they come in the order M, K, C.

    Parameters
    ----------
    mapping : a file that names the rows, beside `files`.

    Raises
    ------
    MatrixFileError
        Too many files, none, or a single one without M and K.
    """
    naming = registry.suffixes("labels")
    labels = [path for path in files if path.suffix.lower() in naming]
    matrices = [path for path in files if path not in labels]
    rows = [*labels, *([] if mapping is None else [mapping])]
    if len(rows) > 1:
        raise MatrixFileError(f"one file names the rows, got {', '.join(map(str, rows))}")
    if not 0 < len(matrices) <= len(ROLES):
        raise MatrixFileError(f"M, K and maybe C are wanted, got {len(matrices)} files")
    found = _assigned(matrices) if len(matrices) > 1 else dict.fromkeys(_held_by(matrices[0]), matrices[0])
    return found if not rows else {**found, MAPPING: rows[0]}


def _assigned(files: Sequence[Path]) -> dict[str, Path]:
    """Files by their role: as the last word that tells, or the suffix; else in the order M, K, C."""
    told = [_role(path) for path in files]
    known = [role for role in told if role is not None]
    if len(set(known)) == len(files) and {"M", "K"} <= set(known):
        return dict(zip(known, files, strict=True))
    return dict(zip(ROLES, files, strict=False))


def _role(path: Path) -> str | None:
    told = registry.role_of_suffix(path.suffix.lower())
    if told is not None:
        return told
    words = [word.upper() for word in reversed(re.findall("[A-Za-z]+", path.stem))]
    roles = (role for word in words for role, known in _WORDS.items() if word in known)
    return next(roles, None)


def _held_by(path: Path) -> tuple[str, ...]:
    """What a single file holds: matrices under their names, or modes."""
    names = array_names(path)
    if {"M", "K"} <= set(names):
        return tuple(role for role in ROLES if role in names)
    if MODES in names:
        return (MODES,)
    held = ", ".join(f"`{name}`" for name in names[:20]) or "nothing with a name"
    raise MatrixFileError(
        f"{str(path)!r} alone must hold M and K, or modes; it holds {held}: give the "
        "file of the other one too, in the order M K C"
    )
