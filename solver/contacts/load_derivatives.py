"""Derivatives of the given normal loads by parameters, from those of the rows of the contact table.

The coefficients of a load are N0, N1 cos(phase), −N1 sin(phase); N1 = N1_ratio·N0 where it is tied.
"""

from __future__ import annotations

import numpy as np

from solver.contacts.kernels.columns import N0, N1, PHASE, RATIO
from solver.contacts.kernels.system import LOAD_COEFFICIENTS
from solver.jit.fourier import Flags, Real


def load_slopes(rows: Real, slope: Real, column: int) -> Real:
    """Return the derivatives of the loads, (nc, 3), by a parameter that changes a column of the table.

    A path of N1 unties it from N0, one of N1_ratio ties it: what N1 follows by is filled into `slope`.

    Parameters
    ----------
    rows, slope : (nc, COLUMNS) the contact table and its derivative by the parameter.
    """
    if column == N0:
        slope[:, N1] = np.nan_to_num(rows[:, RATIO]) * slope[:, N0]
    elif column == RATIO:
        slope[:, N1] = rows[:, N0] * slope[:, RATIO]
    load = np.empty((rows.shape[0], LOAD_COEFFICIENTS))
    cosine, sine = np.cos(rows[:, PHASE]), np.sin(rows[:, PHASE])
    load[:, 0] = slope[:, N0]
    load[:, 1] = slope[:, N1] * cosine - rows[:, N1] * sine * slope[:, PHASE]
    load[:, 2] = -slope[:, N1] * sine - rows[:, N1] * cosine * slope[:, PHASE]
    return load


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
    """Return ∂²N/∂p_i∂p_j, (n_paths, n_paths, nc, 3), from the slopes (n_paths, nc, COLUMNS) of the rows."""
    cosine, sine, size = np.cos(rows[:, PHASE]), np.sin(rows[:, PHASE]), rows[:, N1]

    def pair(one: int, other: int) -> Real:
        product = np.einsum("ic,jc->ijc", slopes[..., one], slopes[..., other])
        return np.asarray(product + product.transpose(1, 0, 2))

    amplitude, turned, twice = pair(N0, RATIO), pair(N1, PHASE), 0.5 * pair(PHASE, PHASE)
    along = amplitude - size * twice
    return np.stack(
        [np.zeros(along.shape), along * cosine - turned * sine, -along * sine - turned * cosine], axis=-1
    )
