"""Whether friction can hold the mean loads on parts that contacts alone hold: a limit analysis.

In a periodic motion the mean forces on such a part balance. The mean of a friction force is no larger than
the mean of its limit, μ times the mean normal load, whatever the motion; where the parts press the contact
the mean normal force is an unknown of the same balance. These sets are convex: forces that balance are found
by a linear program, or there are none and the part is driven away by whatever exceeds them (the theorems of
limit analysis: D. C. Drucker, W. Prager, H. J. Greenberg, Quart. Appl. Math. 9 (1952) 381). The reverse does
not hold: a part that vibrates may creep under less.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from solver.balance.kernels.residual import contact_values
from solver.contacts.kernels.columns import N0, PRESTRESSED
from solver.contacts.kernels.system import Receptance, System, receptance_by_value
from solver.contacts.laws.contact_parts import Slider
from solver.contacts.pieces.line import values_at
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.linear.kernels.receptance import receptance

if TYPE_CHECKING:
    from solver.balance.balance import Balance

SIDES = 64  # of the polygon round a circular limit, 0.1 % larger
_INSTANTS = 720  # of a period, for the mean of a load that opens the contact
_LEFT = 1e-7  # of the forces: a mean force that is left as rounding


def friction_can_hold(balance: Balance, reference: System, linear: Receptance, p: float) -> bool:
    """Return whether mean forces that contacts can carry balance the mean loads on loose parts at λ = p.

    Parameters
    ----------
    reference, linear : the balance's system by reference, and its receptance, which is filled.
    """
    system = balance.system
    if not len(system.loose):
        return True
    receptance(reference, p, linear)
    stuck = receptance_by_value(linear).u_linear[0, 0].real  # on the contacts' stiffnesses `shift`
    table, loads, _, _ = contact_values(reference, p, 0.0)
    elastic, applied = system.shift * stuck, system.loose @ (system.shift * stuck)
    if not np.any(np.abs(applied) > _LEFT * (np.abs(system.loose) @ np.abs(elastic))):
        return True
    rows, bounds = _limits(balance, table, loads)
    size = float(np.abs(elastic).max())
    if np.all(rows @ elastic <= bounds + _LEFT * size):
        return True
    # Loaded here: few scenes have a part under a mean load that elastic contacts would not hold.
    from scipy.optimize import linprog

    parts, count = system.loose.shape
    scale = np.abs(system.loose).sum(axis=1)
    forces, off = system.loose / scale[:, None], -np.ones((parts, 1))
    given = applied / scale / size
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.block([[forces, off], [-forces, off], [rows, np.zeros((len(rows), 1))]]),
        b_ub=np.concatenate([given, -given, bounds / size]),
        bounds=[*[(None, None)] * count, (0.0, None)],
    )
    return found.status != 0 or bool(found.x[-1] <= _LEFT)


def may_stick(balance: Balance, reference: System, linear: Receptance, stuck: Real, p: float) -> bool:
    """Return whether residual friction forces let every contact stick and stay closed at λ = p.

    What sticks answers as springs, and a slip long ago leaves forces that do not vary: if any such keep all
    contacts within their limits at every instant the motion repeats (shakedown, E. Melan, Sitzungsber. Akad.
    Wiss. Wien 145 (1936) 195). The force of a contact is judged at `_INSTANTS` of a period.

    Parameters
    ----------
    linear : receptance of all ports; stuck : (n_unknowns,) response of stuck contacts [m].
    """
    system = balance.system
    if system.ks[0] != 0:
        return False
    from scipy.optimize import linprog

    table, loads, _, _ = contact_values(reference, p, 0.0)
    stiffness = table[system.owner, system.held[:, 0]]
    tau = np.asarray(2.0 * math.pi / _INSTANTS * np.arange(_INSTANTS), np.float64)
    basis = fourier.from_full(fourier.basis(tau, int(system.ks[-1])), system.ks)
    forces = stiffness[:, None] * (stuck.reshape(stiffness.size, -1) @ basis.T)
    rows, bounds = _limits(balance, table, loads, least=True)
    A, one = linear.A[0, 0].real, np.eye(stiffness.size)
    left = stiffness[:, None] * np.linalg.solve(one + A * (stiffness - system.shift), A) - one
    size = float(np.abs(forces).max())
    found = linprog(
        np.zeros(int(np.count_nonzero(system.rubs))),
        A_ub=rows @ left[:, system.rubs != 0], b_ub=(bounds - (rows @ forces).max(axis=1)) / size,
        bounds=(None, None),
    )  # fmt: skip
    return bool(found.status == 0)


def _limits(balance: Balance, table: Real, loads: Real, *, least: bool = False) -> tuple[Real, Real]:
    """Return rows and bounds of what the mean forces of the ports F (nc,) obey, rows · F <= bounds [N].

    With `least`, what they obey at every instant.
    """
    of_load = _least if least else _mean_of_open
    system = balance.system
    rows, bounds = [np.zeros((0, system.owner.size))], [np.zeros(0)]
    for e, contact in enumerate(balance.scene.contacts):
        slider = contact.with_numbers(table[e]).friction
        if slider is None:
            continue  # what else it is, its force has no limit
        first, normal = int(system.first_port[e]), contact.normal_port
        sides = _sides(slider)
        row = np.zeros((len(sides), system.owner.size))
        row[:, [first + port for port in slider.ports]] = sides
        if normal is None:
            bound = slider.limit(of_load(loads[e]))
        else:  # μ N with N the normal force and what of it is in equilibrium at rest, N >= 0
            row[:, first + normal] = -slider.limit(1.0)
            rest = max(float(table[e, N0]), 0.0) if table[e, PRESTRESSED] > 0.0 else 0.0
            bound = slider.limit(rest)
            pressed = np.zeros((1, system.owner.size))
            pressed[0, first + normal] = -1.0
            rows.append(pressed)
            bounds.append(np.array([rest]))
        rows.append(row)
        bounds.append(np.full(len(sides), bound))
    return np.concatenate(rows), np.concatenate(bounds)


def _sides(slider: Slider) -> Real:
    """Return the directions (sides, directions it slides in) in which friction is limited."""
    count = len(slider.ports)
    if count == 1 or slider.limits_apart:
        return np.concatenate([np.eye(count), -np.eye(count)])
    angles = 2.0 * math.pi / SIDES * np.arange(SIDES)
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _mean_of_open(load: Real) -> float:
    """Return the mean of max(N, 0) of a load with these coefficients [N]."""
    return float(_open(load).mean())


def _least(load: Real) -> float:
    """Return the least max(N, 0) of a load with these coefficients [N]."""
    return float(_open(load).min())


def _open(load: Real) -> Real:
    tau = np.asarray(2.0 * math.pi / _INSTANTS * (np.arange(_INSTANTS) + 0.5), np.float64)
    return np.maximum(values_at(load, tau), 0.0)
