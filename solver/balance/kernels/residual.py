"""The balance at one (u, λ): residual and derivative by λ from the contact forces and their derivatives."""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.coordinates import is_reduced
from solver.balance.kernels.coordinates import reaches as span_reaches
from solver.balance.kernels.coordinates import responses as span_responses
from solver.balance.kernels.gauge import find_gauge, let_hold
from solver.balance.kernels.slopes import springs_of
from solver.contacts.kernels.columns import COLUMN_KIND, COLUMNS, KT, N0, N1, OMEGA, PHASE, RATIO
from solver.contacts.kernels.laws import call_law
from solver.contacts.kernels.stick_slip_events import FAILED, SEPARATED, STUCK, UNLOADED
from solver.contacts.kernels.system import FREQUENCY, LEVEL, Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real, coefficient_count, cosine_position, magnitude
from solver.jit.lapack import copy_block, fill
from solver.jit.separate import apart
from solver.linear.kernels.receptance import driven_motions, goes_through_modes, modal_responses, receptance


@compiled
def tie(row: Real, slope: Real) -> None:
    """Set N1 = N1_ratio N0 in the row of a contact, and its derivative."""
    row[N1] = row[RATIO] * row[N0]
    slope[N1] = row[RATIO] * slope[N0] + slope[RATIO] * row[N0]


@compiled
def fill_load(row: Real, slope: Real, added: float, load: Real, dload: Real) -> None:
    """Fill the coefficients of mean (`added` on it), cosines and sines [N], and their derivatives.

    Both have 1 + 2 K of them, K the highest harmonic of the loads in the table.
    """
    load[0], dload[0] = row[N0] + added, slope[N0]
    for j in range(1, load.size, 2):
        size, phase = (N1, PHASE) if j == 1 else (COLUMNS + j - 3, COLUMNS + j - 2)
        amplitude, turn = row[size], slope[phase]
        cosine, sine = math.cos(row[phase]), math.sin(row[phase])
        load[j], load[j + 1] = amplitude * cosine, -amplitude * sine
        dload[j] = slope[size] * cosine - amplitude * sine * turn
        dload[j + 1] = -slope[size] * sine - amplitude * cosine * turn


@compiled
def least_load(row: Real) -> float:
    """Return a bound from below of the load over a period [N], the least of it with one harmonic."""
    return float(row[N0] - _swing(row))


@compiled
def largest_load(row: Real) -> float:
    """Return a bound of |N| over a period [N]."""
    return float(abs(row[N0]) + _swing(row))


@compiled
def _swing(row: Real) -> float:
    """Return the sum of the amplitudes [N]."""
    swing = abs(row[N1])
    for column in range(COLUMNS, row.size, 2):
        swing += abs(row[column])
    return float(swing)


_CANCELLED, _LOST = 1e-3, 1e-5  # shares of |A| |F| and |A| |dF/dU| |u| a residual is relative to at least
_NO_WORK = 1e-13  # share of its terms below which a work is 0


@apart
def contact_values(system: System, p: float, added: float) -> tuple[Real, Real, Real, Real]:
    """Return the elements at λ = p: table, load coefficients, and the derivatives of both by λ.

    `added` [N] is put on every mean load (the start-up ladder presses the contacts into full stick).
    """
    nc = system.laws.size
    table, slope = np.empty(system.contacts.shape), np.zeros(system.contacts.shape)
    copy_block(table, system.contacts)
    for c in range(nc):
        row, d = table[c], slope[c]
        row[OMEGA] = system.omega
        if system.kind == FREQUENCY:
            row[OMEGA], d[OMEGA] = p, 1.0
        tied = not math.isnan(row[RATIO])
        if system.active[c] > 0.0 and system.kind >= COLUMN_KIND:
            column = system.kind - COLUMN_KIND
            row[column], d[column] = system.active[c] * p, system.active[c]
            tied = column == RATIO or (tied and column != N1)
        if system.kind == FREQUENCY:
            row[N0] += p * (system.load_rise[0, c] + p * system.load_rise[1, c])
            d[N0] = system.load_rise[0, c] + 2.0 * p * system.load_rise[1, c]
        if tied:
            tie(row, d)
    size = coefficient_count(system.load_ks)
    load, dload = np.empty((nc, size)), np.empty((nc, size))
    for c in range(nc):
        fill_load(table[c], slope[c], added, load[c], dload[c])
    return table, load, slope, dload


