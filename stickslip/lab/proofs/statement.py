"""What a certificate states: the system in exact numbers, and the order of events of an orbit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip.lab.proofs.checker import Orbit as CheckedOrbit
from stickslip.lab.proofs.checker import System
from solver.contacts.laws.contact_parts import Follows, Row
from solver.jit.fourier import Real
from solver.linear.assembly import linear_model
from stickslip.lab.proofs.exact.flow import FlowPiece
from stickslip.lab.proofs.exact.piecewise import MemberState, Piecewise
from solver.contacts.pieces.line import FREE, STICK
from solver.scene.scene_records import LumpedStructure

_AT_ONCE = 1e-7  # rad: events this near each other may be one
_HARDLY = 1e-5  # rad: a slip that is shorter may be none
_NO_SPRING = 1e-12  # of the largest stiffness, below which one is rounding
_APART = 1e-9  # rad between events that floats do not tell apart


def system_of(piecewise: Piecewise, frequency_hz: float | None) -> dict[str, Any]:
    """Return a scene as a system: springs as they are in it, so that no sum of theirs is rounded.

    `frequency_hz`: None of what nothing drives.
    """
    scene = piecewise.scene
    model, structure = linear_model(scene), scene.structure
    zero = np.zeros(1, np.int64)
    K, C, M = (np.real(each[0]) for each in model.at(zero, np.ones(1, np.bool_)))
    springs: list[Any] = [  # entry by entry
        [[[i, 1.0]], [[k, 1.0]], float(K[i, k]), float(C[i, k])]
        for i, k in np.argwhere((K != 0.0) | (C != 0.0)).tolist()
    ]

    if (
        isinstance(structure, LumpedStructure)
        and not scene.bodies
        and model.extra is None
        and not structure.damping_ratio
    ):
        at, springs = {dof: i for i, dof in enumerate(structure.dofs)}, []
        numbers = [(x.k, x.c) for x in structure.springs] + [(0.0, x.c) for x in structure.dampers]
        for part, (k, c) in zip((*structure.springs, *structure.dampers), numbers, strict=True):
            ends = zip(part.ends, (1.0, -1.0), strict=True)
            terms = [[at[end.dof], sign] for end, sign in ends if end.dof is not None]
            springs.append([terms, terms, k, c + structure.stiffness_proportional_damping * k])
    if piecewise.mass_damping:
        gas = piecewise.mass_damping * M
        springs += [[[[i, 1.0]], [[k, 1.0]], 0.0, float(gas[i, k])] for i, k in np.argwhere(gas).tolist()]
    contacts, first = [], 0
    for contact in scene.contacts:
        ports = piecewise.ports[first : first + len(contact.end_keys)]
        contacts += [_contact(row, ports) for row in contact.rows()]
        first += len(contact.end_keys)
    return {
        "frequency_hz": frequency_hz, "mass": M.tolist(), "springs": springs, "contacts": contacts,
        "forces": [
            {"row": _terms(np.real(force.vector)), "waves": [[force.harmonic, force.amplitude, force.phase]]}
            for force in model.forces if force.amplitude != 0.0
        ],
        "observe": _terms(model.observe),
    }  # fmt: skip


def _contact(row: Row, ports: Real) -> dict[str, Any]:
    gap, along = row.follows is Follows.GAP, _terms(ports[row.port])
    waves = [[0, row.N0, 0.0]]
    for k, wave in enumerate([(row.N1, row.N1_phase), *row.higher], start=1):
        waves += [[k, *wave]] if wave[0] != 0.0 else []
    moves = row.normal_port is not None
    return {
        "name": row.name, "row": [] if gap else along, "mu": 0.0 if gap else row.mu,
        "kt": 0.0 if gap else None if math.isinf(row.kt) else row.kt, "waves": [] if gap else waves,
        "kn": row.kt if gap else row.kn, "gap": row.gap if gap else 0.0,
        "normal": along if gap else _terms(ports[row.normal_port]) if moves else [],
        "rest": 0.0 if gap else row.rest, "presses": gap or (bool(row.presses) and moves), "varies": False,
    }  # fmt: skip


def _terms(row: Real) -> list[list[Any]]:
    return [[int(i), float(row[i])] for i in np.flatnonzero(row)]


def orbit_of(
    piecewise: Piecewise, pieces: Sequence[FlowPiece], system: dict[str, Any]
) -> tuple[dict[str, Any], list[float]]:
    """Return the order of events of an orbit, and its unknowns in floats."""
    first, w, n, omega = pieces[0], pieces[0].w, piecewise.n, piecewise.omega
    states = [_words(piecewise, piece.state) for piece in pieces]
    events: list[dict[str, Any]] = []
    times: list[float] = []
    for i, piece in enumerate(pieces[1:], start=1):
        before = pieces[i - 1]
        for j, (old, new) in enumerate(zip(states[i - 1], states[i], strict=True)):
            for word in () if old == new else _way(piecewise, before, piece.w, j, old, new):
                events.append({"contact": j, "to": word})
                times.append(
                    max(piece.tau, times[-1] + _APART) if times and times[-1] >= piece.tau else piece.tau
                )
    for i in _hardly(states[0], events, times):
        del events[i], times[i]
    moved, forces = {each["contact"] for each in events}, {}
    for member in piecewise.members:
        at = member.slider
        if first.state.sliders[at] != FREE and not piecewise.rigid[at]:
            forces[member.contact] = float(first.mode.forces[at] @ w)
    fixed = {str(j): value for j, value in forces.items() if j not in moved and states[0][j] == "stick"}
    found = {"begins": first.tau, "states": states[0], "events": events, "fixed_forces": fixed}
    if own := system["frequency_hz"] is None:  # where it moves fastest its place tells the phase
        at = int(np.abs(w[n : 2 * n]).argmax())
        found["pinned"] = [at, float(w[at])]
    elif (afloat := _afloat(system, n)) is not None and fixed:
        # Friction alone holds it: its place is arbitrary as forces are, and one of those follows from others.
        at = int(np.abs(afloat).argmax())
        found["pinned"] = [at, float(w[at])]
        held = {j: sum(f * afloat[i] for i, f in system["contacts"][int(j)]["row"]) for j in fixed}
        del fixed[max(held, key=lambda j: abs(held[j]))]
    stated = System(system, {})
    for _ in range(2):  # those that come to rest together, then those that go on together
        orbit = CheckedOrbit(stated, found)
        for i in range(1, len(events)):
            if near := times[i] - times[i - 1] < _AT_ONCE:
                near = (orbit := CheckedOrbit(stated, found)).together(i)
            if near or events[i]["contact"] in orbit.twins:
                events[i]["at_once"] = True
    values = [*w[:n].tolist(), *(w[n : 2 * n] * omega).tolist()]
    values += [forces.get(j, 0.0) for j in range(len(system["contacts"]))]
    start = [values[at] for at in CheckedOrbit(stated, found).unknown]
    begun = [first.tau, *(at for at, each in zip(times, events, strict=True) if "at_once" not in each)]
    if own:
        begun.append(first.tau + 2.0 * math.pi)
    return found, [*start, *(np.diff(begun) / omega).tolist()]


def _afloat(system: dict[str, Any], n: int) -> Real | None:
    """Return the one motion that no spring resists, None where there is none or more."""
    K, eye = np.zeros((n, n)), np.eye(n)
    normals = [(each["normal"], each["normal"], each["kn"], 0.0) for each in system["contacts"]]
    for ends, terms, k, _ in [*system["springs"], *normals]:
        column, row = (sum((f * eye[i] for i, f in each), np.zeros(n)) for each in (ends, terms))
        K += k * np.outer(column, row)
    _, sizes, motions = np.linalg.svd(K)
    rank = int(np.sum(sizes > _NO_SPRING * sizes[0]))
    return motions[-1] if rank == n - 1 else None


def _hardly(states: list[str], events: list[dict[str, Any]], times: list[float]) -> list[int]:
    """Return the events, the last first, of slips that hardly last: shaken down, a contact stands there."""
    found: list[int] = []
    before: dict[int, tuple[str, int]] = {}  # of a contact: what it did, and its last event
    for i, each in enumerate(events):
        word, last = before.get(each["contact"], (states[each["contact"]], -1))
        slipped = last >= 0 and each["to"] == "stick" and events[last]["to"].startswith("slip")
        if slipped and word == "stick" and times[i] - times[last] < _HARDLY:
            found += [last, i]
        before[each["contact"]] = events[last]["to"] if last >= 0 else states[each["contact"]], i
    return sorted(found, reverse=True)


def _way(piecewise: Piecewise, before: FlowPiece, w: Real, j: int, old: str, new: str) -> list[str]:
    """Return the states a contact goes through, those included that last no longer than floats tell."""
    slider = next((member.slider for member in piecewise.members if member.contact == j), None)
    if slider is None:
        return [new]
    if old == "stick" and new == "open":
        return ["slip+" if before.mode.forces[slider] @ w > 0.0 else "slip-", new]
    turns = {old, new} == {"slip+", "slip-"} and not piecewise.rigid[slider]
    return ["stick", new] if turns else [new]


def _words(piecewise: Piecewise, state: MemberState) -> list[str]:
    """Return what every contact does."""
    words = {1: "slip+", -1: "slip-", STICK: "stick", FREE: "open"}
    found = {}
    for i, member in enumerate(piecewise.members):
        found[member.contact] = words[int(state.sliders[member.slider])] if state.closed[i] else "open"
    for (number, *_), pressed in zip(piecewise.gaps, state.pressed, strict=True):
        found[number] = "closed" if pressed else "open"
    return [found[j] for j in range(len(found))]
