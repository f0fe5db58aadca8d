"""What rounding leaves of the observed motion, and resonances of which it leaves nothing.

The matrices of a structure are rounded, and what is found with them is the exact answer of a structure whose
entries are off by some units of the last place (backward stability; N. J. Higham, Accuracy and Stability of
Numerical Algorithms, 2nd ed., SIAM 2002, ch. 7 and 10). For a harmonic with the closed loop Z + Lᴴ κ L of the
structure and its contacts, and g the row of its inverse that leads to the observed DOF, that changes the
observed motion by g δZ x: at most ε |g|_Z |x|_Z, where |x|_Z weighs every coordinate by the square root of
its largest entry of Z (`solver.linear.modal.sizes_of`). Near a node of the motion |x|_Z is far larger than
what is observed, and near a resonance both factors grow as the damping falls: the bound is about ε/ζ there.
Where contacts and excitation cancel, the rounding of what cancels is added.

Where the bound at a resonance is the motion itself no digit of its height is known, and it counts as not
damped: ζ below some ε.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from solver.balance.balance import Balance, Kind
from solver.balance.kernels.linearised_contacts import fill_springs
from solver.contacts.kernels.system import (
    DENSE,
    MODES,
    evaluation_by_value,
    of_all_ports,
    receptance_by_value,
)
from solver.jit.fourier import Complex, Flags, Real
from solver.linear.condensation import force_amplitudes
from solver.linear.kernels.receptance import excitation
from solver.matrices.normal_modes import hermitian, undamped_modes
from solver.scene.scene_harmonics import Amplitudes

if TYPE_CHECKING:
    from solver.balance.workspace import Workspace

# What the entries of the matrices are off by, and sums of what cancels, found on random scenes.
LOST_BITS = 4.0 * float(np.finfo(float).eps)
_LOST_SUMS = 16.0  # in units of the former
_TINY = 1e-300
_SEEN = 1e-12  # share of a motion, relative to that in other modes, below which it is rounding
_DRIVEN = 64.0 * float(np.finfo(np.longdouble).eps)  # the same of what drives a mode
_SURELY = 1e-10  # what drives it is known well enough above
_DAMPED = 1e-4  # damping ratios that are more than rounding, whatever the matrices are
_AT_RESONANCE = 1e-14  # of a frequency: nearer to one without damping the response is rounding
_SAME = 1e-9  # relative distance of frequencies below which modes may be turned into each other


class _Chains(NamedTuple):
    """What leads from the forces to the observed DOF, mode by mode (or coordinate by coordinate) of m."""

    seen: Complex  # (nk, m) g, the closed loop's row for the observed DOF
    moved: Complex  # (nk, m) x
    slope: Complex  # (nk,) of the observed motion by ω [m s]
    kept: Flags  # (nk,) harmonics that are observed


def observed_rounding(workspace: Workspace, u: Real, p: float, *, across: bool) -> float:
    """Return what rounding may do to the observed motion at a solution (u, λ = p) [m].

    Parameters
    ----------
    workspace : evaluated there.
    across : only what does not move the solution along the branch: a resonance that is rounded in frequency
        keeps its height.
    """
    balance = workspace.balance
    system, point = balance.system, evaluation_by_value(workspace.point)
    linear = of_all_ports(system, receptance_by_value(workspace.linear))
    hat = Amplitudes(system.ks)
    motions = hat.of(u.reshape(point.F.shape))
    forces = hat.of(point.F) - system.shift[:, None] * motions
    loop = linear.B[0] if not point.F.shape[0] else _through_contacts(workspace, linear.A[0], linear.B[0])
    chains = _chains(balance, forces.T, loop, p)
    pushed, free = np.abs(forces.T), linear.x_linear[0]
    observed = np.abs(free - (linear.B[0] * forces.T).sum(axis=1))
    cancelled = np.zeros(observed.size)
    if pushed.size:
        cancelled += np.abs(free) + (np.abs(linear.B[0]) * pushed).sum(axis=1)
        moved = np.abs(linear.u_linear[0]) + np.matmul(np.abs(linear.A[0]), pushed[:, :, None])[:, :, 0]
        cancelled += (np.abs(loop) * moved).sum(axis=1)
    changes = _changes(balance, chains, observed, p, across=across)
    return LOST_BITS * float(np.sum(changes + _LOST_SUMS * cancelled))


def _through_contacts(workspace: Workspace, A: Complex, B: Complex) -> Complex:
    """Return B κ (1 + A κ)⁻¹, (nk, nc): the observed motion for a unit of rounding of each contact's."""
    system = workspace.balance.system
    springs = np.empty((system.ks.size, int(system.first_block[-1])), np.complex128)
    fill_springs(workspace.system, workspace.point, springs)
    ports = np.diff(system.first_port)[system.owner]
    if ports.size == 1:
        kappa = springs[:, :1] - system.shift
        return B * kappa / (1.0 + A[:, 0] * kappa)
    row = np.repeat(np.arange(system.owner.size), ports)
    port = np.arange(row.size) - np.repeat(np.cumsum(ports) - ports, ports)
    first = system.first_port[system.owner][row]
    kappa = np.zeros((system.ks.size, ports.size, ports.size), np.complex128)
    block = system.first_block[system.owner][row] + (row - first) * ports[row] + port
    kappa[:, row, first + port] = springs[:, block]
    every = np.arange(ports.size)
    kappa[:, every, every] -= system.shift
    led = np.matmul(B[:, None, :], kappa)
    closed = np.eye(ports.size) + np.matmul(A, kappa)
    return np.linalg.solve(closed.transpose(0, 2, 1), led.transpose(0, 2, 1))[:, :, 0]


