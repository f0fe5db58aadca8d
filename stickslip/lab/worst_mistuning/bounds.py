"""What no mistuning can make of a linear disk: bounds of the amplification by the power that damping takes.

The power of the force and of the damping balance: with D = (Z − Zᴴ)/2i, xᴴ D x = Im(xᴴ f). So D^½ x lies in
a ball around D^−½ f/2i, whatever Hermitian terms mistuning adds, and for every row g

    |gᵀ x| ≤ ½ (|gᵀ D⁻¹ f| + √(gᵀ D⁻¹ ḡ · fᴴ D⁻¹ f)).

Of N equally damped blades that is Whitehead's bound, of a family of travelling waves Martel's.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from stickslip.lab.worst_mistuning.linear_disk import LinearDisk
from stickslip.lab.worst_mistuning.tuned_modes import TunedModes

_ONE_WAVE = 1e-9  # share of a force in other waves that is rounding
_NEAR = 1e-9  # relative distance of a natural frequency from a peak that is none


def whitehead(sectors: int) -> float:
    """Return the largest amplification of equally damped blades, (1 + √N)/2.

    D. S. Whitehead, J. Mech. Eng. Sci. 8 (1966) 15, doi:10.1243/JMES_JOUR_1966_008_004_02.
    """
    return 0.5 * (1.0 + math.sqrt(sectors))


def martel(disk: LinearDisk, modes: TunedModes, omega: float) -> float:
    """Return the largest amplification of a family of tuned modes with dampings d_n of their own.

    ½ (1 + √(Σ_n (|φ_n|²/d_n) / (|φ_r|²/d_r))), φ_n the observed motion of the mass-normalised mode of nodal
    diameter n, d_n = φ_nᴴ D(ω_n) φ_n: C. Martel, J. J. Sánchez-Álvarez, J. Sound Vib. 397 (2017) 108 (there
    with shapes that are alike). Asymptotic: of little damping and mistuning, one family apart from others.

    Of every nodal diameter that mode counts whose shape is most like the one that is excited.

    Parameters
    ----------
    disk : in all its coordinates.
    modes : of it.
    omega : where the tuned disk has its peak [rad/s].

    Returns
    -------
    NaN where a mode of the family is not damped, or the force is no travelling wave.
    """
    N = disk.sectors
    pushed = np.einsum("nma,m->na", modes.shapes.conj(), disk.force)
    strength = np.linalg.norm(pushed, axis=1)
    r = int(strength.argmax())
    if np.any(np.delete(strength, r) > _ONE_WAVE * strength[r]):
        return math.nan
    seen = np.abs(np.einsum("m,nma->na", disk.observed[0], modes.shapes)) ** 2
    driven = np.abs(pushed[r]) ** 2 * seen[r] / (_NEAR + np.abs(modes.omega[r] / omega - 1.0))
    size = modes.shapes.shape[2]
    like = disk.M[:size, :size] @ modes.shapes[r, :size, int(driven.argmax())]
    shares = np.empty(N)
    for n in range(N):
        member = int(np.abs(modes.shapes[n, :size].conj().T @ like).argmax())
        phi = modes.shapes[n, :, member]
        taken = float((phi.conj() @ disk.loss(max(float(modes.omega[n, member]), 1e-300)) @ phi).real)
        shares[n] = seen[n, member] / taken if taken > 0.0 else math.nan
    return 0.5 * (1.0 + math.sqrt(float(shares.sum() / shares[r])))


def power_bound(disk: LinearDisk, omega: float, tuned: float) -> float:
    """Return the largest amplification at a frequency by the balance of powers, as this module says it.

    Parameters
    ----------
    disk : in all its coordinates.
    omega : of the excitation [rad/s].
    tuned : highest peak of the tuned disk [m].

    Returns
    -------
    NaN where mistuning changes the damping too, or damping does not take power from every motion.
    """
    changes = [own - own.conj().T for own in (disk.own[0], disk.own[2])]
    if disk.modal_damping or np.any(changes) or np.any(disk.own[1]):
        return math.nan
    try:
        factor = cho_factor(disk.loss(omega))
    except np.linalg.LinAlgError:
        return math.nan
    by_force = cho_solve(factor, disk.force)
    spent = float((disk.force.conj() @ by_force).real)
    most = max(
        abs(row @ by_force) + math.sqrt(spent * float((row @ cho_solve(factor, row.conj())).real))
        for row in disk.observed
    )
    return float(0.5 * most / tuned)
