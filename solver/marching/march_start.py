"""Where a march begins: at rest, with residual tractions, or in a motion that is known at one instant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from solver.errors import SettingError
from solver.marching.kernels import march_state as kernel
from solver.marching.march_equations import MarchEquations, limit_of
from solver.wording import listing

_FRICTION = (kernel.COULOMB, kernel.ELASTIC_NORMAL, kernel.CIRCLE, kernel.CIRCLE_SECOND)
_INSIDE = 1e-13  # share of the limit that a force stays below it: from there it slips by its rates


@dataclass(frozen=True, slots=True, kw_only=True)
class MarchStart:
    """A motion at the angle 0; what is not named is 0.

    Attributes
    ----------
    displacements, velocities : mapping
        Of degrees of freedom, by their names [m], [m/s].
    tractions : mapping
        Friction forces by the names in `MarchResult.contacts` [N]; one beyond the limit there is cut to it.
    """

    displacements: Mapping[str, float] = field(default_factory=dict)
    velocities: Mapping[str, float] = field(default_factory=dict)
    tractions: Mapping[str, float] = field(default_factory=dict)


def state_at(
    equations: MarchEquations,
    start: MarchStart,
    names: tuple[str, ...],
    omega: float,
    base: tuple[kernel.Real, kernel.Real] | None = None,
) -> kernel.State:
    """Return the state of a march.

    Parameters
    ----------
    equations : of the scene, at `omega` [rad/s]; names : of the rows of the contacts.
    base : displacements and velocities (n,) of a base and of what it drives, where they are prescribed.

    Raises
    ------
    SettingError
        An unknown name, a number that is not finite, or a traction of a contact without friction.
    """
    system, index = equations.system, equations.index
    n, rows = system.A.start.size - 1, system.kt.size
    x = _vector("displacements", start.displacements, index, n)
    v = _vector("velocities", start.velocities, index, n) / omega
    for vector, given in zip((x, v), base or (), strict=False):
        vector[:] = np.where(np.isnan(given), vector, given)
    if equations.observed not in index.values():
        for vector in (x, v):
            vector[equations.observed] = sum(factor * vector[at] for at, factor in equations.seen)
    load = system.N0 + (system.waves * np.cos(system.wave_phases)).sum(axis=1)
    moving = np.isin(system.law, (kernel.ELASTIC_NORMAL, kernel.CIRCLE))
    for c in np.flatnonzero(np.isin(system.law, _FRICTION)):
        if np.isfinite(system.kn[c]):
            load[c] += system.kn[c] * kernel.normal_slip(system, x, int(c))
    for c in np.flatnonzero(system.law == kernel.CIRCLE_SECOND):
        load[c] = load[c - 1]
    closed = np.where(moving, load, limit_of(system, load)) > 0.0
    slips = np.array([kernel.slip(system, x, c) for c in range(rows)])
    closed = np.where(system.law == kernel.GAP, slips > system.gap, closed) | (
        system.law == kernel.POLYNOMIAL
    )
    closed |= system.law == kernel.HISTORY
    mode = np.where(closed, kernel.STICK, kernel.SEPARATED).astype(np.int64)
    force = _forces(system, start.tractions, names, np.maximum(load, 0.0))
    own = np.zeros((rows, max(int(np.max(system.states, initial=0)), 1)))
    return kernel.State(x, v, force, mode, own)


def _vector(key: str, given: Mapping[str, float], index: Mapping[str, int], n: int) -> kernel.Real:
    vector = np.zeros(n)
    for dof, value in given.items():
        if dof not in index:
            raise SettingError(key, dof, f"must be of degrees of freedom: {listing(tuple(index))}")
        if not math.isfinite(value):
            raise SettingError(key, value, f"must be a number, of {dof!r}")
        vector[index[dof]] = value
    return vector


def _forces(
    system: kernel.System, tractions: Mapping[str, float], names: tuple[str, ...], load: kernel.Real
) -> kernel.Real:
    """Return the friction forces of the rows, none beyond its limit."""
    force, limits = np.zeros(system.kt.size), (1.0 - _INSIDE) * limit_of(system, load)
    for name, traction in tractions.items():
        if name not in names:
            raise SettingError("tractions", name, f"must be of contacts with friction: {listing(names)}")
        at = names.index(name)
        if system.law[at] not in _FRICTION or not math.isfinite(traction):
            raise SettingError("tractions", traction, f"must be a friction force in newtons, of {name!r}")
        force[at] = float(traction)
    for c in np.flatnonzero(np.isin(system.law, _FRICTION)):
        if system.law[c] == kernel.CIRCLE_SECOND:
            continue
        both = force[c : c + (2 if system.law[c] == kernel.CIRCLE else 1)]
        size, limit = float(np.hypot.reduce(both)), float(limits[c])
        if size > limit:
            both *= limit / size
    return force