def _chains(balance: Balance, forces: Complex, loop: Complex, p: float) -> _Chains:
    """Return how the excitation and the forces (nk, nc) of the contacts move what is observed."""
    system = balance.system
    omega = p if balance.parameter.kind is Kind.FREQUENCY else system.omega
    plain = getattr(excitation, "py_func", excitation)
    still, level = (plain(system, p, k)[0] for k in (0, 1))
    level = np.where(system.ks == 0, still, level)[:, None]
    ks, which = system.ks[:, None], system.which
    kept = np.ones(system.ks.size, np.bool_) if system.only < 0 else system.ks == system.only
    if system.form == DENSE:
        return _dense_chains(balance, forces, loop, omega, p, level, kept)
    pushed = system.modal_forces * level - np.matmul(forces[:, None, :], system.contact_duals[which])[:, 0]
    seen = system.observe_modes[which] - np.matmul(loop[:, None, :], system.contact_modes[which])[:, 0]
    if system.form == MODES:
        slope = 1j * ks * system.dampings[which] - 2.0 * ks**2 * omega
        d = system.eigenvalues[which] - (ks * omega) ** 2 + 1j * ks * omega * system.dampings[which]
    else:
        slope = np.broadcast_to(1j * ks, pushed.shape)
        d = 1j * ks * omega - system.eigenvalues[which]
    d = np.where(d == 0.0, _TINY, d)
    seen, moved = seen / d, pushed / d
    return _Chains(seen, moved, -(seen * slope * moved).sum(axis=1), kept)


def _dense_chains(
    balance: Balance, forces: Complex, loop: Complex, omega: float, p: float, level: Complex, kept: Flags
) -> _Chains:
    """Return the same from the matrices."""
    system = balance.system
    ks, which = np.maximum(system.ks, 1)[:, None, None], system.which
    K, C, M, pushed = system.K, system.C, system.M, system.forces
    if balance.parameter.kind is Kind.STRUCTURE:
        by = p - system.parameter_reference
        K, C, M = K + by * system.dK, C + by * system.dC, M + by * system.dM
        if system.ddK.size:
            K = K + 0.5 * by * by * system.ddK
        if system.dforces.size:
            pushed = pushed + by * system.dforces[0] + 0.5 * by * by * system.dforces[1]
    Z = K[which] + 1j * ks * omega * C[which] - (ks * omega) ** 2 * M[which]
    L = system.L[which]
    pushed = pushed * level - np.matmul(forces[:, None, :], L.conj())[:, 0]
    seen = system.observe - np.matmul(loop[:, None, :], L)[:, 0]
    moved: Complex = np.asarray(np.linalg.solve(Z, pushed[:, :, None])[:, :, 0], np.complex128)
    seen = np.asarray(np.linalg.solve(Z.transpose(0, 2, 1), seen[:, :, None])[:, :, 0], np.complex128)
    turned = np.matmul(1j * ks * C[which] - 2.0 * ks**2 * omega * M[which], moved[:, :, None])[:, :, 0]
    return _Chains(seen, moved, -(seen * turned).sum(axis=1), kept)


