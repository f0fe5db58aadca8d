"""The amplitude of a response as a function of frequency ω and a parameter p, with exact second derivatives.

The amplitude is a = ξ x(τ*), ξ = ±1, at an extremum τ* of the observed motion. With the adjoint λ of the
balance, r_uᵀ λ = −a_u, the Lagrangian L(u, ω, p, τ) = a + λᵀ r has the total derivatives
g = da/dω = L_ω and da/dp = L_p, and its Hessian along (du/dω, 1, dτ/dω) those of g:

    dg = h·du + k dω + m dp,   h = L_uu u' + L_uω + L_uτ τ', and so on, with λ held fixed.

Every term is linear in the contact forces or in λ, so with z = Aᵀλ − ξ Bᵀ e(τ*) (a weight for each force
coefficient, differentiated with A and B) L = λ·u + ξ e·x_linear − λ·ū + z·(F − shift u), and wᵀ∂²F comes from
`line_hessian` for elastic Coulomb contacts, whose events are known already, and
from `solver.contacts.kernels.laws` for the others. Sums over harmonics are real parts: harmonic k of a
vector v has v̂ = v_c − i v_s.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from solver.balance.kernels.coordinates import is_reduced
from solver.balance.kernels.jacobian import factorise, step_back, step_back_transposed
from solver.balance.kernels.output import extremes
from solver.balance.kernels.residual import contact_values, least_size
from solver.balance.kernels.slopes import springs_of
from solver.contacts.kernels.columns import KT, MU
from solver.contacts.kernels.coulomb.line_force import contact_force
from solver.contacts.kernels.coulomb.line_hessian import second_along
from solver.contacts.kernels.laws import call_law, call_second
from solver.contacts.kernels.stick_slip_events import (
    FAILED,
    SEGMENT,
    SEPARATED,
    STUCK,
    UNLOADED,
    segment_capacity,
)
from solver.contacts.kernels.system import (
    Evaluation,
    Receptance,
    System,
    is_spanned,
    new_evaluation,
    new_receptance,
    receptance_over,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count, cosine_position
from solver.jit.kernel_records import Records, referenced
from solver.jit.lapack import copy_block, dot, fill, fill_block
from solver.jit.separate import apart
from solver.linear.kernels.dynamic_stiffness import BY_BOTH, BY_OMEGA, BY_OMEGA_TWICE, BY_P, VALUE
from solver.linear.kernels.receptance import Jets, fill_jets, new_jets

# Entries of `Summit.numbers`.
NORM, AMPLITUDE, G, DA_DP, CURVE, DG_DP, TAU, DTAU, SIGN, CORNER, DRIFT, RATE = range(12)
SPENT = 12  # evaluations of the balance since it was set to 0
NUMBERS = 13


class Summit(NamedTuple):
    """Everything at one (u, ω, p); nt unknowns, ne elements with nc ports in all, n coefficients each."""

    jets: Jets
    linear: Receptance  # the first two orders of the jets; where fewer ports lead, the first of those alone
    point: Evaluation  # what the factors of the condensed Jacobian are made of
    F: Real  # (nc, n) forces less shift · u
    dF_dU: Real  # (blocks, n, n) slopes of the forces themselves; those of `point`
    dF_dp: Real  # (nc, n)
    seconds: Integer  # (ne,) numbers of the kernels of second derivatives; Jenkins elements need none
    dF_dN: Real  # (ne, n, 1 + 2 K) of the Jenkins elements, likewise the five below
    dF_dkt: Real  # (ne, n)
    dF_dmu: Real  # (ne, n)
    states: Integer  # (ne,)
    counts: Integer  # (ne,) segments of each
    segments: Records  # (ne, capacity)
    table: Real  # (ne, ·) contacts at p, their loads, and both differentiated by p
    load: Real  # (ne, 3)
    slope: Real  # (ne, ·)
    dload: Real  # (ne, 3)
    rhs: Real  # (3, nt) the solutions of J x = r, dr/dω, dr/dp
    adjoint: Real  # (nt,) λ
    h: Real  # (nt,) change of g by u
    x: Real  # (n,) observed motion
    dx: Real  # (n,) its derivative by ω along the response
    along: Real  # (nc, n) derivative of F along the response
    z: Real  # (ORDERS, nc, n) weights of the forces
    numbers: Real  # (NUMBERS,)


_new: Callable[..., Summit] = referenced("Summit", __name__, Summit._fields)


@compiled
def new_summit(system: System) -> Summit:
    """Return empty arrays for `system`; the numbers of the second derivatives are not in place yet."""
    ne, nc, n = system.laws.size, system.shift.size, coefficient_count(system.ks)
    nt, m, columns = nc * n, coefficient_count(system.load_ks), system.contacts.shape[1]
    capacity = segment_capacity(max(system.ks[-1], system.load_ks[-1]))
    jets, point = new_jets(system), new_evaluation(system)
    linear = receptance_over(jets.A, jets.u_linear, jets.B, jets.x_linear)
    if is_spanned(system):
        linear = new_receptance(system)
    return _new(
        jets, linear, point, np.zeros((nc, n)), point.dF_dU, np.zeros((nc, n)), np.full(ne, -1, np.int64),
        np.zeros((ne, n, m)), np.zeros((ne, n)), np.zeros((ne, n)), np.zeros(ne, np.int64),
        np.zeros(ne, np.int64), np.zeros((ne, capacity), SEGMENT), np.zeros((ne, columns)),
        np.zeros((ne, m)), np.zeros((ne, columns)), np.zeros((ne, m)), np.zeros((3, nt)), np.zeros(nt),
        np.zeros(nt), np.zeros(n), np.zeros(n), np.zeros((nc, n)), np.zeros((5, nc, n)), np.zeros(NUMBERS),
    )  # fmt: skip


@compiled
def summit_numbers(at: Summit) -> Real:
    """Return the numbers of a summit as Python can read them (a view)."""
    return at.numbers


@compiled
def summit_seconds(at: Summit) -> Integer:
    """Return the numbers of the second derivatives of a summit as Python can set them (a view)."""
    return at.seconds


@compiled
def summit_step(at: Summit) -> Real:
    """Return the Newton step of a summit as Python can read it (a view)."""
    return at.rhs[0]


@apart
def forces_at(system: System, u: Real, at: Summit) -> bool:
    """Evaluate all contacts, forces less shift · u; False if one failed."""
    n = coefficient_count(system.ks)
    for e in range(system.laws.size):
        good = _jenkins_at(system, e, u, at) if system.jenkins[e] == 1 else _other_law_at(system, e, u, at)
        if not good:
            return False
    for c in range(system.shift.size):
        for i in range(n):
            at.F[c, i] -= system.shift[c] * u[c * n + i]
    return True


@compiled
def _jenkins_at(system: System, e: int, u: Real, at: Summit) -> bool:
    """Evaluate an elastic Coulomb contact, of one port, with what its second derivatives need."""
    n, c, block, row = coefficient_count(system.ks), system.first_port[e], system.first_block[e], at.table[e]
    state, count = contact_force(
        u[c * n : (c + 1) * n], system.ks, at.load[e], system.load_ks, row[KT], row[MU], system.cos_table,
        system.sin_table, at.segments[e], at.dF_dU[block], at.dF_dkt[e], at.dF_dmu[e], at.dF_dN[e], at.F[c],
    )  # fmt: skip
    at.states[e], at.counts[e], at.point.slopes[c] = state, count, np.nan
    if state == FAILED:
        return False
    if state == SEPARATED:
        at.point.slopes[c] = 0.0
    elif state == STUCK and at.segments[e, 0].began == UNLOADED:
        at.point.slopes[c] = row[KT]
    for i in range(n):
        total = at.slope[e, KT] * at.dF_dkt[e, i] + at.slope[e, MU] * at.dF_dmu[e, i]
        for j in range(at.dload.shape[1]):
            total += at.dF_dN[e, i, j] * at.dload[e, j]
        at.dF_dp[c, i] = total
    return True


@compiled
def _other_law_at(system: System, e: int, u: Real, at: Summit) -> bool:
    """Evaluate an element that follows another law."""
    n, c, end = coefficient_count(system.ks), system.first_port[e], system.first_port[e + 1]
    block, last = system.first_block[e], system.first_block[e + 1]
    U = u[c * n : end * n].reshape((end - c, n))
    state, _ = call_law(
        system.laws[e], U, system.ks, at.load[e], system.load_ks, at.table[e], at.slope[e], at.dload[e],
        system.cos_table, system.sin_table, at.point.segments, at.F[c:end], at.dF_dU[block:last],
        at.dF_dp[c:end],
    )  # fmt: skip
    at.states[e] = state
    springs_of(at.dF_dU[block:last], at.point.slopes[c:end])
    return bool(state != FAILED)


@compiled
def add_slopes_times(
    system: System, at: Summit, transposed: bool, sign: float, x: Real, y: Real
) -> None:  # fmt: skip
    """Add sign (∂F/∂U − shift) x to y over all ports, or its transpose; x, y (nc, n)."""
    n = coefficient_count(system.ks)
    for e in range(system.laws.size):
        first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
        for a in range(m):
            for b in range(m):
                G = at.dF_dU[system.first_block[e] + a * m + b]
                for i in range(n):
                    if transposed:
                        for j in range(n):
                            y[first + b, j] += sign * G[i, j] * x[first + a, i]
                    else:
                        total = 0.0
                        for j in range(n):
                            total += G[i, j] * x[first + b, j]
                        y[first + a, i] += sign * total
            for i in range(n):
                y[first + a, i] -= sign * system.shift[first + a] * x[first + a, i]


@apart
def second_forces_at(system: System, u: Real, at: Summit) -> float:
    """Fill h with zᵀ∂²F/∂U² du/dω of all contacts; return the same of ∂²F/∂p∂U. NaN if one failed."""
    total = 0.0
    for e in range(system.laws.size):
        total += (
            _second_of_jenkins(system, e, u, at) if system.jenkins[e] == 1 else _second_of(system, e, u, at)
        )
    return total


@compiled
def _second_of_jenkins(system: System, e: int, u: Real, at: Summit) -> float:
    """Fill h of an elastic Coulomb contact with zᵀ∂²F/∂U² du/dω; return the same by p."""
    n, c, block, row = coefficient_count(system.ks), system.first_port[e], system.first_block[e], at.table[e]
    along, none, out_N = np.empty(n), np.zeros(at.dload.shape[1]), np.empty(at.dload.shape[1])
    for i in range(n):
        along[i] = -at.rhs[1, c * n + i]
    by_kt, by_mu = second_along(
        u[c * n : (c + 1) * n], system.ks, at.load[e], system.load_ks, row[KT], row[MU], at.states[e],
        at.segments[e], at.counts[e], at.dF_dU[block], at.dF_dN[e], at.z[VALUE, c], along, none,
        at.h[c * n : (c + 1) * n], out_N,
    )  # fmt: skip
    total = dot(out_N, at.dload[e])
    if at.slope[e, KT] != 0.0:
        total += by_kt * at.slope[e, KT]
    if at.slope[e, MU] != 0.0:
        total += by_mu * at.slope[e, MU]
    return total


@compiled
def _second_of(system: System, e: int, u: Real, at: Summit) -> float:
    """Do the same of an element that follows another law; NaN if that failed."""
    n, c, end = coefficient_count(system.ks), system.first_port[e], system.first_port[e + 1]
    along, shape = np.empty((end - c, n)), (end - c, n)
    for a in range(end - c):
        for i in range(n):
            along[a, i] = -at.rhs[1, (c + a) * n + i]
    out_row, out_load = np.empty(at.slope.shape[1]), np.empty(at.dload.shape[1])
    state = call_second(
        at.seconds[e], u[c * n : end * n].reshape(shape), system.ks, at.load[e], system.load_ks, at.table[e],
        system.cos_table, system.sin_table, at.z[VALUE][c:end], along, np.zeros(at.slope.shape[1]),
        np.zeros(at.dload.shape[1]), at.h[c * n : end * n].reshape(shape), out_row, out_load,
    )  # fmt: skip
    if state == FAILED:
        return np.nan
    total = dot(out_load, at.dload[e])
    for column in range(at.slope.shape[1]):
        if at.slope[e, column] != 0.0:
            total += out_row[column] * at.slope[e, column]
    return total


_TURNS = 12


@apart
def balance_at(system: System, u: Real, omega: float, p: float, at: Summit) -> float:
    """Evaluate the residual and its slopes at (u, ω, p); return its relative size (NaN if that failed)."""
    at.numbers[SPENT] += 1.0
    fill_jets(system, omega, p, at.jets)
    for i in range(system.ks.size):
        if not math.isfinite(at.jets.x_linear[0, i].real):
            return np.nan
    if is_reduced(system, at.linear):
        for i in range(system.ks.size):
            for a in range(system.leading.size):
                for b in range(system.leading.size):
                    at.linear.A[0, i, a, b] = at.jets.A[VALUE, i, system.leading[a], system.leading[b]]
    table, load, slope, dload = contact_values(system, p, 0.0)
    copy_block(at.table, table)
    copy_block(at.load, load)
    copy_block(at.slope, slope)
    copy_block(at.dload, dload)
    if not forces_at(system, u, at):
        return np.nan
    return _assemble(system, u, least_size(system, p), at)


@apart
def _assemble(system: System, u: Real, least: float, at: Summit) -> float:
    """Put r, dr/dω and dr/dp (rows of `rhs`) together."""
    nc, n = system.shift.size, coefficient_count(system.ks)
    jets, rhs = at.jets, at.rhs
    scale, largest = least, 0.0
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        for c in range(nc):
            row = c * n + here
            response, by_omega, by_p = complex(0.0), complex(0.0), complex(0.0)
            for d in range(nc):
                a = jets.A[VALUE, i, c, d]
                fs = at.F[d, here + 1] if has_sine else 0.0
                dfs = at.dF_dp[d, here + 1] if has_sine else 0.0
                force, dforce = complex(at.F[d, here], -fs), complex(at.dF_dp[d, here], -dfs)
                response += a * force
                by_omega += jets.A[BY_OMEGA, i, c, d] * force
                by_p += jets.A[BY_P, i, c, d] * force + a * dforce
            free = jets.u_linear[VALUE, i, c]
            scale = max(scale, abs(free))
            rest = response - free
            by_omega -= jets.u_linear[BY_OMEGA, i, c]
            by_p -= jets.u_linear[BY_P, i, c]
            rhs[0, row], rhs[1, row], rhs[2, row] = u[row] + rest.real, by_omega.real, by_p.real
            largest = max(largest, abs(rhs[0, row]))
            if has_sine:
                scale = max(scale, abs(response), abs(u[row]))
                rhs[0, row + 1] = u[row + 1] - rest.imag
                rhs[1, row + 1], rhs[2, row + 1] = -by_omega.imag, -by_p.imag
                largest = max(largest, abs(rhs[0, row + 1]))
    return largest / scale if scale > 0.0 else largest


@compiled
def solve_step(system: System, at: Summit) -> bool:
    """Factorise dr/du and replace r by the Newton step J⁻¹ r."""
    if at.rhs.shape[1] == 0:
        return True
    if factorise(system, at.linear, at.point, at.rhs[0], 0.0, 0.0) == 0.0:
        return False
    step_back(system, at.point, at.rhs[0])
    return True


@compiled
def solve_responses(system: System, at: Summit) -> bool:
    """Replace r, dr/dω, dr/dp by the Newton step and the responses: J⁻¹ r, −du/dω, −du/dp."""
    if not solve_step(system, at):
        return False
    if at.rhs.shape[1] > 0:
        step_back(system, at.point, at.rhs[1])
        step_back(system, at.point, at.rhs[2])
    return True


@compiled
def observe_at(system: System, at: Summit) -> None:
    """Fill `x` with the coefficients of the observed DOF."""
    nc = system.shift.size
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        value = at.jets.x_linear[VALUE, i]
        for c in range(nc):
            value -= at.jets.B[VALUE, i, c] * complex(at.F[c, here], -at.F[c, here + 1] if has_sine else 0.0)
        at.x[here] = value.real
        if has_sine:
            at.x[here + 1] = -value.imag


@compiled
def motion_at(system: System, x: Real, tau: float) -> tuple[float, float, float]:
    """Return value, slope and curvature over τ of a motion with coefficients `x`."""
    value, slope, bend = 0.0, 0.0, 0.0
    for i in range(system.ks.size):
        k, here = system.ks[i], cosine_position(system.ks, i)
        if k == 0:
            value += x[here]
        else:
            cosine, sine = math.cos(k * tau), math.sin(k * tau)
            a = x[here] * cosine + x[here + 1] * sine
            value += a
            slope += k * (x[here + 1] * cosine - x[here] * sine)
            bend -= k * k * a
    return value, slope, bend


@compiled
def find_extremum(system: System, at: Summit, tau: float) -> bool:
    """Find the extremum of the observed motion near `tau`: a maximum of ξx, ξ = numbers[SIGN]."""
    sign = at.numbers[SIGN]
    x, here = at.x, tau
    for _ in range(_TURNS):
        _, slope, bend = motion_at(system, x, here)
        if not sign * bend < 0.0:
            break
        move = -slope / bend
        here += move
        if abs(here - tau) > 0.5:
            break
        if abs(move) <= 1e-13:
            at.numbers[TAU] = here
            at.numbers[AMPLITUDE] = sign * motion_at(system, x, here)[0]
            return True
    high, at_high, low, at_low = extremes(system, x)
    at.numbers[TAU] = at_high if sign > 0.0 else at_low
    at.numbers[AMPLITUDE] = high if sign > 0.0 else -low
    return math.isfinite(high)


@compiled
def choose_extremum(system: System, at: Summit) -> None:
    """Set sign and place of the larger of max x and −min x."""
    high, at_high, low, at_low = extremes(system, at.x)
    at.numbers[SIGN], at.numbers[TAU] = (1.0, at_high) if high >= -low else (-1.0, at_low)


@apart
def slopes_at(system: System, at: Summit) -> bool:
    """Compute λ, g = da/dω and da/dp after `solve_responses`, `observe_at` and `find_extremum`."""
    nc, n = system.shift.size, coefficient_count(system.ks)
    jets, numbers, tau = at.jets, at.numbers, at.numbers[TAU]
    z = at.z[VALUE]
    for i in range(system.ks.size):
        here, k = cosine_position(system.ks, i), system.ks[i]
        turn = numbers[SIGN] * complex(math.cos(k * tau), math.sin(k * tau))
        for d in range(nc):
            weight = -turn * jets.B[VALUE, i, d]
            z[d, here] = weight.real
            if k > 0:
                z[d, here + 1] = weight.imag
    # r_uᵀ λ = −a_u, and a_u = (∂F/∂U − shift)ᵀ z as long as z has no λ in it.
    fill(at.adjoint, 0.0)
    add_slopes_times(system, at, True, -1.0, z, at.adjoint.reshape((nc, n)))
    if nc > 0:
        step_back_transposed(system, at.point, at.adjoint)
    numbers[G] = _linear_part(system, at, BY_OMEGA)
    numbers[DA_DP] = _linear_part(system, at, BY_P)
    _linear_part(system, at, VALUE)
    for d in range(nc):
        numbers[G] += dot(at.z[BY_OMEGA, d], at.F[d])
        numbers[DA_DP] += dot(at.z[BY_P, d], at.F[d]) + dot(at.z[VALUE, d], at.dF_dp[d])
    return math.isfinite(numbers[G])


@apart
def _linear_part(system: System, at: Summit, order: int) -> float:
    """Fill z of one order, Aᵀλ − ξ Bᵀe(τ*), and return ξ e·x_linear − λ·ū of that order."""
    nc, n = system.shift.size, coefficient_count(system.ks)
    jets, lam, total = at.jets, at.adjoint, 0.0
    sign, tau = at.numbers[SIGN], at.numbers[TAU]
    for i in range(system.ks.size):
        here, k = cosine_position(system.ks, i), system.ks[i]
        turn = sign * complex(math.cos(k * tau), math.sin(k * tau))
        total += (turn * jets.x_linear[order, i]).real
        for d in range(nc):
            weight = -turn * jets.B[order, i, d]
            for c in range(nc):
                at_c = c * n + here
                pull = complex(lam[at_c], lam[at_c + 1] if k > 0 else 0.0)
                weight += pull * jets.A[order, i, c, d]
            pull = complex(lam[d * n + here], lam[d * n + here + 1] if k > 0 else 0.0)
            total -= (pull * jets.u_linear[order, i, d]).real
            at.z[order, d, here] = weight.real
            if k > 0:
                at.z[order, d, here + 1] = weight.imag
    return total


@compiled
def _along_response(system: System, at: Summit) -> None:
    """Fill dF/dω and dx/dω along the response, and dτ*/dω = −x'_ω/x''."""
    nc, n = system.shift.size, coefficient_count(system.ks)
    fill_block(at.along, 0.0)
    add_slopes_times(system, at, False, -1.0, at.rhs[1].reshape((nc, n)), at.along)  # of −du/dω
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        value = at.jets.x_linear[BY_OMEGA, i]
        for c in range(nc):
            fs, dfs = 0.0, 0.0
            if has_sine:
                fs, dfs = at.F[c, here + 1], at.along[c, here + 1]
            value -= at.jets.B[BY_OMEGA, i, c] * complex(at.F[c, here], -fs)
            value -= at.jets.B[VALUE, i, c] * complex(at.along[c, here], -dfs)
        at.dx[here] = value.real
        if has_sine:
            at.dx[here + 1] = -value.imag
    tau = at.numbers[TAU]
    bend = motion_at(system, at.x, tau)[2]
    at.numbers[DTAU] = -motion_at(system, at.dx, tau)[1] / bend if bend != 0.0 else 0.0


