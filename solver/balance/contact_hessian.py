"""The forces of elastic Coulomb contacts with all they need to be differentiated twice by any numbers.

The force depends on X = kt U and Y = μ N alone. A change of kt is therefore one of U by U dkt/kt, a change of
μ one of N by N dμ/μ, and `solver.contacts.kernels.coulomb_hessian` along (U, N) gives every second
derivative.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver.balance.kernels.residual import contact_values
from solver.balance.parameter import Parameter
from solver.contacts.kernels.columns import KT, MU, N0, N1, PHASE, RATIO
from solver.contacts.kernels.coulomb import contact_force
from solver.contacts.kernels.coulomb_hessian import second_along
from solver.contacts.kernels.stick_slip_events import FAILED, SEGMENT_COLUMNS, segment_capacity
from solver.contacts.kernels.system import LOAD_COEFFICIENTS, System
from solver.errors import SettingError
from solver.jit.fourier import Complex, Integer, Real
from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactForces:
    """The forces of all contacts at a solution, with their derivatives and what the second ones need."""

    system: System
    load: Real  # (nc, 3)
    U: Real  # (nc, n)
    F: Real  # (nc, n)
    dF_dU: Real  # (nc, n, n)
    dF_dN: Real  # (nc, n, 3)
    dF_dkt: Real  # (nc, n)
    dF_dmu: Real  # (nc, n)
    states: Integer  # (nc,)
    counts: Integer  # (nc,)
    segments: Real  # (nc, capacity, columns)

    def along(self, slopes: Real, loads: Real) -> Real:
        """Return ∂F/∂p, (n_paths, nc, n), for derivatives of the contact table and of the loads."""
        return np.asarray(
            slopes[..., KT, None] * self.dF_dkt
            + slopes[..., MU, None] * self.dF_dmu
            + np.einsum("cij,pcj->pci", self.dF_dN, loads)
        )

    def second(self, c: int, w: Real, dU: Real, dN: Real, dkt: float, dmu: float) -> tuple[Real, Real, Real]:
        """Differentiate the gradient of w·F of contact `c` by U, N and (kt, μ) along a direction."""
        system = self.system
        kt, mu = float(system.contacts[c, KT]), float(system.contacts[c, MU])
        by_U, by_N = np.empty(w.size), np.empty(LOAD_COEFFICIENTS)
        stretch = dkt / kt
        swell = 0.0 if dmu == 0.0 else dmu / mu if mu != 0.0 else math.nan
        by_kt, by_mu = second_along(
            self.U[c], system.ks, self.load[c], system.load_ks, kt, mu, self.states[c], self.segments[c],
            self.counts[c], self.dF_dU[c], self.dF_dN[c], w, dU + stretch * self.U[c],
            dN + swell * self.load[c], by_U, by_N,
        )  # fmt: skip
        if dkt != 0.0:
            by_U += stretch * (w @ self.dF_dU[c])
            by_kt -= stretch * float(w @ self.dF_dkt[c])
        if dmu != 0.0:
            by_N += swell * (w @ self.dF_dN[c])
            by_mu -= swell * float(w @ self.dF_dmu[c])
        return by_U, by_N, np.array([by_kt, by_mu])


def contact_forces(system: System, u: Real) -> ContactForces:
    """Evaluate all contacts of a system whose contacts are elastic Coulomb ones.

    Raises
    ------
    FloatingPointError
        The law has no answer at `u`.
    """
    nc, n, m = system.laws.size, u.size // max(system.laws.size, 1), LOAD_COEFFICIENTS
    rows, U = system.contacts, u.reshape(nc, n)
    _, load, _, _ = contact_values(system, 0.0, 0.0)
    F, dF_dU, dF_dN = np.empty((nc, n)), np.empty((nc, n, n)), np.empty((nc, n, m))
    dF_dkt, dF_dmu = np.empty((nc, n)), np.empty((nc, n))
    states, counts = np.zeros(nc, np.int64), np.zeros(nc, np.int64)
    segments = np.zeros((nc, segment_capacity(max(int(system.ks[-1]), 1)), SEGMENT_COLUMNS))
    for c in range(nc):
        states[c], counts[c] = contact_force(
            U[c], system.ks, load[c], system.load_ks, rows[c, KT], rows[c, MU], system.cos_table,
            system.sin_table, segments[c], dF_dU[c], dF_dkt[c], dF_dmu[c], dF_dN[c], F[c],
        )  # fmt: skip
        if states[c] == FAILED:
            raise FloatingPointError("a contact force has no answer")
    return ContactForces(
        system=system, load=load, U=U, F=F, dF_dU=dF_dU, dF_dN=dF_dN, dF_dkt=dF_dkt, dF_dmu=dF_dmu,
        states=states, counts=counts, segments=segments,
    )  # fmt: skip


def check_laws(scene: Scene) -> None:
    """Raise SettingError if a contact is not elastic Coulomb friction under a given load."""
    others = [contact.name for contact in scene.contacts if not contact.JENKINS]
    if others:
        wanted = f"has contacts with another law than coulomb ({', '.join(others)})"
        raise SettingError("scene", scene.name, f"{wanted}, so only its gradient is exact here")


def check_loads(system: System, parameters: Sequence[Parameter], slopes: Real) -> None:
    """Raise SettingError where paths of one load contradict each other.

    N1_ratio ties N1 to N0 and N1 unties it: what both, or N0 beside one that changes this, mean together is
    not one function of the parameters.
    """
    tied = ~np.isnan(system.contacts[:, RATIO])
    by_mean, by_ratio = (np.any(slopes[:, :, column] != 0.0, axis=0) for column in (N0, RATIO))
    by_amplitude = np.any((slopes[:, :, N1] != 0.0) & (slopes[:, :, [N0, RATIO]] == 0.0).all(axis=2), axis=0)
    clash = (by_ratio & by_amplitude) | (by_mean & by_amplitude & tied) | (by_mean & by_ratio & ~tied)
    if clash.any():
        paths = [p.path for p in parameters if np.any(p.active[clash] > 0.0)]
        raise SettingError("paths", paths, "contradict each other: give the scene N1_ratio or N1 first")


def second_loads(system: System, slopes: Real) -> Real:
    """Return ∂²N/∂p_i∂p_j, (n_paths, n_paths, nc, 3), of the loads N0, N1 cos(phase), −N1 sin(phase).

    N1 = N1_ratio·N0 is a product where it is tied.
    """
    rows = system.contacts
    cosine, sine, size = np.cos(rows[:, PHASE]), np.sin(rows[:, PHASE]), rows[:, N1]

    def pair(one: int, other: int) -> Real:
        product = np.einsum("ic,jc->ijc", slopes[..., one], slopes[..., other])
        return np.asarray(product + product.transpose(1, 0, 2))

    amplitude, turned, twice = pair(N0, RATIO), pair(N1, PHASE), 0.5 * pair(PHASE, PHASE)
    along = amplitude - size * twice
    return np.stack(
        [np.zeros(along.shape), along * cosine - turned * sine, -along * sine - turned * cosine], axis=-1
    )


def second_forces(ks: Integer, forces: Complex, level: Real, phase: Real) -> Complex:
    """Return ∂²f/∂p_i∂p_j, (n_paths, n_paths, nk, N), from df/f of each path: real `level`, and `phase`."""
    moving = (ks > 0).astype(np.float64)
    rates = level[:, None] + 1j * phase[:, None] * moving
    products = np.einsum("ik,jk->ijk", rates, rates)
    # A level is a factor: by it alone f is linear.
    products -= np.outer(level, level)[:, :, None]
    return np.asarray(products[..., None] * forces)