def _changes(balance: Balance, chains: _Chains, observed: Real, p: float, *, across: bool) -> Real:
    """Return the bounds g δZ x of harmonics with observed amplitudes (nk,), in units of rounding [m]."""
    seen, moved, slope, kept = chains
    system = balance.system
    omega = p if balance.parameter.kind is Kind.FREQUENCY else system.omega
    k = np.maximum(system.ks, int(system.form == DENSE))[:, None] * omega
    by = balance.sizes[:, :, system.which]
    ways = np.array([seen, moved])
    rows = _weights(by.swapaxes(0, 1), k) * ways
    if not across:
        return np.where(kept, _norms(rows).prod(axis=0), 0.0)
    # Entries of Z are real but for damping: what they do along the slope by ω moves the resonance alone.
    # Turned so that the largest parts of x, and of g against the slope, are real, the rest counts.
    turn = np.exp(-0.5j * np.angle((rows[1] ** 2).sum(axis=1)))
    rows = rows * np.array([np.exp(-1j * np.angle(slope)) / turn, turn])[:, :, None]
    (g, x), (g_aside, x_aside) = real, imag = _norms(rows.real), _norms(rows.imag)
    whole = np.hypot(real, imag).prod(axis=0)
    lost = 0.0 if not by[:, 1].any() else k[:, 0] * _norms(np.sqrt(by[:, 1]) * np.abs(ways)).prod(axis=0)
    far = LOST_BITS * whole**2 / np.maximum(observed, _TINY)  # where it moves by more than it is wide
    whole = np.minimum(g * x_aside + g_aside * x + lost + far, whole)
    return np.where(kept, whole, 0.0)


def _weights(sizes: Real, omega: Real | float) -> Real:
    """Return the weights of modes or coordinates at a frequency, see `solver.linear.modal.sizes_of`."""
    return np.sqrt(sizes[0] + omega * sizes[1] + omega**2 * sizes[2])  # type: ignore[no-any-return]


def _norms(rows: Real | Complex) -> Real:
    return np.sqrt((np.abs(rows) ** 2).sum(axis=-1))  # type: ignore[no-any-return]


def resonates_undamped(balance: Balance, low: float, high: float) -> bool:
    """Return whether a resonance that nothing damps lies between two λ and is driven.

    Nothing damps a mode whose damping is rounding and in which no contact moves: friction holds a resonance
    only where it rubs.

    Parameters
    ----------
    low, high : of the frequency [rad/s]; where that is fixed it is looked at there. A single frequency is
        at a resonance as near as rounding tells.
    """
    system = balance.system
    if balance.parameter.kind is not Kind.FREQUENCY:
        low = high = system.omega
    near = _AT_RESONANCE if low == high else 0.0
    ends = min(low, high) * (1.0 - near), max(low, high) * (1.0 + near)
    forced = system.ks > 0 if system.form == DENSE else np.any(system.modal_forces, axis=1) & (system.ks > 0)
    for i in np.flatnonzero(forced):
        k = int(system.ks[i])
        modes = _undamped_modes(balance, int(i), k * ends[0], k * ends[1])
        if modes is not None and any(_grows(modes, natural) for natural in modes.natural):
            return True
    return False


class _Undamped(NamedTuple):
    """Modes m without damping, as a harmonic of the forces drives them."""

    natural: Real  # (m,) [rad/s]
    contacts: Complex  # (nc, m) relative to the largest of each contact
    forces: Complex  # (m,) relative to the largest


def _undamped_modes(balance: Balance, i: int, low: float, high: float) -> _Undamped | None:
    """Return the modes of harmonic number i between two ω whose damping is rounding; None without any."""
    system, s = balance.system, int(balance.system.which[i])
    if system.form == DENSE:
        return _undamped_of_matrices(balance, i, low, high)
    values = system.eigenvalues[s]
    natural = np.sqrt(np.maximum(values.real, 0.0)) if system.form == MODES else values.imag
    loss = natural * system.dampings[s] if system.form == MODES else values.real
    if np.all(np.abs(loss) > _DAMPED * np.abs(natural)):
        return None
    left, right = (_weights(each, np.abs(natural)) for each in balance.sizes[:, :, s])
    none = (natural > 0.0) & (natural >= low) & (natural <= high)
    none &= np.abs(loss) <= LOST_BITS * left * right
    if not none.any():
        return None
    contacts, pushed = _relative(system.contact_modes[s]), _relative(system.modal_forces[i])
    hardly = np.flatnonzero(none & (pushed != 0.0) & (np.abs(pushed) < _SURELY))
    if system.form == MODES and hardly.size:
        model, k = balance.model, system.ks[i : i + 1]
        held = model.matrices(model.diameters(k), k > 0)
        force = force_amplitudes(model, k)[0]
        sharp = _sharpened(hermitian(held.K[0]), held.M[0], natural[hardly], force)
        pushed[hardly] = sharp / np.abs(system.modal_forces[i]).max()
    return _Undamped(natural[none], contacts[..., none], pushed[none])