@compiled
def evaluate(system: System, linear: Receptance, u: Real, p: float, added: float, out: Evaluation) -> float:
    """Evaluate the balance at (u, λ = p) for a receptance already filled at p.

    Returns
    -------
    The relative residual, see `_residual` (NaN if a contact failed, or Z is singular).
    """
    return _evaluate(system, linear, u, p, added, False, out)


@compiled
def evaluate_forces(system: System, linear: Receptance, u: Real, p: float, out: Evaluation) -> float:
    """Evaluate the residual alone where that costs less: derivatives are not in place then.

    What is driven is that of λ = p (`prepare_forces`); A may be that of another λ, whose size alone is looked
    at where forces go through the modes. Where a constant force holds what no contact does the residual
    itself depends on derivatives.
    """
    return _evaluate(system, linear, u, p, 0.0, system.hold == 0, out)


@compiled
def prepare_forces(system: System, linear: Receptance, p: float) -> None:
    """Fill in what `evaluate_forces` needs of the receptance at λ = p."""
    if system.hold == 0 and goes_through_modes(system):
        driven_motions(system, p, linear)
    else:
        receptance(system, p, linear)


@compiled
def complete(system: System, linear: Receptance, u: Real, p: float, norm: float, out: Evaluation) -> float:
    """Put in place what `evaluate_forces` left out where it found the residual `norm`; return it anew."""
    through_modes = system.hold == 0 and goes_through_modes(system)
    if through_modes:
        receptance(system, p, linear)
    if system.hold == 0 and system.alone.sum() > 0:
        return evaluate(system, linear, u, p, 0.0, out)
    return _residual(system, linear, u, p, least_size(system, p), False, out) if through_modes else norm


@apart
def _evaluate(
    system: System, linear: Receptance, u: Real, p: float, added: float, alone: bool, out: Evaluation
) -> float:
    """Evaluate the balance; with `alone` without the derivatives of the laws that can do without."""
    for i in range(system.ks.size):
        if not math.isfinite(linear.x_linear[0, i].real):
            return np.nan
    if not evaluate_contacts(system, u, p, added, alone, out):
        return np.nan
    return _residual(system, linear, u, p, least_size(system, p), alone, out)


@apart
def evaluate_contacts(system: System, u: Real, p: float, added: float, alone: bool, out: Evaluation) -> bool:
    """Evaluate the forces of the contacts and their derivatives at (u, λ = p); False if a contact failed.

    The residual is left as it was. With `alone` the derivatives are left out of the laws that can do without.
    """
    table, load, slope, dload = contact_values(system, p, added)
    for e in range(system.laws.size):
        if not element(system, e, u, table[e], load[e], slope[e], dload[e], alone, out):
            return False
    return True


@compiled
def element(
    system: System, e: int, u: Real, table: Real, load: Real, slope: Real, dload: Real, alone: bool,
    out: Evaluation,
) -> bool:  # fmt: skip
    """Evaluate an element of any law, `alone`: its force alone if it can; False if it failed."""
    n, c, block = coefficient_count(system.ks), system.first_port[e], system.first_block[e]
    end, last = system.first_port[e + 1], system.first_block[e + 1]
    if alone and system.alone[e] == 1:
        last = block
    U = u[c * n : end * n].reshape((end - c, n))
    state, piece = call_law(
        system.laws[e], U, system.ks, load, system.load_ks, table, slope, dload, system.cos_table,
        system.sin_table, out.segments, out.F[c:end], out.dF_dU[block:last], out.dF_dp[c:end],
    )  # fmt: skip
    out.states[e], out.pieces[e], out.slopes[c:end] = state, piece, np.nan
    if system.jenkins[e] == 1:
        if state == SEPARATED:
            out.slopes[c] = 0.0
        elif state == STUCK and out.segments[0].began == UNLOADED:
            out.slopes[c] = table[KT]
    elif last > block and state != FAILED:
        springs_of(out.dF_dU[block:last], out.slopes[c:end])
    return bool(state != FAILED)


@compiled
def least_size(system: System, p: float) -> float:
    """Return the size of a motion below which only rounding is left of it [m], at the level λ = p."""
    if system.kind == LEVEL:
        return system.least_size * abs(p / system.level_reference)
    return system.least_size


