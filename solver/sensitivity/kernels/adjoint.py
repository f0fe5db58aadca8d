"""The derivatives of an amplitude by everything at once: one factorisation, one adjoint, then dot products.

The amplitude is a = ξ x(τ*) at an extremum of the observed motion. With the adjoint λ of the balance,
(I + A G)ᵀ λ = −Gᵀ z, z = −ξ Bᵀ e(τ*), G = ∂F/∂U − shift, the weights w = z + Aᵀ λ of the contact forces solve

    (I + Aᵀ Gᵀ) w = z,   λ = −Gᵀ w,

a balance's Jacobian again, with A and G transposed: it condenses as `solver.balance.kernels.jacobian` does.
Then da/dp = w·∂F/∂p for a contact, and ξ e·∂x_linear + λ·(∂A F − ∂ū) − ξ e·∂B F for the linear part. Of real
coefficients, the transpose of a complex factor a is its conjugate.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.coordinates import is_reduced, responses
from solver.balance.kernels.haigh import utilisation
from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.output import SAME_HEIGHT, extremes, observed_motion
from solver.balance.kernels.residual import contact_values, evaluate
from solver.balance.kernels.slopes import springs_of
from solver.contacts.kernels.columns import KT, MU
from solver.contacts.kernels.coulomb.line_force import contact_force
from solver.contacts.kernels.stick_slip_events import FAILED
from solver.contacts.kernels.system import FROM_REST, UTILISED, Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real, coefficient_count, cosine_position
from solver.jit.separate import apart
from solver.linear.kernels.receptance import forget, receptance

# Entries of `by`: for each element the slopes by kt, μ and its load, then those of the linear part.
BY_KT, BY_MU, BY_LOAD = 0, 1, 2
BY_OMEGA, BY_LEVEL, BY_PHASE, BESIDES = 0, 1, 2, 3
# Columns of the extremes.
AMPLITUDE, SIGN, TAU, EXTREME_COLUMNS = 0, 1, 2, 3


@compiled
def per_element(system: System) -> int:
    """Return how many entries of `by` an element has."""
    return BY_LOAD + coefficient_count(system.load_ks)


@apart
def amplitude_slopes(
    system: System, linear: Receptance, u: Real, omega: float, point: Evaluation, wanted: Integer, x: Real,
    tops: Real, turns: Complex, weights: Real, pulls: Real, by: Real,
) -> int:  # fmt: skip
    """Differentiate max|x| of the observed DOF at the solution (u, ω); λ of `system` is the frequency.

    Counted from the middle of its range it is (max x − min x)/2, whose turn is half of both; a utilisation
    is a function of that and of the mean of max x and min x.

    Parameters
    ----------
    wanted : (ne,) 1 for the elastic Coulomb contacts whose slopes are asked for.
    x : (n,) the observed motion; tops : (2, EXTREME_COLUMNS) the extremes that are max|x|; filled, as below.
    turns : (2, nk) ξ e^{ikτ} of both, with which max|x| = Re Σ turn x̂.
    weights : (2, nc, n) w; pulls : (2, nt) λ.
    by : (2, ne·`per_element` + BESIDES) derivatives; those by level and phase are of a unit factor on all
        forces, and of the angle by which all that are not static turn.

    Returns
    -------
    How many extremes are max|x|: 2 where max x = −min x but for rounding; 0 where the balance is singular.
    """
    if not observe(system, linear, u, omega, point, x, tops):
        return 0
    high, low = tops[0, AMPLITUDE], -tops[1, AMPLITUDE]
    of_both = system.centred != FROM_REST
    # Without a mean and even harmonics both extremes are the same by symmetry, as those of one harmonic are.
    both = system.only < 0 and system.ks[0] == 0 and abs(high + low) <= SAME_HEIGHT * max(high, -low)
    if not both and not of_both and -low > high:
        for column in range(EXTREME_COLUMNS):
            tops[0, column], tops[1, column] = tops[1, column], tops[0, column]
    count = 2 if both else 1
    for top in range(2):
        for i in range(system.ks.size):
            angle = system.ks[i] * tops[top, TAU]
            turns[top, i] = tops[top, SIGN] * complex(math.cos(angle), math.sin(angle))
    if of_both:
        count, tops[0, AMPLITUDE], by_half, by_mean = 1, 0.5 * (high - low), 1.0, 0.0
        if system.centred == UTILISED:
            tops[0, AMPLITUDE], by_half, by_mean, _, _, _ = utilisation(system.haigh, high, low)
        for i in range(system.ks.size):
            up, down = turns[0, i], turns[1, i]
            turns[0, i] = 0.5 * (by_half * (up + down) + by_mean * (up - down))
    good = slopes_along(system, linear, u, omega, point, wanted, count, turns, weights, pulls, by)
    return count if good else 0


@apart
def observe(
    system: System, linear: Receptance, u: Real, omega: float, point: Evaluation, x: Real, tops: Real
) -> bool:
    """Fill the observed motion x (n,) at the solution (u, ω) and its extremes, the highest first, in `tops`.

    `tops` is (2, EXTREME_COLUMNS), as `amplitude_slopes` has it. Returns whether the contacts have a force.
    """
    receptance(system, omega, linear)
    if not math.isfinite(evaluate(system, linear, u, omega, 0.0, point)):
        return False
    observed_motion(system, linear, u, point, x)
    high, at_high, low, at_low = extremes(system, x)
    tops[0, AMPLITUDE], tops[0, SIGN], tops[0, TAU] = high, 1.0, at_high
    tops[1, AMPLITUDE], tops[1, SIGN], tops[1, TAU] = -low, -1.0, at_low
    return True


@apart
def slopes_along(
    system: System, linear: Receptance, u: Real, omega: float, point: Evaluation, wanted: Integer, count: int,
    turns: Complex, weights: Real, pulls: Real, by: Real,
) -> bool:  # fmt: skip
    """Differentiate Re Σ turn_k x̂_k of the observed motion, for each of `count` rows of `turns` (·, nk).

    The point is that of `observe`, just evaluated; what is filled is as `amplitude_slopes` has it. Returns
    whether the balance is regular there. A and ∂F/∂U are transposed afterwards.
    """
    _transpose(system, linear, point)
    if factorise(system, linear, point, u, 0.0, 0.0) == 0.0:
        return False
    for row in range(count):
        _fill_weights(system, linear, turns[row], pulls[row])
        step_back(system, point, pulls[row])
        _fill_pull(system, point, weights[row], pulls[row])
        _by_linear_part(system, linear, u, point, turns[row], pulls[row], by[row])
        _by_forces(system, point, weights[row], by[row])
    _by_contacts(system, u, omega, point, wanted, count, weights, by)
    return True


@apart
def _transpose(system: System, linear: Receptance, point: Evaluation) -> None:
    """Transpose A and ∂F/∂U in place, and see anew which forces are springs'."""
    forget(linear)
    for i in range(system.ks.size):
        A = linear.A[0, i]
        for c in range(A.shape[0]):
            for d in range(c + 1):
                A[c, d], A[d, c] = A[d, c].conjugate(), A[c, d].conjugate()
    n = coefficient_count(system.ks)
    for e in range(system.laws.size):
        first, m = system.first_block[e], system.first_port[e + 1] - system.first_port[e]
        for a in range(m):
            for b in range(a + 1):
                one, other = point.dF_dU[first + a * m + b], point.dF_dU[first + b * m + a]
                for i in range(n):
                    for j in range(i + 1 if a == b else n):
                        one[i, j], other[j, i] = other[j, i], one[i, j]
        if m > 1:
            ports = point.slopes[system.first_port[e] : system.first_port[e + 1]]
            springs_of(point.dF_dU[first : first + m * m], ports)


