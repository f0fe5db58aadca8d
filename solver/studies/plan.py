"""The plan: which effects a scene calls for, which are left out, and why, in words and numbers."""

from __future__ import annotations

import numpy as np

from solver.balance.balance import Balance, build, fewer_harmonics
from solver.balance.simplifications import Effects
from solver.contacts.kernels.system import (
    DENSE,
    MODES,
    POLES,
    by_reference,
    new_receptance,
    receptance_by_value,
)
from solver.jit.fourier import Flags, Real
from solver.linear.condensation import FEWEST_PORTS
from solver.linear.kernels.receptance import PAIRS_UP_TO, receptance
from solver.response.plausibility import plausibility
from solver.response.stability.cost import forecast
from solver.results import units
from solver.scene.cyclic.annulus import sectors_needed
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import even_harmonics_reason
from solver.scene.scene_records import MatricesStructure
from solver.studies.memory import dense_bytes
from solver.studies.study_results import Effect, Plan

_ITERATIONS_A_POINT = 2.5  # with all that a step along a branch does besides
_SECONDS_AN_ITERATION = 8e-6
# Of a contact that sticks; of one with n coefficients and closed events, the second times n²; of one that
# slides in a plane under the circular limit, the second times n.
_STUCK, _EVENTS, _CIRCLE = 3e-6, (3e-6, 2e-8), (1e-4, 8e-6)
# Of the receptance: harmonics × modes × leading ports², pair by pair or as products; × ports; × DOFs³.
_PAIRS, _PRODUCTS, _DRIVEN, _INVERTED = 2e-9, 2.8e-10, 2e-9, 1.5e-9
# Of the factors: unknowns³; products with the contacts' slopes; harmonics × eliminated ports³.
_FACTORS, _SLOPES, _ELIMINATED = 3e-11, 1e-9, 4e-10
_FREQUENCIES, _FEWER, _MANY = 101, 21, 100  # at which the stuck response is looked at; of many ports fewer


_Said = tuple[str, bool, str]
"""An effect: its name, whether it is computed, and why."""


def point_seconds(balance: Balance, stuck: Real) -> float:
    """Return what a point of a branch over the frequency costs [s], on average over the band.

    Parameters
    ----------
    stuck : (n_frequencies, n_ports) forces of the ports if all stick, see `stuck_forces`.
    """
    system, n, nk = balance.system, balance.n_coefficients, balance.system.ks.size
    r, nc, modes = balance.n_leading, balance.n_ports, balance.system.eigenvalues.shape[1]
    if system.form == DENSE:
        linear = _INVERTED * nk * system.observe.size**3
    else:
        linear = nk * modes * ((_PAIRS if r <= PAIRS_UP_TO else _PRODUCTS) * r * r + _DRIVEN * nc)
    ports = np.diff(system.first_port)
    sticks = _sticking(balance, stuck)
    slipping = np.where(system.alone == 1, _CIRCLE[0] + _CIRCLE[1] * n, _EVENTS[0] + _EVENTS[1] * n * n)
    contacts = float((np.where(sticks, _STUCK, slipping)).sum(axis=1).mean())
    slopes = _SLOPES * float((ports**2).sum()) * n * n
    if r < nc:
        factors = _FACTORS * (r * n) ** 3 + slopes * r
    else:
        held = sticks @ ports if system.condense == 1 else np.zeros(len(stuck))
        free = nc - held
        gone = _ELIMINATED * nk * held**2 * (held + 2.0 * free)
        rows = 2.0 * _SLOPES * nk * n * free**2 * float(ports.max(initial=1))
        factors = float((_FACTORS * (free * n) ** 3 + rows + gone).mean())
    return _ITERATIONS_A_POINT * (_SECONDS_AN_ITERATION + linear + contacts + factors)


def _sticking(balance: Balance, stuck: Real) -> Flags:
    """Return which contacts stick where all others do, (n_frequencies, n_contacts)."""
    sticks = np.zeros((len(stuck), len(balance.scene.contacts)), np.bool_)
    for e, contact in enumerate(balance.scene.contacts):
        friction, load, first = contact.friction, contact.load, balance.system.first_port[e]
        if friction is None or load is None:
            continue
        pressed = load.least - (0.0 if contact.normal_port is None else stuck[:, first + contact.normal_port])
        pulled = np.linalg.norm(stuck[:, [first + port for port in contact.RUBBING]], axis=1)
        sticks[:, e] = pulled <= friction.limit(np.maximum(pressed, 0.0))
    return sticks


