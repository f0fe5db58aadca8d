"""The matrices of a sector without its high boundary, and of the annulus of all sectors."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.matrices.sectors.elimination import Circulant, Elimination, elimination
from solver.matrices.sectors.validation import Sector

Matrices = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]


@lru_cache(maxsize=16)
def full_elimination(sector: Sector) -> Elimination:
    """How the high boundary of a full sector follows the low one."""
    cyclic, M = sector.cyclic, sector.M
    if cyclic is None or cyclic.low_rows is None or cyclic.high_rows is None or M is None:
        raise ValueError("a full sector needs M and the rows of its boundaries")
    return elimination(M.size, cyclic.low_rows, cyclic.high_rows, cyclic.axis, sector.sectors or 1)


@lru_cache(maxsize=16)
def _circulants(sector: Sector) -> tuple[Circulant, Circulant, Circulant]:
    """K, C and M of a full sector, its high boundary eliminated."""
    if sector.M is None or sector.K is None:
        raise ValueError("a full sector needs M and K")
    C = np.zeros_like(sector.M.array) if sector.C is None else sector.C.array
    eliminated = full_elimination(sector)
    K, damping, M = (eliminated.of(matrix) for matrix in (sector.K.array, C, sector.M.array))
    return K, damping, M


def at_diameter(sector: Sector, n: int) -> Matrices:
    """K, C and M of a sector at nodal diameter n, from 0 to half the sectors, as they are given.

    Raises
    ------
    SettingError
        A reduced sector was not built for it.
    """
    count = sector.sectors or 1
    if sector.diameters is not None:
        return sector.diameters.at(n, count)
    K, C, M = (part.at(n, count) for part in _circulants(sector))
    return K, C, M


def annulus_matrices(sector: Sector) -> Matrices:
    """K, C and M of all sectors, sector after sector, real.

    Of a full sector they are its own blocks; of a reduced one X_jl = 1/N Σ_n X_n e^{jn(j−l)α}, with the
    complex conjugate at −n.

    Raises
    ------
    SettingError
        The model was not reduced for every nodal diameter.
    """
    count = sector.sectors or 1
    if sector.diameters is None:
        K, C, M = (_of_all_sectors(part, count) for part in _circulants(sector))
        return K, C, M
    folded = [at_diameter(sector, n) for n in range(count // 2 + 1)]
    K, C, M = (_written_out(np.array(each), count) for each in zip(*folded, strict=True))
    return K, C, M


def annulus_of(sector: Sector, matrix: NDArray[Any]) -> NDArray[Any]:
    """A further matrix of a full sector for all sectors, as `annulus_matrices` has K, C and M."""
    return _of_all_sectors(full_elimination(sector).of(matrix), sector.sectors or 1)


def _of_all_sectors(part: Circulant, count: int) -> NDArray[Any]:
    ahead = np.roll(np.eye(count), 1, axis=1)
    whole = np.kron(np.eye(count), part.own) + np.kron(ahead, part.next) + np.kron(ahead.T, part.last)
    return np.asarray(whole)


def _written_out(folded: NDArray[Any], count: int) -> NDArray[np.float64]:
    """The real matrix of all sectors of Hermitian ones (N/2 + 1, n, n) of the nodal diameters."""
    offsets = np.fft.irfft(folded, n=count, axis=0)  # the block of sectors j and j − offset
    j, n = np.arange(count), folded.shape[1]
    blocks = offsets[(j[:, None] - j[None, :]) % count]
    return np.ascontiguousarray(blocks.transpose(0, 2, 1, 3).reshape(count * n, count * n))