def _undamped_of_matrices(balance: Balance, i: int, low: float, high: float) -> _Undamped | None:
    """Return the same of matrices without any damping, whose bases do not move."""
    system, s, model = balance.system, int(balance.system.which[i]), balance.model
    free = model.free
    K, C, M = (each[s][np.ix_(free, free)] for each in (system.K, system.C, system.M))
    if model.line is not None or np.any(hermitian(C)) or np.any(K - hermitian(K)):
        return None
    try:
        found = undamped_modes(K, M)
    except np.linalg.LinAlgError:  # neither stiffness nor inertia holds some coordinate
        return None
    others, natural = ~free, np.sqrt(np.maximum(found.omega2, 0.0))
    pushed = found.phi.conj().T @ system.forces[i][free]
    if others.any():  # the base moves as it does when what is free stands still
        omega = np.where(natural > 0.0, natural, 1.0)[:, None, None]
        Z = system.K[s] + 1j * omega * system.C[s] - omega**2 * system.M[s]
        held = np.linalg.solve(Z[:, others][:, :, others], system.forces[i][others][:, None])
        pushed = pushed - np.einsum("fm,mfo,mo->m", found.phi.conj(), Z[:, free][:, :, others], held[..., 0])
    inside = (natural > 0.0) & (natural >= low) & (natural <= high)
    contacts, relative = _relative(system.L[s][:, free] @ found.phi), _relative(pushed)
    hardly = np.flatnonzero(inside & (relative != 0.0) & (np.abs(relative) < _SURELY))
    if hardly.size and not others.any():
        sharp = _sharpened(K, M, natural[hardly], system.forces[i])
        relative[hardly] = sharp / np.abs(pushed).max()
    return _Undamped(natural[inside], contacts[:, inside], relative[inside])


def _sharpened(K: Complex, M: Complex, natural: Real, force: Complex) -> Complex:
    """Return what drives modes of some frequencies, to more digits where they hardly move at the force.

    Each is corrected once by the other modes j, φⱼ φⱼᴴ (K − ω² M) φ / (ω² − ωⱼ²), with what it leaves of its
    equation found in longer numbers.
    """
    found = undamped_modes(K, M)
    every, omega2, phi = np.sqrt(np.maximum(found.omega2, 0.0)), found.omega2, found.phi
    which = np.abs(every[:, None] - natural).argmin(axis=0)
    wide = phi[:, which].astype(np.clongdouble)
    left = K.astype(np.clongdouble) @ wide - (M.astype(np.clongdouble) @ wide) * omega2[which]
    apart = omega2[which] - omega2[:, None]
    near = np.abs(apart) <= 2.0 * _SAME * np.abs(omega2[which])
    shares = np.where(near, 0.0, phi.conj().T @ left / np.where(near, 1.0, apart))
    force = force.astype(np.clongdouble)
    return np.asarray((force @ wide.conj()) + (force @ phi.conj()) @ shares.conj(), np.complex128)


def _relative(modes: Complex) -> Complex:
    largest = np.abs(modes).max(axis=-1, keepdims=True, initial=0.0)
    return np.asarray(modes / np.maximum(largest, _TINY), np.complex128)


def _grows(modes: _Undamped, natural: float) -> bool:
    """Return whether modes at one frequency are driven in a motion in which no contact moves."""
    same = np.abs(modes.natural - natural) <= _SAME * natural
    motions = modes.contacts[:, same]
    _, sizes, rows = np.linalg.svd(motions, full_matrices=False)
    rows = rows[sizes > _SEEN]
    forces = modes.forces[same] - rows.conj().T @ (rows @ modes.forces[same])
    least = max(_DRIVEN, _SEEN * np.abs(modes.forces[same]).max(initial=0.0))
    return bool(np.abs(forces).max(initial=0.0) > least)
