"""Whether forces in the contacts can drive the observed motion above a limit between two points of a branch.

Between the points λ = ω, the forces and the contacts' answer to small changes are taken as linear in
t ∈ [−1, 1]. The motion that the forces F of harmonic k add is x = o D⁻¹ f with f = Yᵀ F and, in the words of
`solver.balance.closed_loop_poles`,

    modes:  D = diag(ω_m² − (kω)² + ikω c_m) + Yᵀ ĝ X,     poles:  D = diag(ikω − s_m) + Yᵀ ĝ X,

so D = D_c + t E − t² e with numbers e. With R = D_c⁻¹, y = R f and a = o R the Neumann series gives

    |x| ≤ |o y| + |a E_t y| + ‖a E_t‖ ‖R E_t y‖ / (1 − ‖R E_t‖),     E_t = t E − t² e,

wherever ‖R E_t‖ < 1. Each term is bounded for all t by the triangle inequality, and the norm of a matrix by
the least of √(Σ|·|²) and √(‖·‖₁ ‖·‖∞). No eigenvalue is needed, and an inverse costs far less than they do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.balance.closed_loop_poles import MOST_MODES, coupled
from solver.contacts.kernels.system import DENSE, MODES, System
from solver.jit.fourier import Complex, Flags, Integer, Real

_MOST_HALVINGS = 2  # of the way between two points: more would cost what the eigenvalues do
_MOST_ENTRIES = 1_000_000  # of the matrices that are looked at together


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Way:
    """Ways between two points each, S of them, for one harmonic each."""

    numbers: Annotated[Integer, "(S,) of the harmonics in `System.ks`, not the mean."]
    at: Annotated[Real, "(S, 2) ω at both ends [rad/s]."]
    stiffness: Annotated[
        Complex, "(S, 2, nc, nc) of the contacts against small changes of the harmonic [N/m]."
    ]
    forces: Annotated[Complex, "(S, 2, nc) amplitudes of it [N], less what the shift carries."]

    def only(self, some: Integer | Flags) -> Way:
        """Return some of them."""
        return Way(
            numbers=self.numbers[some], at=self.at[some], stiffness=self.stiffness[some],
            forces=self.forces[some],
        )  # fmt: skip


def may_exceed(system: System, way: Way, allowed: Real) -> Flags:
    """Return whether the observed motion may exceed `allowed` (S,) [m]; True where it is not told."""
    may = np.ones(len(allowed), bool)
    if system.form == DENSE or system.eigenvalues.shape[1] > MOST_MODES:
        return may
    rows = np.arange(len(allowed))
    most = max(1, _MOST_ENTRIES // system.eigenvalues.shape[1] ** 2)
    for some in np.split(rows, range(most, rows.size, most)):
        may[some] = _may_exceed(system, way.only(some), allowed[some])
    return may


def _may_exceed(system: System, way: Way, allowed: Real) -> Flags:
    """Return the same of ways that are looked at together: those not told are halved."""
    s = np.zeros(1, np.int64) if system.eigenvalues.shape[0] == 1 else system.which[way.numbers]
    X, Y = system.contact_modes[s], system.contact_duals[s]
    nothing = np.zeros((1, X.shape[2]), np.complex128)
    springs = np.stack(
        [coupled(nothing, None, X, Y, way.stiffness[:, end] - np.diag(system.shift)) for end in (0, 1)],
        axis=1,
    )
    driven = way.forces @ Y
    may = np.zeros(len(allowed), bool)
    pieces = [(np.arange(len(allowed)), 0.0, 1.0)]
    for _ in range(_MOST_HALVINGS + 1):
        left = []
        for rows, begin, end in pieces:
            known = _bound(system, way.numbers[rows], *(
                (1.0 - part) * x[rows, 0] + part * x[rows, 1]
                for x in (way.at, springs, driven) for part in (begin, end)
            )) <= allowed[rows]  # fmt: skip
            middle = 0.5 * (begin + end)
            left += [(rows[~known], begin, middle), (rows[~known], middle, end)]
        pieces = left
    for rows, *_ in pieces:
        may[rows] = True
    return may


def _bound(
    system: System, numbers: Integer, begin: Real, end: Real, left: Complex, right: Complex, f_left: Complex,
    f_right: Complex,
) -> Real:  # fmt: skip
    """Return the bound (S,) on ways from ω = `begin` to `end`, with Yᵀ ĝ X and f at both ends."""
    s, k = system.which[numbers], system.ks[numbers].astype(np.float64)[:, None]
    middle, half = 0.5 * k * (begin + end)[:, None], 0.5 * k * (end - begin)[:, None]
    values, o = system.eigenvalues[s], system.observe_modes[s]
    if system.form == MODES:
        dampings = system.dampings[s]
        here, slope = values - middle**2 + 1j * middle * dampings, -2.0 * middle * half + 1j * half * dampings
        bend: Real = np.square(half[:, 0])
    else:
        here, slope, bend = 1j * middle - values, 1j * half + 0.0 * values, np.zeros(len(k))
    D, E = 0.5 * (left + right), 0.5 * (right - left)
    diagonal = np.arange(values.shape[1])
    D[:, diagonal, diagonal] += here
    E[:, diagonal, diagonal] += slope
    try:
        R = np.asarray(np.linalg.inv(D), np.complex128)
    except np.linalg.LinAlgError:
        return np.full(len(k), np.inf)  # exactly at a resonance
    RE = np.asarray(R @ E, np.complex128)
    far: Real = np.asarray(_norm(RE) + bend * _norm(R))
    f = np.stack([0.5 * (f_left + f_right), 0.5 * (f_right - f_left)], axis=2)
    y, a = R @ f, (o[:, None, :] @ R)[:, 0]
    aE = (o[:, None, :] @ RE)[:, 0]
    direct = np.abs(np.einsum("sm,smj->sj", o, y)).sum(axis=1)
    first = np.abs(np.einsum("sm,smj->sj", aE, y)).sum(axis=1)
    first += bend * np.abs(np.einsum("sm,smj->sj", a, y)).sum(axis=1)
    moved = np.linalg.norm(RE @ y, axis=1).sum(axis=1) + bend * np.linalg.norm(R @ y, axis=1).sum(axis=1)
    more = (np.linalg.norm(aE, axis=1) + bend * np.linalg.norm(a, axis=1)) * moved
    return np.where(far < 1.0, direct + first + more / np.maximum(1.0 - far, 1e-300), np.inf)


def _norm(matrices: Complex) -> Real:
    """Return a bound (S,) of the largest singular values."""
    sizes = np.abs(matrices)
    across = sizes.sum(axis=1).max(axis=1, initial=0.0) * sizes.sum(axis=2).max(axis=1, initial=0.0)
    found: Real = np.sqrt(np.minimum(across, np.square(sizes).sum(axis=(1, 2))))
    return found