def stuck_forces(balance: Balance) -> Real:
    """Return the force each port carries over the band if all stick [N], without the mean.

    Returns
    -------
    (n_frequencies, n_ports) sums of the amplitudes of all harmonics.
    """
    # Stuck contacts are springs: nothing moves but at the harmonics of the forces.
    forced = fewer_harmonics(balance, 0)
    system, low_high = by_reference(forced.system), balance.scene.observe.band
    out, span = new_receptance(system), forced.system.span
    kt = np.array([k for contact in balance.scene.contacts for k in contact.stiffnesses])
    stiffness = kt - balance.system.shift
    springs = span.T @ (stiffness[:, None] * span)
    frequencies = np.linspace(*low_high, _FREQUENCIES if kt.size <= _MANY else _FEWER)
    total: Real = np.zeros((frequencies.size, kt.size))
    for moved, frequency in zip(total, frequencies, strict=True):
        receptance(system, 2.0 * np.pi * float(frequency), out)
        linear = receptance_by_value(out)
        for k, A, free in zip(forced.system.ks, linear.A[0], linear.u_linear[0], strict=True):
            if k == 0 or not np.any(free):
                continue
            if span.shape[1] == 0:
                moved += np.abs(np.linalg.solve(np.eye(kt.size) + A * stiffness, free))
            else:
                pulled = A @ (span.T @ (stiffness * free))
                moved += np.abs(free - span @ np.linalg.solve(np.eye(len(A)) + A @ springs, pulled))
    total *= kt
    return total


_SECONDS_A_DIAMETER = 1e-8  # of the modes of a Hermitian structure of n coordinates, times n³

_FORMS = {
    MODES: "undamped modes: the damping is diagonal in them, so a frequency costs modes x contacts^2",
    POLES: "poles and residues: the damping couples the modes, the complex eigenvectors span the state space",
    DENSE: "the matrices themselves: the eigenvectors do not span the state space",
}


def performance_curve_words(scene: Scene) -> str:
    """Return whether a performance curve may stand in for responses in a design, and what that depends on."""
    if scene.speed_order is not None:
        return "no: loads follow the speed along an engine-order line"
    if any(force.harmonic != 1 for force in scene.excitation):
        return "no: a harmonic of the excitation other than the first drives no single mode"
    loads = [contact.load for contact in scene.contacts]
    tied = all(load is not None and load.in_proportion for load in loads)
    grows = bool(loads) and tied and not scene.constant_forces
    names = ",".join(f"{contact.name}.N0" for contact in scene.contacts)
    how = f"one curve for all values of `{names}` if laws scale" if grows else "one for each design"
    return (
        f"{how}. Whether it suffices depends on other modes, the phase of loads that vary and the steepness "
        "of the curve: its result says so, with an estimated error next to the optimum"
    )


def plan(scene: Scene, *, harmonics: int = 11, effects: Effects | None = None) -> Plan:
    """Return what solving a scene takes: the effects in use and left out, sizes and estimated cost.

    Parameters
    ----------
    scene : what will vibrate.
    harmonics : highest harmonic kept.
    effects : what is to be paid for though the scene does not call for it.

    Raises
    ------
    SettingError
        A bad number of harmonics.
    """
    asked = effects or Effects()
    balance = build(scene, harmonics=harmonics, effects=asked)
    stuck = stuck_forces(balance)
    carried = stuck.max(axis=0)
    found: tuple[_Said, ...] = (
        _condensation(balance), *_leading(balance), _one_sector(scene, asked),
        *((f"separation of {contact.name}", *contact.separation) for contact in balance.scene.contacts),
        *(_slip(balance, i, carried) for i in range(len(balance.scene.contacts))), _even_harmonics(balance),
        *_nodal_diameters(balance), *_reduction(scene), ("linear part", True, _linear_part(balance)),
        _stiffness_shift(balance.system.shift),
    )  # fmt: skip
    return Plan(
        scene=scene.name,
        effects=tuple(Effect(name=name, used=used, reason=reason) for name, used, reason in found),
        unknowns=balance.n_unknowns,
        linear_dofs=_linear_dofs(balance.scene),
        contacts=len(balance.scene.contacts),
        harmonics=harmonics,
        seconds_a_point=point_seconds(balance, stuck),
        dense_bytes=dense_bytes(scene, harmonics, every_sector=asked.every_sector).total,
        performance_curve=performance_curve_words(balance.scene),
        seconds_of_stability=forecast(balance.scene),
        notes=plausibility(scene),
    )


def _condensation(balance: Balance) -> _Said:
    dofs, coefficients = _linear_dofs(balance.scene), balance.n_coefficients
    reason = (
        f"the {dofs} linear DOFs are eliminated exactly: {balance.n_unknowns} unknowns "
        f"(contacts x coefficients) instead of {dofs * coefficients}"
    )
    return "condensation", True, reason


def _leading(balance: Balance) -> tuple[_Said, ...]:
    """Which motions a Newton step is solved for, where contacts are many enough for a choice."""
    ports, leading = balance.n_ports, balance.n_leading
    if ports < FEWEST_PORTS:
        return ()
    name, used = "every motion of the contacts in the Newton step", leading == ports
    if balance.effects.every_port:
        return ((name, True, "asked for, whether they follow from fewer or not"),)
    if used:
        reason = f"few or none of the {ports} motions follow from others: the modes and bodies are as many"
        return ((name, True, reason),)
    reason = (
        f"all {ports} follow from {leading} of them, those of modes and bodies: a step is solved for "
        f"{leading * balance.n_coefficients} instead of {balance.n_unknowns} unknowns (exact)"
    )
    return ((name, False, reason),)


