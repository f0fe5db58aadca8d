"""Where a resonance may matter, told from points of a branch and from where resonances may stand alone."""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.system import MODES, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Flags, Integer, Real, coefficient_count, cosine_position
from solver.jit.separate import apart


@compiled
def amplitude_in(row: Real, c: int, ks: Integer, i: int) -> float:
    """Return the amplitude of harmonic number i of motion number c in a row of coefficients."""
    here = c * coefficient_count(ks) + cosine_position(ks, i)
    return abs(row[here]) if ks[i] == 0 else math.hypot(row[here], row[here + 1])


@apart
def _fill_shares(
    ks: Integer, solutions: Real, observed: Real, begin: Integer, counts: Real, least: float, moves: float,
    shares: Real,
) -> None:  # fmt: skip
    """Fill how large each harmonic is at the ends of intervals, relative to what matters there, (P, nk)."""
    nk, nc = ks.size, (solutions.shape[1] - 1) // coefficient_count(ks)
    moved, largest = np.empty((solutions.shape[0], nk, nc)), np.zeros((solutions.shape[0], nc))
    for row in range(solutions.shape[0]):
        for c in range(nc):
            for i in range(nk):
                moved[row, i, c] = amplitude_in(solutions[row], c, ks, i)
                largest[row, c] = max(largest[row, c], moved[row, i, c])
    for p in range(begin.size):
        a, b = begin[p], begin[p] + 1
        for i in range(nk):
            size = max(amplitude_in(observed[a], 0, ks, i), amplitude_in(observed[b], 0, ks, i))
            shares[p, i] = size / max(counts[p], 1e-300)
        for c in range(nc):
            whole = max(moves * max(least, largest[a, c], largest[b, c]), 1e-300)
            for i in range(nk):
                shares[p, i] = max(shares[p, i], max(moved[a, i, c], moved[b, i, c]) / whole)


@apart
def find_suspects(
    system: System, low: Real, high: Real, half_width: Real, solutions: Real, observed: Real, begin: Integer,
    counts: Real, least: float, moves: float, flanks: float, resolved: float, flags: Flags,
) -> None:  # fmt: skip
    """Find the intervals of a branch in which a harmonic may meet a resonance narrower than they are.

    Parameters
    ----------
    low, high, half_width : (ns, nm) where the resonances of a structure may stand, in units of kω, and half
        of the least width they may have there.
    solutions, observed : (N, nt + 1) and (N, n) points of the branch, λ last [rad/s].
    begin : (P,) the point each interval begins at; it ends at the next.
    counts : (P,) change of the observed motion that matters in each interval [m].
    least : motions of contacts below are rounding [m].
    moves : share of the motion of a contact by which it has to change to matter.
    flanks : how much lower than its flanks suggest a resonance may look at the ends of an interval.
    resolved : half widths that an interval may be long.
    flags : (nk, P) filled.
    """
    ks, last = system.ks, solutions.shape[1] - 1
    shares = np.empty((begin.size, ks.size))
    _fill_shares(ks, solutions, observed, begin, counts, least, moves, shares)
    for p in range(begin.size):
        one, other = solutions[begin[p], last], solutions[begin[p] + 1, last]
        for i in range(ks.size):
            flags[i, p] = False
            if ks[i] == 0:
                continue
            s, k = system.which[i], float(ks[i])
            short = max(resolved, 1.0 / max(flanks * shares[p, i], 1e-300))
            for m in range(low.shape[1]):
                meets = low[s, m] / k <= max(one, other) and high[s, m] / k >= min(one, other)
                if meets and short * (half_width[s, m] / k) < abs(other - one):
                    flags[i, p] = True
                    break


@compiled
def _driven(system: System, forces: Complex, i: int) -> float:
    """Return the largest norm of what forces (P, nk, nc) of harmonic number i drive in the modes."""
    s, largest = system.which[i], 0.0
    for p in range(forces.shape[0]):
        total = 0.0
        for m in range(system.contact_duals.shape[2]):
            pushed = complex(0.0)
            for c in range(forces.shape[2]):
                if not math.isnan(abs(forces[p, i, c])):
                    pushed += forces[p, i, c] * system.contact_duals[s, c, m]
            total += abs(pushed) ** 2
        largest = max(largest, math.sqrt(total))
    return largest


@apart
def find_reaching(
    system: System, low: Real, high: Real, half_width: Real, solutions: Real, amplitude: Real,
    forces: Complex, beyond: Integer, near: float, feedback: float, reached: float, may: Flags,
) -> None:  # fmt: skip
    """Find the harmonics that may reach above an amplitude at a resonance.

    Parameters
    ----------
    low, high, half_width : (ns, nm) as in `find_suspects`.
    solutions, amplitude : (P, …) and (P,) points of a branch, λ last [rad/s], and their amplitude [m].
    forces : (S, nk, nc) amplitudes of the contact forces at some points [N]; NaN counts as none.
    beyond : (n,) numbers of the harmonics that are looked at.
    near : how far beyond the places of a resonance the amplitude counts, as a factor.
    feedback : what a resonance adds may be so many times what the forces drive.
    reached : the amplitude [m].
    may : (n,) filled.
    """
    at = solutions[:, solutions.shape[1] - 1]
    least, highest = np.min(amplitude), np.max(amplitude)
    slowest, fastest = np.min(at), np.max(at)
    for j in range(beyond.size):
        may[j] = False
        i = beyond[j]
        s, k = system.which[i], float(system.ks[i])
        seen = 0.0
        for m in range(low.shape[1]):
            seen += abs(system.observe_modes[s, m]) ** 2
        driven = math.sqrt(seen) * _driven(system, forces, i)
        for m in range(low.shape[1]):
            if low[s, m] / k > fastest or high[s, m] / k < slowest:
                continue
            slow = 2.0 * k * max(low[s, m] / k, slowest) if system.form == MODES else 1.0
            narrow = slow * half_width[s, m]
            added = feedback * (driven / narrow if narrow > 0.0 else math.inf)
            if highest + added <= reached:
                continue
            stands = least
            for p in range(at.size):
                if low[s, m] / k / near <= at[p] <= high[s, m] / k * near:
                    stands = max(stands, amplitude[p])
            if stands + added > reached:
                may[j] = True
                break
