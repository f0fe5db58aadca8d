"""Floquet multipliers of proved orbits: the monodromy of the exact events, in balls.

Between events a small difference δw grows by e^{A t}; where a contact changes its state at h w = 0 by
I + (A⁺ − A⁻) w h / (h A⁻ w), since another motion changes it a little sooner or later (Leine and Nijmeijer,
Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7).
"""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np
from flint import arb, arb_mat

from stickslip.lab.proofs.checker import OPEN, Orbit, System

SQUARINGS = 20  # of the monodromy, for the bounds of its spectral radius
ROUNDED = 1e-9  # what bounds are wider by, since they are written in ten digits
SHOWN = 4  # estimates of multipliers that are kept


def of_proof(raw: dict[str, Any]) -> dict[str, Any]:
    """Return what the multipliers of a certificate's orbit are; of a peak's, those of the highest orbit.

    `largest` is between two bounds that are proved, as far as the orbit is. `neutral` names contacts that
    stick all the time: what they are left with is history, and to each belongs a multiplier of 1 exactly,
    which is not among the others.
    """
    at = raw["proof"]
    while "three" in at:
        at = at["three"][1]
    matrix, held = monodromy(raw, at)
    low, high = radius(matrix)
    middle = np.array([float(one.mid()) for one in matrix.entries()]).reshape(matrix.nrows(), -1)
    every = sorted(np.linalg.eigvals(middle), key=lambda one: -abs(one))[:SHOWN]
    return {
        "largest": [(one * (1 + way * ROUNDED)).str(10, radius=False) for one, way in ((low, -1), (high, 1))],
        "estimates": [[round(float(part), 9) for part in (one.real, one.imag)] for one in every],
        "neutral": held,
    }


def monodromy(raw: dict[str, Any], at: dict[str, Any]) -> tuple[Any, list[str]]:
    """Return what a period makes of small differences, and the names of contacts that stick all the time.

    Rows and columns: displacements, velocities, forces of the sliders that move; of a limit cycle but for the
    one that says where it begins. A slider that never moves is a spring.
    """
    system = System(raw["system"], at)
    orbit, box = Orbit(system, raw["orbit"]), [arb(one) for one in at["unknowns"]]
    w, whole = _first(orbit, box), arb_mat(system.d, system.d, 1)
    leaves = system.mode(orbit.modes[0])[0] * w
    for piece, (group, length) in enumerate(zip([*orbit.groups, []], orbit.lengths(box), strict=True)):
        if place := orbit.anew.get(piece):
            w = _column(box[place : place + system.d])
        flow = (system.mode(orbit.during[piece])[0] * length).exp()
        w, whole = flow * w, flow * whole
        for i in group:
            (before, _, rows, *_), (after, *_) = (system.mode(orbit.modes[k]) for k in (i, i + 1))
            h = rows[orbit.zeros(i)[0]]
            whole += (after - before) * w * (h * whole) * (1 / (h * before * w)[0, 0])
    n, contacts, moved = 2 * system.n, system.contacts, {j for j, *_ in orbit.events}
    held = [j for j, c in enumerate(contacts) if j not in moved and c["kt"] and orbit.modes[0][j] != OPEN]
    keep = [*range(n), *(n + j for j in sorted(moved) if contacts[j]["kt"])]
    springs = arb_mat(system.d, len(keep))
    for column, place in enumerate(keep):
        springs[place, column] = 1
    for j in held:
        for place, factor in contacts[j]["row"]:
            springs[n + j, place] += arb(contacts[j]["kt"]) * arb(factor)
    found = _part(whole * springs, keep)
    if system.period is None:
        pinned = keep.index(raw["orbit"]["pinned"][0])
        found -= _part(leaves, keep) * _part(found, [pinned]) * (1 / leaves[pinned, 0])
        rest = [k for k in range(len(keep)) if k != pinned]
        found = _part(_part(found, rest).transpose(), rest).transpose()
    return found, [contacts[j]["name"] for j in held]


def _first(orbit: Orbit, box: list[Any]) -> Any:
    system = orbit.system
    w = arb_mat(system.d, 1)
    for place, value in orbit.known.items():
        w[place, 0] = arb(value)
    for k, order in zip(range(system.one, system.d, 2), system.orders, strict=True):
        w[k, 0], w[k + 1, 0] = (order * orbit.begins).cos(), (order * orbit.begins).sin()
    for place, k, factor in orbit.set:
        w[place, 0] = factor * box[k]
    return w


def _column(entries: list[Any]) -> Any:
    return arb_mat([[one] for one in entries])


def _part(matrix: Any, rows: list[int]) -> Any:
    every = matrix.tolist()
    return arb_mat([every[k] for k in rows])


def radius(matrix: Any) -> tuple[Any, Any]:
    """Return bounds of the largest modulus ρ of the eigenvalues: |tr Aᵐ| / n ≤ ρᵐ ≤ ‖Aᵐ‖, m = 1, 2, 4, …"""
    low, high, power, m, n = arb(0), None, matrix, 1, matrix.nrows()
    for _ in range(SQUARINGS):
        rows = [sum((abs(one) for one in row), arb(0)).upper() for row in power.tolist()]
        norm, trace = reduce(arb.max, rows), abs(power.trace()).lower() / n
        above = arb(0) if norm == 0 else (norm.log() / m).exp().upper()
        high = above if high is None or above < high else high
        if trace > 0 and (below := (trace.log() / m).exp().lower()) > low:
            low = below
        power, m = power * power, 2 * m
    return low, high
