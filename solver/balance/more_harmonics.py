"""The same balance with more harmonics, made without reducing the structure anew."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from solver.balance.balance import Balance, build, contact_rows, tables_for, with_harmonics
from solver.contacts.kernels.columns import NODES
from solver.contacts.kernels.system import DENSE, System
from solver.jit.fourier import Complex, Integer, Real
from solver.scene.scene_harmonics import MULTIPLES, among, kept_harmonics, spread


def more_harmonics(balance: Balance, top: int, *, multiples: int = MULTIPLES) -> Balance:
    """Return the same balance with the harmonics kept for `top`; one of odd harmonics stays one.

    The modes do not depend on the harmonics kept, only the tables of the event search are made anew. A cyclic
    structure is reduced again where a further harmonic meets a nodal diameter that is not there yet.
    """
    ks = further_harmonics(balance, top, multiples)
    system = _extended(balance, ks)
    if system is None:
        return _rebuilt(balance, top)
    cos_table, sin_table = tables_for(max(int(ks[-1]), 1))
    contacts = contact_rows(balance.scene, int(ks[-1]))
    # Where a law is followed from node to node an estimate has to see what lies between them too.
    contacts[:, NODES] = np.maximum(contacts[:, NODES], 2.0 * balance.system.contacts[:, NODES])
    system = system._replace(cos_table=cos_table, sin_table=sin_table, contacts=contacts)
    return replace(balance, system=system, n_harmonics=top)


def less_harmonics(balance: Balance, top: int) -> Balance:
    """Return the same balance with those of its harmonics that are kept if only `top` are asked for."""
    ks = kept_harmonics(balance.scene, (balance.parameter.path,), top, odd=False)
    return replace(with_harmonics(balance, np.intersect1d(balance.system.ks, ks)), n_harmonics=top)


def linear_part(balance: Balance, top: int) -> System:
    """Return the linear part alone with the harmonics up to `top`: a `System` for receptances, no forces."""
    system = _extended(balance, further_harmonics(balance, top))
    return _rebuilt(balance, top).system if system is None else system


def further_harmonics(balance: Balance, top: int, multiples: int = MULTIPLES) -> Integer:
    """Return the harmonics of a balance and those that are kept if `top` are asked for."""
    ks = balance.system.ks
    odd = bool(np.all(ks % 2 == 1))
    path = balance.parameter.path
    wider = kept_harmonics(balance.scene, (path,), top, odd=odd, multiples=multiples)
    return np.array(sorted({*ks.tolist(), *wider.tolist()}), np.int64)


def pad(coefficients: Real, balance: Balance, wider: Balance) -> Real:
    """Return coefficients (of one motion or of all unknowns) of `balance` filled up for `wider`."""
    kept = coefficients.reshape(-1, balance.n_coefficients)
    return spread(kept, balance.system.ks, wider.system.ks).reshape(-1)


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
    scene, system = balance.scene, balance.system
    known = among(system.ks, ks)
    if any(force.harmonic in ks[~known] for force in scene.forces):
        return None
    sectors = scene.structure.sector_count
    diameters = (ks * scene.engine_order) % sectors
    # Of the matrices themselves the mean has others than what moves.
    moving = (system.ks > 0) | (system.form != DENSE)
    structures = dict(zip(diameters[known][moving].tolist(), system.which[moving].tolist(), strict=True))
    wanted = diameters[~known].tolist()
    if not structures.keys() >= set(wanted):
        return None
    at, which = np.flatnonzero(known), np.zeros(ks.size, np.int64)
    which[known], which[~known] = system.which, [structures[diameter] for diameter in wanted]
    return system._replace(
        ks=ks, which=which,
        modal_forces=_padded_rows(system.modal_forces, at, ks.size),
        forces=_padded_rows(system.forces, at, ks.size),
        # Of none at all numpy would make reals, for which every kernel would be compiled once more.
        dforces=np.array([_padded_rows(each, at, ks.size) for each in system.dforces], np.complex128).reshape(
            (2, ks.size, -1) if system.dforces.size else (0, 0, 0)
        ),
    )  # fmt: skip


def _padded_rows(rows: Complex, at: Integer, count: int) -> Complex:
    """Return (nk, m) unit forces put at `at` of `count` rows, the rest zero; without rows they stay so."""
    if rows.shape[0] == 0:
        return rows
    padded = np.zeros((count, rows.shape[1]), np.complex128)
    padded[at] = rows
    return padded