@compiled
def _turned(system: System, at: Summit, order: int, weights: Real) -> float:
    """Fill `weights` with dz/dτ of one order, −ξ ik B e(τ), and return ξ d(e·x_linear)/dτ less its forces."""
    nc = system.shift.size
    sign, tau, total = at.numbers[SIGN], at.numbers[TAU], 0.0
    for i in range(system.ks.size):
        here, k = cosine_position(system.ks, i), system.ks[i]
        turn = sign * complex(0.0, float(k)) * complex(math.cos(k * tau), math.sin(k * tau))
        total += (turn * at.jets.x_linear[order, i]).real
        for d in range(nc):
            weight = -turn * at.jets.B[order, i, d]
            weights[d, here] = weight.real
            total += weight.real * at.F[d, here]
            if k > 0:
                weights[d, here + 1] = weight.imag
                total += weight.imag * at.F[d, here + 1]
    return total


@apart
def curvatures_at(system: System, u: Real, at: Summit) -> None:
    """Compute h (change of g by u), k and m after `slopes_at`: d²a/dω² = h·u' + k and dg/dp = h·u_p + m."""
    nc, n = system.shift.size, coefficient_count(system.ks)
    numbers = at.numbers
    _along_response(system, at)
    k = _linear_part(system, at, BY_OMEGA_TWICE)
    m = _linear_part(system, at, BY_BOTH)
    turned, h = np.empty((nc, n)), at.h.reshape((nc, n))
    k += numbers[DTAU] * _turned(system, at, BY_OMEGA, turned)
    m += numbers[DTAU] * _turned(system, at, BY_P, turned)
    _turned(system, at, VALUE, turned)
    for d in range(nc):
        for i in range(n):
            turned[d, i] = at.z[BY_OMEGA, d, i] + numbers[DTAU] * turned[d, i]
        k += dot(at.z[BY_OMEGA_TWICE, d], at.F[d]) + dot(at.z[BY_OMEGA, d], at.along[d])
        m += dot(at.z[BY_BOTH, d], at.F[d]) + dot(at.z[BY_P, d], at.along[d])
        m += dot(turned[d], at.dF_dp[d])
    m += second_forces_at(system, u, at)
    add_slopes_times(system, at, True, 1.0, turned, h)
    numbers[CURVE] = k - dot(at.h, at.rhs[1])
    numbers[DG_DP] = m - dot(at.h, at.rhs[2])