@compiled
def _fill_weights(system: System, linear: Receptance, turns: Complex, z: Real) -> None:
    """Fill z (nt,) with −Bᵀ turn, of ξ e(τ) for an extreme."""
    n = coefficient_count(system.ks)
    for i in range(system.ks.size):
        here, k = cosine_position(system.ks, i), system.ks[i]
        for d in range(system.owner.size):
            weight = -turns[i] * linear.B[0, i, d]
            z[d * n + here] = weight.real
            if k > 0:
                z[d * n + here + 1] = weight.imag


@compiled
def _fill_pull(system: System, point: Evaluation, weights: Real, pull: Real) -> None:
    """Keep the solution in `pull` as w and replace it by λ = −Gᵀ w; `point.G` is transposed already."""
    n = coefficient_count(system.ks)
    for c in range(system.owner.size):
        for i in range(n):
            weights[c, i] = pull[c * n + i]
    for e in range(system.laws.size):
        first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
        for a in range(m):
            for i in range(n):
                total = 0.0
                for b in range(m):
                    G = point.G[system.first_block[e] + a * m + b]
                    for j in range(n):
                        total -= G[i, j] * weights[first + b, j]
                pull[(first + a) * n + i] = total


@apart
def _fill_pulled(system: System, linear: Receptance, i: int, pull: Real, pulled: Complex) -> None:
    """Fill `pulled` (nc,) with (∂A/∂λ)ᵀ λ of harmonic number i; λ = `pull` without a sign."""
    nc, n, here = system.owner.size, coefficient_count(system.ks), cosine_position(system.ks, i)
    pulls = np.empty(nc, np.complex128)
    for c in range(nc):
        at = c * n + here
        pulls[c] = complex(pull[at], pull[at + 1] if system.ks[i] > 0 else 0.0)
    if is_reduced(system, linear):
        responses(system, linear.A[1, i].T, pulls, pulled)
        return
    for d in range(nc):
        pulled[d] = 0.0
        for c in range(nc):
            pulled[d] += pulls[c] * linear.A[1, i, c, d]


