"""Modes of a tuned disk at every nodal diameter, and a large disk in those near its band."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from solver.arrays import Complex, Integer, Real
from stickslip.lab.worst_mistuning.linear_disk import TWO_PI, LinearDisk

MOST_COORDINATES = 200  # of a disk whose every coordinate is solved for in a search


@dataclass(frozen=True, slots=True, kw_only=True)
class TunedModes:
    """Undamped modes of a tuned disk at every nodal diameter, mass-normalised."""

    omega: Annotated[Real, "Natural frequencies [rad/s], (N, n)."]
    shapes: Annotated[Complex, "Over all coordinates, (N, m, n)."] = field(repr=False)


def tuned_modes(disk: LinearDisk) -> TunedModes:
    """Return the modes x_j = φ e^{2πi n j/N} of every nodal diameter n of a disk in all its coordinates."""
    N, m = disk.sectors, len(disk.K)
    size = m // N
    turns = np.exp(TWO_PI * 1j * np.outer(np.arange(N), np.arange(N)) / N)
    blocks = [matrix[:size].reshape(size, N, size) for matrix in (disk.K, disk.M)]
    omega, shapes = np.empty((N, size)), np.empty((N, m, size), np.complex128)
    for n in range(N):
        K, M = (np.einsum("ajb,j->ab", block, turns[n]) for block in blocks)
        values, phi = eigh(0.5 * (K + K.conj().T), 0.5 * (M + M.conj().T))
        omega[n] = np.sqrt(np.maximum(values, 0.0)) / disk.harmonic
        shapes[n] = (turns[n][:, None, None] * phi).reshape(m, size) / math.sqrt(N)
    return TunedModes(omega=omega, shapes=shapes)


def reduced(disk: LinearDisk, modes: TunedModes, most: int = MOST_COORDINATES) -> LinearDisk:
    """Return a large disk in the tuned modes nearest to its band; a small one as it is.

    As in M.-T. Yang, J. H. Griffin, J. Eng. Gas Turbines Power 123 (2001) 893.
    """
    if len(disk.K) <= most:
        return disk
    kept = max(most // disk.sectors, 1)
    middle = math.sqrt(disk.band[0] * disk.band[1])
    nearest: Integer = np.argsort(np.abs(modes.omega - middle), axis=1)[:, :kept]
    T: NDArray[Any] = np.concatenate([modes.shapes[n][:, nearest[n]] for n in range(disk.sectors)], axis=1)
    K, C, M = (T.conj().T @ each @ T for each in (disk.K, disk.C, disk.M))
    return replace(
        disk, K=K, C=C, M=M, rows=disk.rows @ T, force=T.conj().T @ disk.force, observed=disk.observed @ T
    )
