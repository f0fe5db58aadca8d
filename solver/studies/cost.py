"""What a point of a branch costs: the parts of a Newton iteration, by sizes and by which contacts stick.

The seconds were fitted to twenty scenes of all kinds, of 1 to 972 ports, on one core of a server.
"""

from __future__ import annotations

import numpy as np

from solver.balance.balance import Balance, fewer_harmonics
from solver.contacts.kernels.system import DENSE, by_reference, new_receptance, receptance_by_value
from solver.jit.fourier import Flags, Real
from solver.linear.kernels.receptance import PAIRS_UP_TO, receptance

_ITERATIONS_A_POINT = 2.5  # with all that a step along a branch does besides
_SECONDS_AN_ITERATION = 8e-6
# Of a contact that sticks; of one with n coefficients and closed events, the second times n²; of one that
# slides in a plane under the circular limit, the second times n.
_STUCK, _EVENTS, _CIRCLE = 3e-6, (3e-6, 2e-8), (1e-4, 8e-6)
# Of the receptance: harmonics × modes × leading ports², pair by pair or as products; × ports; × DOFs³.
_PAIRS, _PRODUCTS, _DRIVEN, _INVERTED = 2e-9, 2.8e-10, 2e-9, 1.5e-9
# Of the factors: unknowns³; products with the contacts' slopes; harmonics × eliminated ports³.
_FACTORS, _SLOPES, _ELIMINATED = 3e-11, 1e-9, 4e-10
_FREQUENCIES, _FEWER, _MANY = 101, 21, 100  # at which the stuck response is looked at; of many ports fewer


def point_seconds(balance: Balance, stuck: Real) -> float:
    """Return what a point of a branch over the frequency costs [s], on average over the band.

    Parameters
    ----------
    stuck : (n_frequencies, n_ports) forces of the ports if all stick, see `stuck_forces`.
    """
    system, n, nk = balance.system, balance.n_coefficients, balance.system.ks.size
    r, nc, modes = balance.n_leading, balance.n_ports, balance.system.eigenvalues.shape[1]
    if system.form == DENSE:
        linear = _INVERTED * nk * system.observe.size**3
    else:
        linear = nk * modes * ((_PAIRS if r <= PAIRS_UP_TO else _PRODUCTS) * r * r + _DRIVEN * nc)
    ports = np.diff(system.first_port)
    sticks = _sticking(balance, stuck)
    slipping = np.where(system.alone == 1, _CIRCLE[0] + _CIRCLE[1] * n, _EVENTS[0] + _EVENTS[1] * n * n)
    contacts = float((np.where(sticks, _STUCK, slipping)).sum(axis=1).mean())
    slopes = _SLOPES * float((ports**2).sum()) * n * n
    if r < nc:
        factors = _FACTORS * (r * n) ** 3 + slopes * r
    else:
        held = sticks @ ports if system.condense == 1 else np.zeros(len(stuck))
        free = nc - held
        gone = _ELIMINATED * nk * held**2 * (held + 2.0 * free)
        rows = 2.0 * _SLOPES * nk * n * free**2 * float(ports.max(initial=1))
        factors = float((_FACTORS * (free * n) ** 3 + rows + gone).mean())
    return _ITERATIONS_A_POINT * (_SECONDS_AN_ITERATION + linear + contacts + factors)


def _sticking(balance: Balance, stuck: Real) -> Flags:
    """Return which contacts stick where all others do, (n_frequencies, n_contacts)."""
    sticks = np.zeros((len(stuck), len(balance.scene.contacts)), np.bool_)
    for e, contact in enumerate(balance.scene.contacts):
        friction, load, first = contact.friction, contact.load, balance.system.first_port[e]
        if friction is None or load is None:
            continue
        pressed = load.least - (0.0 if contact.normal_port is None else stuck[:, first + contact.normal_port])
        pulled = np.linalg.norm(stuck[:, [first + port for port in contact.RUBBING]], axis=1)
        sticks[:, e] = pulled <= friction.mu * np.maximum(pressed, 0.0)
    return sticks


def stuck_forces(balance: Balance) -> Real:
    """Return the force each port carries over the band if all stick [N], without the mean.

    Returns
    -------
    (n_frequencies, n_ports) sums of the amplitudes of all harmonics.
    """
    # Stuck contacts are springs: nothing moves but at the harmonics of the forces.
    forced = fewer_harmonics(balance, 0)
    system, low_high = by_reference(forced.system), balance.scene.observe.band
    out, span = new_receptance(system), forced.system.span
    kt = np.array([k for contact in balance.scene.contacts for k in contact.stiffnesses])
    stiffness = kt - balance.system.shift
    springs = span.T @ (stiffness[:, None] * span)
    frequencies = np.linspace(*low_high, _FREQUENCIES if kt.size <= _MANY else _FEWER)
    total: Real = np.zeros((frequencies.size, kt.size))
    for moved, frequency in zip(total, frequencies, strict=True):
        receptance(system, 2.0 * np.pi * float(frequency), out)
        linear = receptance_by_value(out)
        for k, A, free in zip(forced.system.ks, linear.A[0], linear.u_linear[0], strict=True):
            if k == 0 or not np.any(free):
                continue
            if span.shape[1] == 0:
                moved += np.abs(np.linalg.solve(np.eye(kt.size) + A * stiffness, free))
            else:
                pulled = A @ (span.T @ (stiffness * free))
                moved += np.abs(free - span @ np.linalg.solve(np.eye(len(A)) + A @ springs, pulled))
    total *= kt
    return total
