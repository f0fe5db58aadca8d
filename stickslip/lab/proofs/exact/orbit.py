"""The periodic motion of a piecewise linear system: Newton's method on the map of a period, after a march.

The march from rest goes from event to event; in between Newton's steps w += (1 − Φ)⁻¹ (P(w) − w) with the
derivative Φ of the map P are tried from the middle of the longest piece of the last period, and kept where
contacts end in the state they began in and the distance falls. Directions in which nothing is decided (what
sticks all the time may stand elsewhere) are left as the march has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

import numpy as np

from solver.jit.fourier import Complex, Flags, Real
from stickslip.lab.proofs.exact.flow import Flow, FlowPiece, LiftsError, NoMotionError
from stickslip.lab.proofs.exact.piecewise import MemberState, Piecewise
from solver.contacts.pieces.line import FREE, STICK


import math
from collections.abc import Sequence


from solver.response.solution import Solution
from solver.response.time_history import all_coordinates


PERIOD = 2.0 * np.pi
CLOSED = 1e-11  # distance after a period, of the largest number of the state, from which on it is polished
ROUNDING = 5e-13  # of the largest number of the state: of 88 orbits with proofs the worst was 4e-13 off
_NEWTON, POLISH = 12, 4
MOST_PERIODS = 4000
_FOLLOWED = 200  # periods from a neighbour's motion
_OPEN = 1e-9  # singular values of 1 − Φ below: nothing decides that direction
_REPEATS = 1e-9
MOST_GRAZED = 100  # periods after which a march has decided whether what slips by next to nothing sticks
_GRAZES = 1e-6  # of its largest motion: what slips by less stands at the edge of where it may stick


class Ended(Enum):
    """Why there is no periodic motion."""

    RATCHETS = "ratchets"
    NOT_FOUND = "not found"


@dataclass(frozen=True, slots=True, kw_only=True)
class Orbit:
    """A periodic motion."""

    pieces: Annotated[list[FlowPiece], "The period, piece after piece, from the angle `pieces[0].tau` on."]
    residual: Annotated[float, "Distance of the state after a period, relative to its largest number."]
    error: Annotated[float, "What rounding may have left in the state [m]."]
    multipliers: Annotated[Complex, "Floquet multipliers."]
    open_directions: Annotated[Real, "(nw, ·) changes of the first state that are periodic too."]
    periods: Annotated[int, "Marched."]
    steps: Annotated[int, "Of Newton's method."]


def find(
    system: Piecewise, w: Real, state: MemberState, *, tau: float = 0.0, most_periods: int = MOST_PERIODS
) -> Orbit | Ended:
    """Find the periodic motion that a start leads to, at an angle; raises as `Flow.run`."""
    flow, periods, some = Flow(system, w, state, tau), 0, 2
    while periods < most_periods:
        drifts = []
        for _ in range(some):
            before = flow.w
            flow.run(PERIOD)
            flow.w[system.nd :] = system.harmonics_at(flow.tau)
            drifts.append(flow.w - before)
        periods += some
        found = _newton(system, flow, periods)
        if found is not None and (periods > MOST_GRAZED or not grazed(system, found)):
            return found
        if _ratchets(system, flow, drifts):
            return Ended.RATCHETS
        some = min(2 * some, 256)
    return Ended.NOT_FOUND


def follow(system: Piecewise, near: Orbit) -> Orbit | Ended:
    """Find the periodic motion that begins as one nearby did; give up soon. Raises as `Flow.run`.

    Where directions are open, where parts stand is a matter of history: a start from rest decides it, as far
    as it settles soon.
    """
    piece = near.pieces[0]
    if piece.w.size != system.nw:
        return find(system, *system.at_rest())
    w = system.mode(piece.state).to_rates @ piece.w
    w[system.nd :] = system.harmonics_at(piece.tau)
    found = beside(system, w, piece.state.copy(), piece.tau)
    if isinstance(found, Orbit) and (found.open_directions.size or grazed(system, found)):
        try:
            rested = find(system, *system.at_rest(), most_periods=MOST_GRAZED)
        except (LiftsError, NoMotionError):
            return found
        return rested if isinstance(rested, Orbit) else found
    return found


def beside(
    system: Piecewise, w: Real, state: MemberState, tau: float, *, polish: int = POLISH
) -> Orbit | Ended:
    """Find the motion near a start, with `polish` steps beyond; give up soon. Raises as `Flow.run`."""
    march = Flow(system, w, state, tau)
    march.run(PERIOD)
    found = _newton(system, march, 1, polish)
    if found is not None:
        return found
    start = march.w.copy()
    start[system.nd :] = system.harmonics_at(march.tau)
    return find(system, start, march.state, tau=march.tau % PERIOD, most_periods=_FOLLOWED)


def grazed(system: Piecewise, orbit: Orbit) -> bool:
    """Whether a slider slips by next to nothing: it might as well stick, with another mean."""
    ends = [*(piece.w for piece in orbit.pieces[1:]), orbit.pieces[0].w]
    for i, d in enumerate(system.d):
        row, travel = system.motion(d), 0.0
        for piece, end in zip(orbit.pieces, ends, strict=True):
            xi = piece.state.sliders[i]
            if abs(xi) == 1:
                slid = row if system.rigid[i] else row - xi * piece.mode.limits[i] / system.kt[i]
                travel += abs(float(slid @ (end - piece.w)))
            elif xi == FREE:
                travel = np.inf
        places = [float(row @ each) for each in ends]
        if 0.0 < travel <= _GRAZES * max(map(abs, places)):
            return True
    return False


def _ratchets(system: Piecewise, flow: Flow, drifts: list[Real]) -> bool:
    """Whether the last two periods moved a part on by the same and changed nothing else."""
    n, (first, second) = system.n, drifts[-2:]
    moved, speed = np.abs(second[:n]).max(initial=0.0), np.abs(flow.w[n : 2 * n]).max(initial=0.0)
    same = np.abs(second[:n] - first[:n]).max(initial=0.0) <= _REPEATS * moved
    return bool(moved > 1e-7 * speed and same and np.abs(second[n : 2 * n]).max(initial=0.0) <= 1e-7 * speed)


def _newton(system: Piecewise, march: Flow, periods: int, polish: int = POLISH) -> Orbit | None:
    """Try Newton's method from where a march has come; None if it leads nowhere."""
    longest = max(march.pieces, key=lambda each: each.length)
    flow = Flow(system, march.w, march.state, march.tau)
    best: tuple[float, Orbit] | None = None
    try:
        flow.run(longest.tau + 0.5 * longest.length + PERIOD - march.tau)
        w, state, distance, polished = flow.w, flow.state, np.inf, 0
        for step in range(_NEWTON):
            flow = Flow(system, w, state, flow.tau % PERIOD, np.eye(system.nw))
            flow.w[system.nd :] = system.harmonics_at(flow.tau)
            begun = flow.w
            flow.run(PERIOD)
            away = (flow.w - begun)[: system.nd] * _lasting(system, state)
            size = float(np.abs(begun[: system.nd]).max(initial=0.0))
            now = float(np.abs(away).max(initial=0.0))
            if flow.state.key != state.key or (step > 1 and now > 0.9 * distance and now > CLOSED * size):
                return None if best is None else best[1]
            change, open_directions, multipliers = _solved(system, flow.phi, state, away)
            distance = now
            if now <= CLOSED * size:
                polished += 1
                if best is None or now < best[0]:
                    error = 10.0 * float(np.abs(change).max(initial=0.0)) + ROUNDING * size
                    best = now, Orbit(
                        pieces=flow.pieces, residual=now / size if size > 0.0 else 0.0, error=error,
                        multipliers=multipliers, open_directions=open_directions, periods=periods,
                        steps=step + 1,
                    )  # fmt: skip
                if polished > polish or now == 0.0:
                    break
            w = system.mode(state).to_rates @ (begun + change)
    except NoMotionError:
        pass
    return None if best is None else best[1]


