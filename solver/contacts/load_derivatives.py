"""Derivatives of the given normal loads by parameters, from those of the rows of the contact table.

The coefficients of a load are N0, N_k cos(phase_k), −N_k sin(phase_k); N1 = N1_ratio·N0 where it is tied.
"""

from __future__ import annotations

import numpy as np

from solver.contacts.kernels.columns import COLUMNS, N0, N1, PHASE, RATIO
from solver.jit.fourier import Flags, Real


def load_slopes(rows: Real, slope: Real, column: int) -> Real:
    """Return the derivatives of the loads, (nc, 1 + 2 K), by a parameter that changes a column of the table.

    A path of N1 unties it from N0, one of N1_ratio ties it: what N1 follows by is filled into `slope`.

    Parameters
    ----------
    rows, slope : (nc, ·) the contact table and its derivative by the parameter.
    """
    if column == N0:
        slope[:, N1] = np.nan_to_num(rows[:, RATIO]) * slope[:, N0]
    elif column == RATIO:
        slope[:, N1] = rows[:, N0] * slope[:, RATIO]
    found = [slope[:, N0]]
    for size, phase in _waves(rows):
        cosine, sine = np.cos(rows[:, phase]), np.sin(rows[:, phase])
        found.append(slope[:, size] * cosine - rows[:, size] * sine * slope[:, phase])
        found.append(-slope[:, size] * sine - rows[:, size] * cosine * slope[:, phase])
    return np.stack(found, axis=1)


def _waves(rows: Real) -> list[tuple[int, int]]:
    """Return the columns of amplitude and phase of every harmonic of the loads."""
    return [(N1, PHASE), *((column, column + 1) for column in range(COLUMNS, rows.shape[1], 2))]


def contradicting(rows: Real, slopes: Real) -> Flags:
    """Return, (nc,), where parameters of one load contradict each other.

    N1_ratio ties N1 to N0 and N1 unties it: what both, or N0 beside one that changes this, mean together is
    not one function of the parameters.
    """
    tied = ~np.isnan(rows[:, RATIO])
    by_mean, by_ratio = (np.any(slopes[:, :, column] != 0.0, axis=0) for column in (N0, RATIO))
    by_amplitude = np.any((slopes[:, :, N1] != 0.0) & (slopes[:, :, [N0, RATIO]] == 0.0).all(axis=2), axis=0)
    clash = (by_ratio & by_amplitude) | (by_mean & by_amplitude & tied) | (by_mean & by_ratio & ~tied)
    return np.asarray(clash)


def second_loads(rows: Real, slopes: Real) -> Real:
    """Return ∂²N/∂p_i∂p_j, (n_paths, n_paths, nc, 1 + 2 K), from the slopes (n_paths, nc, ·) of the rows."""

    def pair(one: int, other: int) -> Real:
        product = np.einsum("ic,jc->ijc", slopes[..., one], slopes[..., other])
        return np.asarray(product + product.transpose(1, 0, 2))

    tied = pair(N0, RATIO)
    found = [np.zeros(tied.shape)]
    for size, phase in _waves(rows):
        cosine, sine = np.cos(rows[:, phase]), np.sin(rows[:, phase])
        turned = pair(size, phase)
        along = (tied if size == N1 else 0.0) - rows[:, size] * 0.5 * pair(phase, phase)
        found += [along * cosine - turned * sine, -along * sine - turned * cosine]
    return np.stack(found, axis=-1)
