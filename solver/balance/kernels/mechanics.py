"""The judge of every answer: whether a solution of the balance obeys mechanics.

A residual is one of displacements, relative to the largest of what cancels in it: of a light part far away,
or of forces that nearly balance over next to no inertia, it is small whatever the forces are. Mechanics asks
whether the power put in is taken out, and whether the mean forces balance.

With x the motion of the structure under the excitation and the contacts' forces, on springs s at the ports,
L x = u − r and (Z + Lᴴ s L) x = f − Lᴴ (F − s u). What the excitation puts in less what dampers take out then
passes the ports, ½ Re Σ (F − s r)ᴴ ikω (u − r), while the contacts take out ½ Re Σ Fᴴ ikω u: of each port's
½ kω |F| |u| there is lost at most ½ kω (|F| |r| + s |r| |u|). Moduli, so that no two errors cancel; and no
motion of all coordinates is needed.

Any springs will do: r = (I + A s)⁻¹ (u − ū + A F) is an error of motions with soft ones and one of forces
with stiff ones. Those of the balance (`shift`) are taken first; where they say too much is lost, those of the
contacts, with which what a stiff one deforms is not looked for in the rounding of large motions.

The size of a motion follows: where no more is lost, x is the response of the linear structure to the
excitation and to forces that friction can carry, but for that share of them. No amplitude beyond these
remains, and a part that contacts alone hold is judged by what acts on it and not by kt u.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.coordinates import on_springs
from solver.contacts.kernels.system import Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Real, coefficient_count, cosine_position, magnitude
from solver.jit.separate import apart

# Largest share of powers and of mean forces that an answer may lose. Newton's method leaves 1e-11 of motions,
# of which s u / F, how far a contact slips beyond what its spring gives, is a multiple: of random scenes of
# all kinds 1e-11 to 1e-9 is lost. Where rounding leaves more than this, figures of the answer are wrong.
ALLOWED = 1e-6
_ROUNDING = 1e-15  # of the place of a part, from which the forces on it are found


@apart
def unaccounted(system: System, linear: Receptance, u: Real, point: Evaluation) -> float:
    """Return the share of powers, or of mean forces, that (u, λ) loses, where last evaluated; NaN if unknown.

    Mean forces are those along the motions of parts that contacts alone hold, relative to the forces that
    act along them; the structure's own stiffness balances all others.
    """
    share = _power_share(system, linear, u, point, point.residual, system.shift)
    if share > ALLOWED:
        stiffer, more = np.empty(u.size), np.empty(system.owner.size)
        springs = np.empty(system.owner.size)
        for c in range(system.owner.size):
            springs[c] = max(system.contacts[system.owner[c], system.held[c, 0]], system.shift[c])
            more[c] = springs[c] - system.shift[c]
        if _on_stiffer(system, linear, point, more, stiffer):
            share = min(share, _power_share(system, linear, u, point, stiffer, springs))
    if system.ks[0] == 0 and system.loose.shape[0] > 0:
        share = max(share, _mean_share(system, linear, u, point))
    return share


@compiled
def _power_share(
    system: System, linear: Receptance, u: Real, point: Evaluation, residual: Real, springs: Real
) -> float:
    """Return the power lost by a residual on springs (nc,), relative to what the ports could carry."""
    n, first = coefficient_count(system.ks), 1 if system.ks[0] == 0 else 0
    carried, lost = 0.0, 0.0
    for c in range(system.owner.size):
        for i in range(first, system.ks.size):
            here = cosine_position(system.ks, i)
            at = c * n + here
            force = magnitude(complex(point.F[c, here], point.F[c, here + 1]))
            moved = magnitude(complex(u[at], u[at + 1]))
            off = magnitude(complex(residual[at], residual[at + 1]))
            acts = max(force, system.shift[c] * magnitude(linear.u_linear[0, i, c]))
            carried += system.ks[i] * acts * max(moved, system.least_size)
            off_force = springs[c] * off + system.shift[c] * _ROUNDING * moved
            lost += system.ks[i] * (force * off + off_force * moved)
    if not math.isfinite(lost + carried):
        return math.nan
    return lost / carried if carried > 0.0 else 0.0


@apart
def _on_stiffer(system: System, linear: Receptance, point: Evaluation, more: Real, out: Real) -> bool:
    """Fill `out` with the residual on springs that are stiffer than the shift by `more`; False: unknown."""
    nc, n = system.owner.size, coefficient_count(system.ks)
    here, there = np.empty(nc, np.complex128), np.empty(nc, np.complex128)
    for i in range(system.ks.size):
        at, has_sine = cosine_position(system.ks, i), system.ks[i] > 0
        for c in range(nc):
            here[c] = complex(
                point.residual[c * n + at], -point.residual[c * n + at + 1] if has_sine else 0.0
            )
        if not on_springs(system, linear, i, more, here, there):
            return False
        for c in range(nc):
            out[c * n + at] = there[c].real
            if has_sine:
                out[c * n + at + 1] = -there[c].imag
    return True


@apart
def _mean_share(system: System, linear: Receptance, u: Real, point: Evaluation) -> float:
    """Return the largest mean force on a loose part, relative to the largest force along any such motion.

    Of its rigid-body motions l, Σ_c l_c s_c r_c is the sum of all mean forces along them.
    """
    n, left, size, lost = coefficient_count(system.ks), 0.0, 0.0, 0.0
    for i in range(system.loose.shape[0]):
        force, applied, held, rounding = 0.0, 0.0, 0.0, 0.0
        for c in range(system.owner.size):
            part, largest = system.loose[i, c], 0.0
            for j in range(n):
                largest = max(largest, abs(point.F[c, j]))
            force += part * system.shift[c] * point.residual[c * n]
            applied += part * system.shift[c] * linear.u_linear[0, 0, c].real
            held += abs(part) * largest
            rounding += abs(part) * system.shift[c] * abs(u[c * n])
        left, size = max(left, abs(force)), max(size, held, abs(applied), abs(force))
        lost = max(lost, _ROUNDING * rounding)
    return (left + lost) / size if size > 0.0 else 0.0
