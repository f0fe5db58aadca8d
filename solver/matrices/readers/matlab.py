"""Matrices and modes in files of MATLAB up to version 7: ``.mat``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from solver.matrices.readers.choosing import chosen
from solver.matrices.readers.reader import MatrixFileError, Reader
from solver.matrices.values import MODES_KEYS


def _arrays(path: Path) -> dict[str, Any]:
    with path.open("rb") as file:
        start = file.read(128)
    if b"MATLAB 7.3" in start:
        raise MatrixFileError(f"{str(path)!r} is a MATLAB 7.3 file: save it with -v7")
    return {name: value for name, value in loadmat(path, spmatrix=False).items() if not name.startswith("__")}


def _matrix(path: Path, key: str) -> Any:
    return chosen(_arrays(path), key, path)


def _names(path: Path) -> list[str]:
    return list(_arrays(path))


def _modes(path: Path) -> dict[str, Any]:
    found = _arrays(path)
    arrays = {name: np.asarray(found[name]) for name in MODES_KEYS if name in found}
    return {name: array if name == "modes" else array.reshape(-1) for name, array in arrays.items()}


READERS = (
    Reader(
        name="MATLAB",
        suffixes=(".mat",),
        word="mat",
        media=("application/x-matlab-data",),
        recognises=lambda start: start.startswith(b"MATLAB "),
        help="MATLAB up to version 7 (`save -v7`): one matrix, or `M`, `K`, `C`; modes too.",
        matrix=_matrix,
        names=_names,
        modes=_modes,
    ),
)
