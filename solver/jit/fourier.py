"""The real Fourier basis; the sole owner of coefficient ordering.

A 2π-periodic function is kept as the vector ``[q0, c1, s1, …, cH, sH]`` with
``q(τ) = q0 + Σ c_k cos kτ + s_k sin kτ``; its complex amplitudes are ``q̂_k = c_k − i s_k``, so that
``q(τ) = q0 + Re Σ q̂_k e^{ikτ}``. A problem may keep a subset of the harmonics (the odd ones, when nothing
breaks the half-wave symmetry): the ascending array ``ks`` lists them, and 0, if there, comes first.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from solver.jit.decorators import compiled

Real: TypeAlias = NDArray[np.float64]
Complex: TypeAlias = NDArray[np.complex128]
Integer: TypeAlias = NDArray[np.int64]
Index: TypeAlias = NDArray[np.int32]  # LAPACK's pivots
Flags: TypeAlias = NDArray[np.bool_]


@compiled
def cosine_position(ks: Integer, i: int) -> int:
    """Return where the cosine coefficient (or the mean) of harmonic ``ks[i]`` stands; the sine follows it."""
    if ks[0] == 0:
        return 2 * i - 1 if i > 0 else 0
    return 2 * i


@compiled
def coefficient_count(ks: Integer) -> int:
    """Return how many real coefficients the harmonics ``ks`` have."""
    return 2 * ks.size - 1 if ks[0] == 0 else 2 * ks.size


@compiled
def magnitude(value: complex) -> float:
    """Return |value| of a number whose square is one too; `abs`, right for all, takes far longer."""
    return math.sqrt(value.real * value.real + value.imag * value.imag)


@compiled
def merged(a: Integer, b: Integer) -> Integer:
    """Return the ascending harmonics that are in `a` or in `b`."""
    out = np.empty(a.size + b.size, np.int64)
    i, j, count = 0, 0, 0
    while i < a.size or j < b.size:
        take = a[i] if j >= b.size or (i < a.size and a[i] <= b[j]) else b[j]
        if i < a.size and a[i] == take:
            i += 1
        if j < b.size and b[j] == take:
            j += 1
        out[count] = take
        count += 1
    return out[:count].copy()


@compiled
def positions(ks: Integer, inside: Integer) -> Integer:
    """Return where the coefficients of the harmonics `ks` stand among those of `inside`, a larger set."""
    out = np.empty(coefficient_count(ks), np.int64)
    at = 0
    for i in range(ks.size):
        while inside[at] < ks[i]:
            at += 1
        here, there = cosine_position(ks, i), cosine_position(inside, at)
        out[here] = there
        if ks[i] > 0:
            out[here + 1] = there + 1
    return out


def all_harmonics(n_harmonics: int) -> Integer:
    """Return the harmonics 0 … H."""
    return np.arange(n_harmonics + 1, dtype=np.int64)


def to_full(coefficients: Real, ks: Integer, n_harmonics: int) -> Real:
    """Spread coefficients of the harmonics `ks` (last axis) over all of 0 … H.

    Parameters
    ----------
    coefficients : (..., n) coefficients in the order of this module for `ks`.
    ks : ascending harmonics, all ≤ `n_harmonics`.

    Returns
    -------
    (..., 2H + 1) coefficients, zero where a harmonic is not in `ks`.
    """
    full = np.zeros((*coefficients.shape[:-1], 2 * n_harmonics + 1))
    pairs = np.stack([2 * ks - 1, 2 * ks], axis=1).reshape(-1)
    full[..., pairs[1:] if ks[0] == 0 else pairs] = coefficients
    return full


def from_full(coefficients: Real, ks: Integer) -> Real:
    """Return the coefficients (..., n) for the harmonics `ks` of full coefficients (..., 2H + 1)."""
    kept = np.zeros((*coefficients.shape[:-1], int(coefficient_count(ks))))
    for i, k in enumerate(ks):
        here = cosine_position(ks, i)
        if k == 0:
            kept[..., 0] = coefficients[..., 0]
        elif 2 * k < coefficients.shape[-1]:
            kept[..., here : here + 2] = coefficients[..., 2 * k - 1 : 2 * k + 1]
    return kept


def basis(tau: Real, n_harmonics: int) -> Real:
    """Return the basis ``[1, cos τ, sin τ, …, cos Hτ, sin Hτ]`` at each τ [rad], shape (len(τ), 2H + 1)."""
    tau = np.asarray(tau, dtype=np.float64)
    values = np.ones((tau.size, 2 * n_harmonics + 1))
    orders = np.arange(1, n_harmonics + 1)
    values[:, 1::2] = np.cos(np.outer(tau, orders))
    values[:, 2::2] = np.sin(np.outer(tau, orders))
    return values


def derivative(coefficients: Real) -> Real:
    """Return the coefficients of dq/dτ for full coefficients (..., 2H + 1)."""
    orders = np.arange(1, (coefficients.shape[-1] + 1) // 2)
    result = np.zeros_like(coefficients)
    result[..., 1::2] = orders * coefficients[..., 2::2]
    result[..., 2::2] = -orders * coefficients[..., 1::2]
    return result


def to_complex(coefficients: Real) -> Complex:
    """Return the complex amplitudes q̂_0 … q̂_H (q̂_0 the mean) of full coefficients (..., 2H + 1)."""
    amplitudes = np.zeros((*coefficients.shape[:-1], (coefficients.shape[-1] + 1) // 2), dtype=np.complex128)
    amplitudes[..., 0] = coefficients[..., 0]
    amplitudes[..., 1:] = coefficients[..., 1::2] - 1j * coefficients[..., 2::2]
    return amplitudes


def to_real(amplitudes: Complex) -> Real:
    """Return the full real coefficients (..., 2H + 1) of complex amplitudes q̂_0 … q̂_H."""
    coefficients = np.zeros((*amplitudes.shape[:-1], 2 * amplitudes.shape[-1] - 1))
    coefficients[..., 0] = amplitudes[..., 0].real
    coefficients[..., 1::2] = amplitudes[..., 1:].real
    coefficients[..., 2::2] = -amplitudes[..., 1:].imag
    return coefficients