@compiled
def _sizes(system: System, u: Real, out: Evaluation) -> tuple[float, float]:
    """Return the largest coefficient of the vibration, and the force that a residual of A F is relative to.

    That is a share of the largest force, or a smaller one of the motion times the slope of a force: the
    rounding of a motion, its mean included, reaches the force multiplied by it, which is what counts for
    stiff contacts.
    """
    n, first = coefficient_count(system.ks), 1 if system.ks[0] == 0 else 0
    motion, mean, force, steepest = 0.0, 0.0, 0.0, 0.0
    for c in range(system.owner.size):
        e = system.owner[c]
        ports, port = system.first_port[e + 1] - system.first_port[e], c - system.first_port[e]
        block = system.first_block[e] + port * ports + port
        for j in range(first, n):
            motion = max(motion, abs(u[c * n + j]))
            force = max(force, abs(out.F[c, j] - system.shift[c] * u[c * n + j]))
            steepest = max(steepest, abs(out.dF_dU[block, j, j]))
        if first == 1:
            mean = max(mean, abs(u[c * n]))
    return motion, max(_CANCELLED * force, _LOST * steepest * max(motion, mean))


@compiled
def _response(
    system: System, linear: Receptance, u: Real, i: int, c: int, out: Evaluation
) -> tuple[complex, complex, float]:
    """Return the motion of port c that the forces of harmonic number i make, and its slope by λ.

    The last number is the largest entry of the receptance to the port.
    """
    n, here, has_sine = coefficient_count(system.ks), cosine_position(system.ks, i), system.ks[i] > 0
    response, dresponse, reach = complex(0.0), complex(0.0), 0.0
    for d in range(system.owner.size):
        at = d * n + here
        stiffness = system.shift[d]
        fc = out.F[d, here] - stiffness * u[at]
        fs, dfs = 0.0, 0.0
        if has_sine:
            fs = out.F[d, here + 1] - stiffness * u[at + 1]
            dfs = out.dF_dp[d, here + 1]
        a, da = linear.A[0, i, c, d], linear.A[1, i, c, d]
        force, dforce = complex(fc, -fs), complex(out.dF_dp[d, here], -dfs)
        response += a * force
        dresponse += a * dforce + da * force
        reach = max(reach, abs(a.real) + abs(a.imag))
    return response, dresponse, reach


@apart
def _led_responses(
    system: System, linear: Receptance, u: Real, i: int, out: Evaluation, responses: Complex, reaches: Real
) -> None:
    """Fill the same of all ports, (2, nc) and (nc,), from the receptance of the leading ones."""
    nc, here, has_sine = system.owner.size, cosine_position(system.ks, i), system.ks[i] > 0
    n = coefficient_count(system.ks)
    forces, more = np.empty((2, nc), np.complex128), np.empty(nc, np.complex128)
    for d in range(nc):
        at, stiffness = d * n + here, system.shift[d]
        fc, fs, dfs = out.F[d, here] - stiffness * u[at], 0.0, 0.0
        if has_sine:
            fs, dfs = out.F[d, here + 1] - stiffness * u[at + 1], out.dF_dp[d, here + 1]
        forces[0, d], forces[1, d] = complex(fc, -fs), complex(out.dF_dp[d, here], -dfs)
    span_responses(system, linear.A[0, i], forces[0], responses[0])
    span_responses(system, linear.A[0, i], forces[1], responses[1])
    span_responses(system, linear.A[1, i], forces[0], more)
    for c in range(nc):
        responses[1, c] += more[c]
    span_reaches(system, linear.A[0, i], reaches)


@apart
def _responses_through_modes(
    system: System, linear: Receptance, u: Real, p: float, i: int, out: Evaluation, responses: Complex,
    reaches: Real,
) -> None:  # fmt: skip
    """Fill the same without the slopes by λ: (nc,) of `responses` from the modes at λ = p."""
    nc, here, has_sine = system.owner.size, cosine_position(system.ks, i), system.ks[i] > 0
    n, forces = coefficient_count(system.ks), responses[1]
    for d in range(nc):
        at, stiffness = d * n + here, system.shift[d]
        fc = out.F[d, here] - stiffness * u[at]
        forces[d] = complex(fc, stiffness * u[at + 1] - out.F[d, here + 1] if has_sine else 0.0)
        reaches[d] = 0.0
        for e in range(nc):
            a = linear.A[0, i, d, e]
            reaches[d] = max(reaches[d], abs(a.real) + abs(a.imag))
    modal_responses(system, p, i, forces, responses[0])
    fill(forces, 0.0)