def _lasting(system: Piecewise, state: MemberState) -> Flags:
    """Return which numbers of w last: positions of elastic sliders do where they stick."""
    kept = np.ones(system.nd, np.bool_)
    for i, xi in enumerate(state.sliders):
        if not system.rigid[i] and xi != STICK:
            kept[system.elastic_at[i]] = False
    return kept


def _solved(
    system: Piecewise, phi: Real | None, state: MemberState, away: Real
) -> tuple[Real, Real, Complex]:
    """Return Newton's change of w, the directions it leaves open, and the Floquet multipliers."""
    if phi is None:
        raise NoMotionError
    nd = system.nd
    allowed = _tangent(system, state)
    reduced = allowed.T @ phi[:nd, :nd] @ allowed
    left, values, right = np.linalg.svd(np.eye(len(reduced)) - reduced)
    kept = values > _OPEN
    change = np.zeros(system.nw)
    change[:nd] = allowed @ (right[kept].T @ ((left[:, kept].T @ (allowed.T @ away)) / values[kept]))
    directions = np.zeros((system.nw, int((~kept).sum())))
    directions[:nd] = allowed @ right[~kept].T
    return change, directions, np.asarray(np.linalg.eigvals(reduced), dtype=np.complex128)


def _tangent(system: Piecewise, state: MemberState) -> Real:
    """Return an orthonormal basis (nd, ·) of the changes of w that constraints and sliders allow."""
    n, nd = system.n, system.nd
    held = [system.d[i] for i, xi in enumerate(state.sliders) if xi == STICK and system.rigid[i]]
    pressed = [each.normal for each in system.members if each.rigid_normal and each.normal is not None]
    rows = [np.concatenate([np.zeros(n), row, np.zeros(nd - 2 * n)]) for row in [*held, *pressed]]
    rows += [np.concatenate([row, np.zeros(nd - n)]) for row in pressed]
    rows += [each for each, kept in zip(np.eye(nd), _lasting(system, state), strict=True) if not kept]
    if not rows:
        return np.eye(nd)
    _, values, right = np.linalg.svd(np.array(rows))
    return np.asarray(right[int((values > 1e-12 * values[0]).sum()) :].T)


