"""Matrices and modes in files of arrays: NumPy and SciPy (``.npz``, ``.npy``), MATLAB (``.mat``)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.sparse import bsr_array, coo_array, csc_array, csr_array, dia_array

from solver.matrices.readers.reader_registry import MatrixFileError, Reader, chosen, wanted
from solver.matrices.values import MODES_KEYS


@contextmanager
def _archive(path: Path) -> Iterator[Any]:
    """Open a .npz file; what is not one is named by its first bytes."""
    with path.open("rb") as file:
        start = file.read(4)
        if not _is_archive(start):
            raise MatrixFileError(
                f"{str(path)!r} is not a .npz file: it begins with {start!r} at byte 0, not PK"
            )
        file.seek(0)
        with np.load(file, allow_pickle=False) as arrays:
            yield arrays


def _is_archive(start: bytes) -> bool:
    return start.startswith(b"PK")


def _archive_names(path: Path) -> list[str]:
    with _archive(path) as arrays:
        return list(arrays.files)


def _archive_matrix(path: Path, key: str) -> Any:
    with _archive(path) as arrays:
        if {"format", "shape", "data"} <= set(arrays.files):
            # A matrix that scipy.sparse.save_npz wrote, its indices checked: SciPy trusts the file.
            kind, shape, data = (
                arrays["format"].item(),
                tuple(int(n) for n in arrays["shape"]),
                arrays["data"],
            )
            kind = kind.decode("ascii") if isinstance(kind, bytes) else str(kind)
            if kind == "coo":
                places = (
                    arrays["coords"] if "coords" in arrays.files else np.array([arrays["row"], arrays["col"]])
                )
                return coo_array((data, tuple(places)), shape=shape)
            if kind == "dia":
                return dia_array((data, arrays["offsets"]), shape=shape).tocoo()
            made = {"csr": csr_array, "csc": csc_array, "bsr": bsr_array}.get(kind)
            if made is None:
                raise MatrixFileError(
                    f"a sparse matrix of the format {kind!r} cannot be read: save it as csr"
                )
            matrix = made((data, arrays["indices"], arrays["indptr"]), shape=shape)
            matrix.check_format(full_check=True)
            return matrix.tocoo()
        return arrays[wanted(arrays.files, key, path)]


def _archive_modes(path: Path) -> dict[str, Any]:
    with _archive(path) as archive:
        return {name: archive[name] for name in MODES_KEYS if name in archive.files}


def _matlab(path: Path) -> dict[str, Any]:
    with path.open("rb") as file:
        start = file.read(128)
    if b"MATLAB 7.3" in start:
        raise MatrixFileError(f"{str(path)!r} is a MATLAB 7.3 file: save it with -v7")
    return {name: value for name, value in loadmat(path, spmatrix=False).items() if not name.startswith("__")}


def _matlab_modes(path: Path) -> dict[str, Any]:
    found = _matlab(path)
    arrays = {name: np.asarray(found[name]) for name in MODES_KEYS if name in found}
    return {name: array if name == "modes" else array.reshape(-1) for name, array in arrays.items()}


READERS = (
    Reader(
        name="NumPy archive",
        suffixes=(".npz",),
        word="npz",
        media=("application/x-npz",),
        recognises=_is_archive,
        help="NumPy and SciPy: a sparse matrix (`scipy.sparse.save_npz`), one array, or arrays named `M`, "
        "`K`, `C` (the same file may stand at each key); modes too.",
        matrix=_archive_matrix,
        names=_archive_names,
        modes=_archive_modes,
    ),
    Reader(
        name="NumPy array",
        suffixes=(".npy",),
        word="npy",
        media=("application/x-npy",),
        recognises=lambda start: start.startswith(b"\x93NUMPY"),
        help="NumPy: one array.",
        matrix=lambda path, _key: np.load(path, allow_pickle=False),
    ),
    Reader(
        name="MATLAB",
        suffixes=(".mat",),
        word="mat",
        media=("application/x-matlab-data",),
        recognises=lambda start: start.startswith(b"MATLAB "),
        help="MATLAB up to version 7 (`save -v7`): one matrix, or `M`, `K`, `C`; modes too.",
        matrix=lambda path, key: chosen(_matlab(path), key, path),
        names=lambda path: list(_matlab(path)),
        modes=_matlab_modes,
    ),
)
