"""The contacts of a scene as the compiled loops read them: rows of numbers, kernels, ports."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from solver.contacts.kernels import columns
from solver.contacts.kernels.laws import law_number, second_number
from solver.errors import SettingError
from solver.jit.fourier import Integer, Real
from solver.linear.model import LinearModel
from solver.scene.scene import Scene

_SINGLE = (
    "must be finite here: contacts with kt = inf or kn = inf are for solve, sweep and march; elsewhere give "
    "kt = 1e4 times the stiffness beside it"
)


class ContactSet(NamedTuple):
    """What the contacts of a scene are to the compiled loops; see `solver.contacts.kernels.system.System`."""

    laws: Integer
    jenkins: Integer
    alone: Integer
    normal_port: Integer
    first_port: Integer
    first_block: Integer
    owner: Integer
    rubs: Integer
    held: Integer


def contact_set(scene: Scene) -> ContactSet:
    """Return the kernels and ports of all contacts; a kernel that never ran in this process is loaded."""
    contacts, ports = scene.contacts, port_counts(scene)
    first = np.append(0, np.cumsum(ports))
    normal = [
        -1 if contact.normal_port is None else begin + contact.normal_port
        for contact, begin in zip(contacts, first.tolist(), strict=False)
    ]
    rubs = np.zeros(first[-1], dtype=np.int64)
    for contact, (begin, _) in zip(contacts, pairwise(first.tolist()), strict=True):
        if contact.friction is not None:
            rubs[[begin + port for port in contact.RUBBING]] = 1
    held = [tuple(port) for contact in contacts for port in contact.held]
    return ContactSet(
        laws=np.array([law_number(contact.kernel) for contact in contacts], dtype=np.int64),
        jenkins=np.array([contact.JENKINS for contact in contacts], dtype=np.int64),
        alone=np.array([contact.force_alone for contact in contacts], dtype=np.int64),
        normal_port=np.array(normal, dtype=np.int64), first_port=first,
        first_block=np.append(0, np.cumsum(ports**2)), owner=np.repeat(np.arange(ports.size), ports),
        rubs=rubs, held=np.array(held, dtype=np.int64).reshape(-1, 3),
    )  # fmt: skip


def second_numbers(scene: Scene) -> Integer:
    """Return the kernels of the second derivatives of all contacts, (n_contacts,), which all have some."""
    kernels = [contact.second_kernel for contact in scene.contacts]
    return np.array([second_number(kernel) for kernel in kernels if kernel is not None], dtype=np.int64)


def port_counts(scene: Scene) -> Integer:
    """Return how many relative motions the force of every contact depends on, (n_contacts,)."""
    return np.array([len(contact.end_keys) for contact in scene.contacts], dtype=np.int64)


def highest_load(scene: Scene) -> int:
    """Return the highest harmonic of the normal loads, 1 or more."""
    given = [len(contact.load.higher) + 1 for contact in scene.contacts if contact.load is not None]
    return max([1, *given])


def refuse_rigid(scene: Scene) -> None:
    """Refuse contacts whose events are followed: there is no balance of harmonics with them.

    Raises
    ------
    SettingError
        A contact is rigid.
    """
    rigid = scene.rigid_contact
    if rigid is not None:
        raise SettingError(
            f"{rigid.name}.{'kt' if math.isinf(rigid.stiffnesses[0]) else 'kn'}", math.inf, _SINGLE
        )


def contact_table(scene: Scene, highest: int) -> Real:
    """Return the rows of all contacts, (n_contacts, ·), for harmonics up to `highest`.

    A load that is not tied has a ratio NaN.

    Raises
    ------
    SettingError
        A contact is rigid.
    """
    refuse_rigid(scene)
    width = columns.wave_column(highest_load(scene) + 1)
    table = np.zeros((len(scene.contacts), width))
    table[:, columns.RATIO] = math.nan
    for row, contact in zip(table, scene.contacts, strict=True):
        contact.fill(row, highest)
    return table


def port_stiffnesses(scene: Scene, model: LinearModel) -> Real:
    """Return a finite stiffness > 0 of every port [N/m]: its own, or one of the size of the structure's."""
    own = np.array([k for contact in scene.contacts for k in contact.stiffnesses], dtype=np.float64)
    K = model.K0 if model.sector is None else model.sector.at(model.engine_order)[0]
    largest = float(np.abs(K).max(initial=0.0))
    return np.where((own > 0.0) & np.isfinite(own), own, largest if largest > 0.0 else 1.0)
