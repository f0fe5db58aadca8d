"""Every mean that a response under given loads may have, by what stuck contacts may hold.

The force f of a contact that sticks all the time may change by any constant Δf that keeps |f + Δf| ≤ μN at
every instant, and with it the mean moves by −observe K⁻¹ Lᵀ Δf (`solver.response.history_dependence`): each
force has a room down to min(μN + f) and up to min(μN − f) over the period, and all of them may be used up
together. Two directions under one limit are bounded by the rectangle around what each instant leaves, so the
range may be somewhat wide there; one direction reaches its ends.

The derivatives of the upper end follow from those of f and μN at the instant where the room is least.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.jit.fourier import Complex, Real
from solver.linear.assembly import linear_model
from solver.linear.condensation import CANCELLED_STIFFNESS
from solver.linear.model import LinearModel, LinearModelDerivative
from solver.matrices.normal_modes import least_stiffness
from solver.response.held_contacts import HeldContact, instants_of
from solver.response.solution import Solution


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """How far the force of what sticks may move by a constant along one direction."""

    held: HeldContact
    port: Annotated[int, "Among those of all contacts."]
    down: Annotated[float, "How far it may fall [N]."]
    up: Annotated[float, "How far it may rise [N]."]
    down_at: Annotated[float, "The instant that leaves no more [rad]."]
    up_at: Annotated[float, "Likewise [rad]."]
    mean: Annotated[float, "Of the force as it is [N]."]


def rooms_of(sticking: Sequence[HeldContact], tau: Real) -> Iterator[Room]:
    """Yield the room of every direction of what sticks, by its forces at the instants `tau` (n,)."""
    for held in sticking:
        limit, forces = held.limit(tau), held.forces(tau)
        for port, force in zip(held.ports, forces, strict=False):
            down, up = limit + force, limit - force
            first, second = int(np.argmin(down)), int(np.argmin(up))
            yield Room(
                held=held, port=port, down=max(float(down[first]), 0.0), up=max(float(up[second]), 0.0),
                down_at=float(tau[first]), up_at=float(tau[second]), mean=float(force.mean()),
            )  # fmt: skip


def mean_range(solution: Solution, sticking: tuple[HeldContact, ...]) -> tuple[float, float]:
    """Return the bounds of the mean over all residual forces [m]; NaN where none is known."""
    gains = mean_gains(linear_model(solution.scene))
    if gains is None:
        return math.nan, math.nan
    low = high = solution.mean
    for room in rooms_of(sticking, instants_of(solution.observed.size)):
        rises, falls = shares(gains[:, room.port])
        # The mean moves by −gain Δf.
        low -= rises * room.up + falls * room.down
        high += rises * room.down + falls * room.up
    return low, high


def shares(gains: Real) -> tuple[float, float]:
    """Return what gains of all sectors (sectors,) of either sign come to: the positive, the negative ones."""
    return float(np.maximum(gains, 0.0).sum()), float(np.maximum(-gains, 0.0).sum())


def of_diameters(model: LinearModel) -> Iterator[tuple[int, Complex, Complex, Complex]]:
    """Yield K, C and L at rest at every nodal diameter, with its number."""
    for n in range(model.sectors):
        here = np.array([n])
        K, C, _ = model.at(here, np.zeros(1, np.bool_))
        yield n, K[0], C[0], model.ports_at(here)[0]


def mean_gains(model: LinearModel) -> Real | None:
    """Return observe K⁻¹ Lᵀ of contacts of each sector [m/N], (sectors, n_ports); None if it is singular or
    not known at every nodal diameter.

    What rounding leaves of the stiffness against a rigid-body motion is none.
    """
    rows = []
    if not model.every_diameter:
        return None
    for _, K, _, L in of_diameters(model):
        if least_stiffness(K) <= CANCELLED_STIFFNESS:
            return None
        rows.append(model.observe @ np.linalg.solve(K, L.conj().T))
    return _by_sector(rows)


def mean_gain_slopes(model: LinearModel, by: Mapping[int, LinearModelDerivative]) -> dict[int, Real]:
    """Return the derivatives of gains that are known, by paths of the structure with their numbers."""
    found: dict[int, list[Complex]] = {i: [] for i in by}
    for n, K, _, L in of_diameters(model):
        here, still = np.array([n]), np.zeros(1, np.bool_)
        pushed, seen = np.linalg.solve(K, L.conj().T), np.linalg.solve(K.T, model.observe)
        for i, each in by.items():
            row = -seen @ each.at(here, still)[0][0] @ pushed
            if each.contact_here is not None and each.contact_next is not None:
                moved = each.contact_here + each.contact_next * model.turns(here)[0]
                row = row + seen @ moved.conj().T
            found[i].append(row)
    return {i: _by_sector(rows) for i, rows in found.items()}


def _by_sector(rows: list[Complex]) -> Real:
    """Return numbers of each nodal diameter as those of each sector."""
    return np.asarray(np.fft.fft(np.array(rows), axis=0).real / len(rows))
