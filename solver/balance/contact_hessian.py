"""The forces of all contacts with all they need to be differentiated twice by any numbers.

What differs from law to law is behind `solver.contacts.kernels.laws`; here stands what the numbers of
a scene do to rows, loads and excitation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from solver.balance.balance import Parameter
from solver.balance.kernels.residual import contact_values
from solver.contacts.kernels.laws import law_force, law_second, second_number
from solver.contacts.kernels.stick_slip_events import FAILED, new_segments
from solver.contacts.kernels.system import System
from solver.contacts.laws.contact_law import without_second
from solver.contacts.laws.load_harmonics import contradicting
from solver.errors import SettingError
from solver.jit.fourier import Complex, Integer, Real, coefficient_count
from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactForces:
    """The forces of all contacts at a solution with their derivatives; ne elements with nc ports in all."""

    system: System
    seconds: Integer  # (ne,) numbers of the kernels of second derivatives
    table: Real  # (ne, ·)
    load: Real  # (ne, 1 + 2 K)
    U: Real  # (nc, n)
    F: Real  # (nc, n)
    dF_dU: Real  # (blocks, n, n)
    dF_dN: Real  # (nc, n, 1 + 2 K) by the given load

    def ports(self, e: int) -> slice:
        """Return the ports of an element."""
        return slice(int(self.system.first_port[e]), int(self.system.first_port[e + 1]))

    def _blocks(self) -> Iterator[tuple[slice, Real]]:
        """Yield the ports of each element with its ∂F/∂U, (m, m, n, n)."""
        for e in range(self.system.laws.size):
            ports, first = self.ports(e), int(self.system.first_block[e])
            m = ports.stop - ports.start
            yield ports, self.dF_dU[first : first + m * m].reshape(m, m, *self.dF_dU.shape[1:])

    def times(self, dU: Real) -> Real:
        """Return ∂F/∂U dU, (P, nc, n), of motions (P, nc, n)."""
        product = np.empty(dU.shape)
        for ports, blocks in self._blocks():
            product[:, ports] = np.einsum("abij,pbj->pai", blocks, dU[:, ports])
        return product

    def times_transposed(self, w: Real) -> Real:
        """Return ∂F/∂Uᵀ w, (nc, n), of weights (nc, n)."""
        product = np.empty(w.shape)
        for ports, blocks in self._blocks():
            product[ports] = np.einsum("abij,ai->bj", blocks, w[ports])
        return product

    def along(self, slopes: Real, loads: Real) -> Real:
        """Return ∂F/∂p, (P, nc, n), for derivatives of the contact table and of the loads."""
        found = np.einsum("cij,pcj->pci", self.dF_dN, loads[:, self.system.owner])
        for e in range(self.system.laws.size):
            for i in np.flatnonzero(np.any(slopes[:, e] != 0.0, axis=1)):
                found[i, self.ports(e)] += self._law(e, slopes[i, e], np.zeros(self.load.shape[1]))[2]
        return np.asarray(found)

    def second(self, e: int, w: Real, dU: Real, drow: Real, dload: Real) -> tuple[Real, Real, Real]:
        """Differentiate the gradient of w·F of an element by motions, row and load along a direction."""
        system, U = self.system, self.U[self.ports(e)]
        by_U, by_row, by_load = np.empty(U.shape), np.empty(self.table.shape[1]), np.empty(self.load.shape[1])
        state = law_second(
            self.seconds[e], U, system.ks, self.load[e], system.load_ks, self.table[e], system.cos_table,
            system.sin_table, w, dU, drow, dload, by_U, by_row, by_load,
        )  # fmt: skip
        if state == FAILED:
            raise FloatingPointError("a contact force has no answer")
        return by_U, by_row, by_load

    def _law(self, e: int, slope: Real, dload: Real) -> tuple[Real, Real, Real]:
        """Return force, Jacobian and derivative along a change of row and load."""
        system, U = self.system, self.U[self.ports(e)]
        m, n = U.shape
        F, dF_dU, dF_dp = np.empty((m, n)), np.empty((m * m, n, n)), np.empty((m, n))
        segments = new_segments(int(max(system.ks[-1], system.load_ks[-1])))
        state, _ = law_force(
            system.laws[e], U, system.ks, self.load[e], system.load_ks, self.table[e], slope, dload,
            system.cos_table, system.sin_table, segments, F, dF_dU, dF_dp,
        )  # fmt: skip
        if state == FAILED:
            raise FloatingPointError("a contact force has no answer")
        return F, dF_dU, dF_dp

    def fill(self) -> None:
        """Evaluate all contacts."""
        for e in range(self.system.laws.size):
            ports, blocks = self.ports(e), slice(*map(int, self.system.first_block[e : e + 2]))
            for j in range(self.load.shape[1]):
                self.F[ports], self.dF_dU[blocks], self.dF_dN[ports, :, j] = self._law(
                    e, np.zeros(self.table.shape[1]), np.eye(self.load.shape[1])[j]
                )


def contact_forces(system: System, seconds: Integer, u: Real) -> ContactForces:
    """Evaluate all contacts by the kernels `seconds`; FloatingPointError where a law has no answer at `u`."""
    nc, n = system.owner.size, coefficient_count(system.ks)
    table, load, _, _ = contact_values(system, 0.0, 0.0)
    found = ContactForces(
        system=system, seconds=seconds, table=table, load=load, U=u.reshape(nc, n), F=np.empty((nc, n)),
        dF_dU=np.empty((int(system.first_block[-1]), n, n)), dF_dN=np.empty((nc, n, load.shape[1])),
    )  # fmt: skip
    found.fill()
    return found


def second_numbers(scene: Scene) -> Integer:
    """Return the kernels of the second derivatives of all contacts, (n_contacts,), which all have some."""
    kernels = [contact.second_kernel for contact in scene.contacts]
    return np.array([second_number(kernel) for kernel in kernels if kernel is not None], dtype=np.int64)


def check_laws(scene: Scene) -> None:
    """Raise SettingError if the law of a contact has no second derivatives."""
    others = without_second(scene.contacts)
    if others:
        wanted = f"has contacts whose law has no second derivatives: {others}"
        raise SettingError("scene", scene.name, f"{wanted}; only its gradient is exact here")


def check_measure(scene: Scene) -> None:
    """Raise SettingError where what is observed is at two places at once: no tracked peak follows it."""
    if scene.observe.centred:
        wanted = "is followed by sweeps, not by its peak: use `max_abs`"
        raise SettingError("observe.measure", scene.observe.measure, wanted)


def check_no_line(scene: Scene) -> None:
    """Raise SettingError where loads, forces or matrices follow the frequency along a line."""
    if scene.speed_order is not None:
        wanted = "must not be given: along an engine-order line responses and designs are found, no tracks"
        raise SettingError("speed_order", scene.speed_order, wanted)


def check_loads(system: System, parameters: Sequence[Parameter], slopes: Real) -> None:
    """Raise SettingError where paths of one load contradict each other."""
    clash = contradicting(system.contacts, slopes)
    if clash.any():
        paths = [p.path for p in parameters if np.any(p.active[clash] > 0.0)]
        raise SettingError("paths", paths, "contradict each other: give the scene N1_ratio or N1 first")


def second_forces(ks: Integer, forces: Complex, level: Real, phase: Real) -> Complex:
    """Return ∂²f/∂p_i∂p_j, (n_paths, n_paths, nk, N), from df/f of each path: real `level`, and `phase`."""
    moving = (ks > 0).astype(np.float64)
    rates = level[:, None] + 1j * phase[:, None] * moving
    products = np.einsum("ik,jk->ijk", rates, rates)
    # A level is a factor: by it alone f is linear.
    products -= np.outer(level, level)[:, :, None]
    return np.asarray(products[..., None] * forces)