@apart
def _by_linear_part(
    system: System, linear: Receptance, u: Real, point: Evaluation, turns: Complex, pull: Real, by: Real
) -> None:
    """Fill the slopes by ω, and by level and phase of the excitation."""
    nc, n = system.owner.size, coefficient_count(system.ks)
    by_omega, level, phase = 0.0, 0.0, 0.0
    pulled = np.empty(nc, np.complex128)
    for i in range(system.ks.size):
        here, k = cosine_position(system.ks, i), system.ks[i]
        turn = turns[i]
        driven = turn * linear.x_linear[0, i]
        by_omega += (turn * linear.x_linear[1, i]).real
        for c in range(nc):
            at = c * n + here
            lam = complex(pull[at], pull[at + 1] if k > 0 else 0.0)
            driven -= lam * linear.u_linear[0, i, c]
            by_omega -= (lam * linear.u_linear[1, i, c]).real
        _fill_pulled(system, linear, i, pull, pulled)
        for d in range(nc):
            weight = -turn * linear.B[1, i, d] + pulled[d]
            at = d * n + here
            by_omega += weight.real * (point.F[d, here] - system.shift[d] * u[at])
            if k > 0:
                by_omega += weight.imag * (point.F[d, here + 1] - system.shift[d] * u[at + 1])
        if k > 0 or system.constant_mean == 0:
            level += driven.real
        if k > 0:
            phase -= driven.imag
    first = system.laws.size * per_element(system)
    by[first + BY_OMEGA], by[first + BY_LEVEL], by[first + BY_PHASE] = by_omega, level, phase


@compiled
def _by_forces(system: System, point: Evaluation, weights: Real, by: Real) -> None:
    """Add w·∂F/∂ω to the slope by ω: of normal loads that follow the frequency, and of forces of velocity."""
    for c in range(system.owner.size):
        for i in range(coefficient_count(system.ks)):
            by[system.laws.size * per_element(system) + BY_OMEGA] += weights[c, i] * point.dF_dp[c, i]


@apart
def _by_contacts(
    system: System, u: Real, omega: float, point: Evaluation, wanted: Integer, count: int, weights: Real,
    by: Real,
) -> None:  # fmt: skip
    """Fill w·∂F/∂kt, w·∂F/∂μ and w·∂F/∂N of the Jenkins elements asked for."""
    n, each = coefficient_count(system.ks), per_element(system)
    table, load, _, _ = contact_values(system, omega, 0.0)
    for e in range(system.laws.size):
        if wanted[e] == 0 or system.jenkins[e] == 0:
            continue
        c, block = system.first_port[e], system.first_block[e]
        state, _ = contact_force(
            u[c * n : (c + 1) * n], system.ks, load[e], system.load_ks, table[e, KT], table[e, MU],
            system.cos_table, system.sin_table, point.segments, point.dF_dU[block], point.dF_dkt,
            point.dF_dmu, point.dF_dN, point.F[c],
        )  # fmt: skip
        for top in range(count):
            row = by[top, e * each : (e + 1) * each]
            for column in range(each):
                row[column] = np.nan if state == FAILED else 0.0
            for i in range(n):
                weight = weights[top, c, i]
                row[BY_KT] += weight * point.dF_dkt[i]
                row[BY_MU] += weight * point.dF_dmu[i]
                for j in range(each - BY_LOAD):
                    row[BY_LOAD + j] += weight * point.dF_dN[i, j]
