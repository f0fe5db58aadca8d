"""The matrices of a sector without its high boundary, and of all sectors, also where these are mistuned."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Real
from solver.errors import SettingError
from solver.matrices.sectors.elimination import Circulant, Elimination, elimination
from solver.matrices.sectors.sector_parts import WHOLE

if TYPE_CHECKING:
    from solver.scene.matrices_structure import MatricesStructure

Matrices = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]


@lru_cache(maxsize=16)
def full_elimination(sector: MatricesStructure) -> Elimination:
    """How the high boundary of a full sector follows the low one."""
    cyclic, M = sector.cyclic, sector.M
    if cyclic is None or cyclic.low_rows is None or cyclic.high_rows is None or M is None:
        raise ValueError("a full sector needs M and the rows of its boundaries")
    return elimination(M.size, cyclic.low_rows, cyclic.high_rows, cyclic.axis, sector.sectors or 1)


@lru_cache(maxsize=16)
def _circulants(sector: MatricesStructure) -> tuple[Circulant, Circulant, Circulant]:
    """K, C and M of a full sector, its high boundary eliminated."""
    eliminated = full_elimination(sector)
    K, C, M = (eliminated.of(matrix) for matrix in _given(sector))
    return K, C, M


def _given(sector: MatricesStructure) -> tuple[Real, Real, Real]:
    """K, C and M as they stand in the scene; no damping is 0."""
    if sector.M is None or sector.K is None:
        raise ValueError("a structure given by its matrices needs M and K")
    return (
        sector.K.array,
        np.zeros_like(sector.M.array) if sector.C is None else sector.C.array,
        sector.M.array,
    )


def at_diameter(sector: MatricesStructure, n: int) -> Matrices:
    """K, C and M of a sector at nodal diameter n, from 0 to half the sectors, as they are given.

    What has no sectors is as it is at 0.

    Raises
    ------
    SettingError
        A reduced sector was not built for it.
    """
    count = sector.sectors or 1
    if sector.diameters is not None:
        return sector.diameters.at(n, count)
    if sector.sectors is None:
        return _given(sector)
    K, C, M = (part.at(n, count) for part in _circulants(sector))
    return K, C, M


def annulus_matrices(sector: MatricesStructure) -> Matrices:
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


def annulus_of(sector: MatricesStructure, matrix: NDArray[Any]) -> NDArray[Any]:
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


def scalable(sector: MatricesStructure) -> tuple[str, ...]:
    """Names that mistuning of a sector may give."""
    if sector.diameters is not None:
        return () if sector.diameters.parts is None else sector.diameters.parts.names
    return (*WHOLE, *(sector.parts or ()))


def added_by_mistuning(
    sector: MatricesStructure, of: Sequence[str], factors: Sequence[float]
) -> tuple[Real, Real]:
    """What factors on parts of each sector add to K and M of all sectors, sector after sector.

    Parameters
    ----------
    of : names of parts, K or M.
    factors : one for each sector.

    Returns
    -------
    (ΔK, ΔM), both (sectors · n, sectors · n), symmetric.

    Raises
    ------
    SettingError
        A name of none of them.
    """
    deviations = np.array(factors) - 1.0
    own = sector.diameters.size if sector.diameters is not None else full_elimination(sector).kept.size
    names, size = scalable(sector), deviations.size * own
    K, M = np.zeros((size, size)), np.zeros((size, size))
    for name in of:
        if name not in names:
            raise SettingError("of", name, f"must be one of {', '.join(names) or 'none'}")
        target = M if name == "M" else K
        if sector.diameters is not None and sector.diameters.parts is not None:
            parts, at = sector.diameters.parts, names.index(name)
            count, n = deviations.size, parts.ahead.shape[3]
            spectrum = np.fft.fft(deviations).conj() / count  # 1/N Σ_j δ_j e^{i m j α}
            built, backward = _waves(count)
            coupled: NDArray[Any] = np.empty((count, count, n, n), np.complex128)
            for w in range(count):
                for v in range(count):
                    stack = parts.ahead if backward[w] == backward[v] else parts.back
                    block = stack[at, built[w], built[v]]
                    coupled[w, v] = spectrum[(v - w) % count] * (block.conj() if backward[w] else block)
            # Σ_wv e^{iwjα} X_wv e^{-ivlα} / N: forward over the second wave, backward over the first.
            blocks = np.fft.fft(np.fft.ifft(coupled, axis=0), axis=1)
            whole = blocks.real.transpose(0, 2, 1, 3).reshape(count * n, count * n)
            target += np.ascontiguousarray(0.5 * (whole + whole.T))
        else:
            target += _sector_by_sector(sector, name, deviations)
    return K, M


def _sector_by_sector(sector: MatricesStructure, name: str, deviations: Real) -> Real:
    """Add a part of a full sector: its high boundary is the low one of the next sector."""
    eliminated = full_elimination(sector)
    P = _matrix(sector, name)
    n, count = eliminated.kept.size, deviations.size
    both = np.hstack([eliminated.here.toarray(), eliminated.beyond.toarray()])
    block = both.T @ P @ both
    whole = np.zeros((count, n, count, n))
    for j, deviation in enumerate(deviations):
        ends = (j, (j + 1) % count)
        for a in range(2):
            for b in range(2):
                part = block[a * n : (a + 1) * n, b * n : (b + 1) * n]
                whole[ends[a], :, ends[b], :] += deviation * part
    return whole.reshape(count * n, count * n)


def _matrix(sector: MatricesStructure, name: str) -> Real:
    if name in WHOLE:
        given = sector.K if name == "K" else sector.M
        if given is None:
            raise ValueError("a full sector needs M and K")
        return given.array
    parts = sector.parts
    if parts is None:
        raise ValueError("a sector without parts has none to be scaled")
    return parts.matrices[parts.index(name)].array


def _waves(count: int) -> tuple[list[int], list[bool]]:
    """Of waves 0 to N − 1: the nodal diameter, which all must be built, and whether it runs backward."""
    backward = [2 * w > count for w in range(count)]
    return [count - w if back else w for w, back in zip(range(count), backward, strict=True)], backward
