"""The same balance with more harmonics, made without reducing the structure anew."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from solver.balance import Balance, build
from solver.fourier import Complex, Integer, Real
from solver.kernels.system import System
from solver.kernels.trigpoly import grid_size, grid_tables
from solver.parametric import linear_model


def more_harmonics(balance: Balance, top: int) -> Balance:
    """Return the same balance with the harmonics up to `top`; one of odd harmonics stays one.

    The modes do not depend on the harmonics kept, only the tables of the event search are made anew. A cyclic
    structure is reduced again where a further harmonic meets a nodal diameter that is not there yet.
    """
    ks = further_harmonics(balance.system.ks, top)
    system = _extended(balance, ks)
    if system is None:
        return _rebuilt(balance, top)
    cos_table, sin_table = _tables(max(int(ks[-1]), 1))
    system = system._replace(cos_table=cos_table, sin_table=sin_table)
    return replace(balance, system=system, n_harmonics=top)


def linear_part(balance: Balance, top: int) -> System:
    """Return the linear part alone with the harmonics up to `top`: a `System` for receptances, no forces."""
    system = _extended(balance, further_harmonics(balance.system.ks, top))
    return _rebuilt(balance, top).system if system is None else system


def further_harmonics(ks: Integer, top: int) -> Integer:
    """Return the harmonics `ks` and those that follow in the same pattern, up to `top`."""
    step = int(ks[1] - ks[0]) if ks.size > 1 else 1 + int(ks[0])
    return np.concatenate([ks, np.arange(ks[-1] + step, top + 1, step, dtype=np.int64)])


def pad(coefficients: Real, balance: Balance, wider: Balance) -> Real:
    """Return coefficients (of one motion or of all unknowns) of `balance` filled up for `wider`."""
    kept = coefficients.reshape(-1, balance.n_coefficients)
    full = np.zeros((kept.shape[0], wider.n_coefficients))
    full[:, : kept.shape[1]] = kept
    return full.reshape(-1)


def _rebuilt(balance: Balance, top: int) -> Balance:
    """Return the balance of the same scene with the harmonics up to `top`, everything made anew."""
    frequency_hz = balance.system.omega / (2.0 * math.pi) or None
    return build(
        balance.scene,
        balance.parameter.path,
        harmonics=top,
        frequency_hz=frequency_hz,
        effects=balance.effects,
    )


def _extended(balance: Balance, ks: Integer) -> System | None:
    """Return the system with the harmonics `ks` but the old tables; None if the balance lacks what they need.

    That is a nodal diameter not met so far, or a force with one of the further harmonics.
    """
    model, system = linear_model(balance.scene), balance.system
    beyond = ks[system.ks.size :]
    if any(force.harmonic in beyond for force in model.forces):
        return None
    diameters = (ks * model.engine_order) % model.sectors
    known = {int(d): int(s) for d, s in zip(diameters, system.which, strict=False)}
    if any(int(d) not in known for d in diameters):
        return None
    return system._replace(
        ks=ks, which=np.array([known[int(d)] for d in diameters], dtype=np.int64),
        modal_forces=_padded_rows(system.modal_forces, ks.size), forces=_padded_rows(system.forces, ks.size),
    )  # fmt: skip


def _padded_rows(rows: Complex, count: int) -> Complex:
    """Return (nk, m) unit forces with zeros for further harmonics; empty ones stay empty."""
    if rows.size == 0:
        return np.zeros((0 if rows.shape[0] == 0 else count, rows.shape[1]), np.complex128)
    padded = np.zeros((count, rows.shape[1]), np.complex128)
    padded[: rows.shape[0]] = rows
    return padded


@lru_cache(maxsize=16)
def _tables(highest: int) -> tuple[Real, Real]:
    return grid_tables(grid_size(highest), highest)