@apart
def _residual(
    system: System, linear: Receptance, u: Real, p: float, least: float, alone: bool, out: Evaluation
) -> float:
    """Put r and dr/dλ together from the contact forces and the receptance.

    Each harmonic's residual is taken relative to the largest of its own ū and A F and of all motions: near an
    undamped resonance ū and A F of one harmonic are huge and cancel, and must not hide what is left of the
    others. Where A F is the difference of large forces only their rounding is left, see `_sizes`.
    """
    nc, n = system.owner.size, coefficient_count(system.ks)
    r, dr = out.residual, out.dr_dp
    motion, force_scale = _sizes(system, u, out)
    if system.loose.shape[0] > 0 and not alone:
        find_gauge(system, out)
    worst, check = 0.0, 0.0
    led = is_reduced(system, linear)
    through_modes = alone and goes_through_modes(system)
    some = nc if led or through_modes else 0
    responses, reaches = np.empty((2, some), np.complex128), np.empty(some)
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        scale, residual = max(least, motion), 0.0
        if led:
            _led_responses(system, linear, u, i, out, responses, reaches)
        elif through_modes:
            _responses_through_modes(system, linear, u, p, i, out, responses, reaches)
        for c in range(nc):
            row = c * n + here
            if led or through_modes:
                response, dresponse, reach = responses[0, c], responses[1, c], reaches[c]
            else:
                response, dresponse, reach = _response(system, linear, u, i, c, out)
            free, dfree = linear.u_linear[0, i, c], linear.u_linear[1, i, c]
            scale = max(scale, magnitude(free), reach * force_scale)
            if has_sine:
                # The mean of a part that nothing holds may drift without bound: it must not hide a residual.
                scale = max(scale, magnitude(response))
            r[row] = u[row] - free.real + response.real
            dr[row] = -dfree.real + dresponse.real
            residual = max(residual, abs(r[row]))
            check += r[row]
            if has_sine:
                r[row + 1] = u[row + 1] + free.imag - response.imag
                dr[row + 1] = dfree.imag - dresponse.imag
                residual = max(residual, abs(r[row + 1]))
                check += r[row + 1]
        if system.ks[i] == 0 and system.hold == 1 and system.loose.shape[0] > 0:
            let_hold(system, r, out)
            residual = 0.0
            for c in range(nc):
                residual = max(residual, abs(r[c * n]))
        if residual > 0.0:
            worst = max(worst, residual / scale if scale > 0.0 else residual)
    # `max` passes over NaN, a sum does not.
    return worst if math.isfinite(check) else np.nan


@apart
def friction_works(
    system: System, point: Evaluation, e: int, rubbing: Integer, solutions: Real, tangents: Real,
    works: Real, slopes: Real,
) -> None:  # fmt: skip
    """Fill in the work that friction takes out at contact `e` in a period [J], at points of a branch.

    Parameters
    ----------
    rubbing : the ports of the contact, counted from its first, along which it rubs.
    solutions, tangents : (P, nt + 1), λ last; works, slopes : (P,) filled, −inf and 0 where the law fails.
    """
    n, ks, first, block = coefficient_count(system.ks), system.ks, system.first_port[e], system.first_block[e]
    ports, last, begin = system.first_port[e + 1] - first, solutions.shape[1] - 1, 1 if ks[0] == 0 else 0
    for i in range(solutions.shape[0]):
        u, du, p = solutions[i, :last], tangents[i], solutions[i, last]
        table, load, slope, dload = contact_values(system, p, 0.0)
        works[i], slopes[i] = 0.0, 0.0
        if not element(system, e, u, table[e], load[e], slope[e], dload[e], False, point):
            works[i] = -math.inf
            continue
        for a in rubbing:
            done, size, rise = 0.0, 0.0, 0.0
            for j in range(begin, n):
                # F·dU/dτ: the cosine of the force meets the sine of the motion, and the other way round.
                k = float(ks[begin + (j - begin) // 2])
                order, other = (k, j + 1) if (j - begin) % 2 == 0 else (-k, j - 1)
                force, at = point.F[first + a, j], (first + a) * n + other
                change = du[last] * point.dF_dp[first + a, j]
                for b in range(ports):
                    for m in range(n):
                        change += point.dF_dU[block + a * ports + b, j, m] * du[(first + b) * n + m]
                done += force * order * u[at]
                size += abs(force * order * u[at])
                rise += order * (change * u[at] + force * du[at])
            if abs(done) > _NO_WORK * size:
                works[i] += math.pi * done
                slopes[i] += math.pi * rise
        if not math.isfinite(works[i]):
            works[i], slopes[i] = -math.inf, 0.0