_START = np.zeros(1)  # the angle


def orbit_beside(solution: Solution, polish: int = POLISH) -> tuple[Piecewise, Orbit | None]:
    """Return the system of a solution that converged and the periodic motion near it; None if none is found.

    Sliders begin where the forces of the balance hold them, so that what sticks throughout keeps its force.
    `polish`: Newton's steps beyond convergence.

    Raises
    ------
    SettingError
        A part of the scene that has no place in an exact solution, see `Piecewise`.
    """
    system = Piecewise(solution.scene, 2.0 * math.pi * solution.frequency_hz)
    try:
        if system.rigid.any() or any(member.rigid_normal for member in system.members):
            found = find(system, *system.at_rest())  # it is exact itself
        else:
            given = zip(solution.contacts, solution.scene.contacts, strict=True)
            forces = [each.force_over(contact, _START) for each, contact in given]
            found = beside(system, *begun_at(system, all_coordinates(solution), forces), 0.0, polish=polish)
    except (LiftsError, NoMotionError):
        return system, None
    return system, found if isinstance(found, Orbit) else None


def begun_at(system: Piecewise, amplitudes: Complex, forces: Sequence[Real]) -> tuple[Real, MemberState]:
    """Return the state at τ = 0 of a motion; what slips there is told by its force at once.

    Parameters
    ----------
    amplitudes : (H + 1, n) of the harmonics.
    forces : of every contact, its force at τ = 0 as an array of one [N].
    """
    n, (w, state) = system.n, system.at_rest()
    w[:n] = amplitudes.real.sum(axis=0)
    w[n : 2 * n] = -(np.arange(len(amplitudes)) @ amplitudes.imag)
    for i, member in enumerate(system.members):
        load, at = float(member.given @ w), float(system.d[member.slider] @ w[:n])
        state.closed[i] = load > 0.0
        state.sliders[member.slider] = STICK if load > 0.0 else FREE
        force = float(forces[member.contact][0])
        limit = member.friction.limit(max(load, 0.0))
        w[system.elastic_at[member.slider]] = at - min(max(force, -limit), limit) / system.kt[member.slider]
    for i, (_, row, _, gap) in enumerate(system.gaps):
        state.pressed[i] = row @ w[:n] > gap
    return w, state