def _linear_dofs(scene: Scene) -> int:
    """DOFs of structure and bodies; a structure given by matrices names only those in use."""
    structure, named = scene.structure, len(scene.dofs)
    if isinstance(structure, MatricesStructure):
        return structure.n_coordinates + named - len(structure.dofs)
    return named


def _reduction(scene: Scene) -> tuple[_Said, ...]:
    """What was left out of a large model when it was loaded, if it was reduced."""
    structure = scene.structure
    found = structure.reduction if isinstance(structure, MatricesStructure) else None
    if found is None:
        return ()
    reason = (
        f"{found.dofs} DOFs were reduced to the {len(structure.dofs)} in use and {found.modes} modes of the "
        f"rest, the highest at {units.hertz(found.highest_hz)}: raise `keep_modes` until the answer stays"
    )
    return (("reduction of the model", True, reason),)


def _nodal_diameters(balance: Balance) -> tuple[_Said, ...]:
    """Which nodal diameters of a sector given by matrices are built, and what each costs."""
    structure, order, ks = balance.scene.structure, balance.scene.engine_order, balance.system.ks
    if not isinstance(structure, MatricesStructure) or not structure.has_sectors:
        return ()
    count, n = structure.sector_count, _linear_dofs(balance.scene)
    met = np.unique(np.minimum(ks * order % count, -ks * order % count))
    cost = 1e3 * _SECONDS_A_DIAMETER * n**3
    reason = (
        f"the harmonics kept of engine order {order} meet {', '.join(map(str, met))} of 0 to {count // 2}: "
        f"each is a Hermitian structure of {n} coordinates, decomposed once in about {cost:.2g} ms"
    )
    return (("nodal diameters", True, reason),)


def _one_sector(scene: Scene, asked: Effects) -> _Said:
    extent = sectors_needed(scene)
    cyclic = scene.structure.has_sectors
    forced = cyclic and extent.sectors == 1 and asked.every_sector
    reason = f"every sector was asked for, though {extent.reason}" if forced else extent.reason
    return "one sector for the annulus", cyclic and extent.sectors == 1 and not forced, reason


def _slip(balance: Balance, i: int, stuck: Real) -> _Said:
    """Say whether a contact is expected to slip: from the response of the structure with all contacts stuck.

    Only the expectation comes from here. Whether a contact is its spring is decided at every Newton step.
    """
    contact = balance.scene.contacts[i]
    name = f"slip of {contact.name}"
    if balance.effects.every_contact:
        return name, True, f"{contact.name} was asked to stay in every Newton step"
    friction, load = contact.friction, contact.load
    if friction is None or load is None or not contact.JENKINS:
        return f"law of {contact.name}", True, contact.evaluation
    limit = friction.limit(max(load.least, 0.0))
    carried = stuck[balance.system.first_port[i]]
    words = (
        f"stuck, {contact.name} would carry up to {units.quantity(carried, 'N')} in the band; its limit is "
    )
    words += units.quantity(limit, "N")
    if carried <= limit:
        return (
            name,
            False,
            f"{words}: while it sticks it is its spring of {units.quantity(friction.kt, 'N/m')}, checked at "
            "every step",
        )
    return name, True, words


def _even_harmonics(balance: Balance) -> _Said:
    count = f"{balance.n_coefficients} coefficients a contact"
    reason = even_harmonics_reason(balance.scene)
    beyond = balance.system.ks[balance.system.ks > balance.n_harmonics]
    if beyond.size:
        count += f"; beyond {balance.n_harmonics} those that forces call for: " + ", ".join(map(str, beyond))
    if reason is None and balance.system.ks[0] != 0:
        odd = ", ".join(str(k) for k in balance.system.ks[:3])
        reason = (
            "loads are constant, forces odd and no stiffness changes with the motion, so the response is "
            f"half-wave symmetric: {odd} … only"
        )
        return "even harmonics and mean", False, f"{reason}, {count}"
    reason = reason or "they were asked for"
    return "even harmonics and mean", True, f"{reason}: harmonics 0 to {balance.n_harmonics}, {count}"


def _linear_part(balance: Balance) -> str:
    if balance.effects.whole_matrices:
        return "the matrices themselves at every frequency, as asked for"
    return _FORMS[balance.system.form]


def _stiffness_shift(shift: np.ndarray) -> _Said:
    used = bool(np.any(shift > 0.0))
    reason = (
        "a part is held in place by contacts alone, so their stiffness is moved into the structure and taken "
        "out of the force again (exact)"
        if used
        else "the structure alone holds every part in place"
    )
    return "contact stiffness in the structure", used, reason
