"""Why a walk along a branch goes no further, and whether it can be taken up again."""

from __future__ import annotations

import numpy as np

from solver.balance.kernels.residual import evaluate
from solver.balance.rounding import amplitudes
from solver.balance.workspace import Workspace
from solver.contacts.kernels.columns import KT
from solver.contacts.kernels.system import evaluation_by_value
from solver.continuation.kernels import walk_state as walk_states
from solver.continuation.kernels.pseudo_arclength import begin_walk
from solver.continuation.kernels.walk_state import Control, walk_by_value
from solver.jit.fourier import Real
from solver.linear.modal import undamped_resonance

STIFFEST = 1e7
NEIGHBOUR = 0.05  # largest change of the vibration, relative, over which a branch is taken up again
MANY, NEAR, STILL = 24, 1e-7, 1e-3  # points within such shares of the range and of the motion lead nowhere
_MOVES = 1e-6  # share of the largest amplitude of a contact, of harmonics with which one moves
AHEAD = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # of the range, where it is looked why a branch went no further


def too_stiff(workspace: Workspace, first: float, last: float) -> bool:
    """Return whether a contact yields less than rounding leaves of its motion, at two λ (inside unit).

    The structure gives way by A per force, an elastic contact by 1/kt: with A kt above `STIFFEST` the force
    kt (u − w) of a contact about to slip is the difference of two motions that agree to the last digits. A
    resonance that nothing damps makes A large too, but at its own place alone: the beginning of the branch
    has to say the same.
    """
    both = [np.abs(np.diagonal(workspace.receptance(at).A[0], axis1=1, axis2=2)) for at in (first, last)]
    A = np.minimum(*both)
    system = workspace.balance.system
    kt = system.contacts[system.owner, KT]
    return bool(np.any(A * kt > STIFFEST))


def ends_undamped(workspace: Workspace, points: Real, start: float) -> bool:
    """Return whether a branch over the frequency ends, or cannot begin, near a resonance without damping.

    The last of its points tells what contacts hold of the motion that has grown.
    """
    balance, held = workspace.balance, None
    p = float(points[-1, -1]) if len(points) else start
    if len(points):
        u = points[-1, :-1].copy()
        evaluate(workspace.system, workspace.linear, u, p, 0.0, workspace.point)
        F = evaluation_by_value(workspace.point).F
        moves = balance.system.ks > 0
        pairs = amplitudes(balance.system, u.reshape(F.shape)), amplitudes(balance.system, F)
        motions, forces = (each[:, moves].T for each in pairs)
        seen = np.abs(motions) > _MOVES * np.abs(motions).max(initial=0.0)
        held = np.where(seen, (forces / np.where(seen, motions, 1.0)).real, 0.0)
    at_hz = float(balance.parameter.outside(p))
    return undamped_resonance(balance.scene, at_hz, balance.system.ks, held)


def stands_still(points: Real, control: Control) -> bool:
    """Return whether many points are one but for rounding: a branch that ends within the tolerances."""
    near = NEAR * abs(control.stop - control.start)
    if len(points) < MANY or abs(points[-1, -1] - points[0, -1]) > near or np.ptp(points[:, -1]) > near:
        return False
    moved, size = np.ptp(points[:, :-1], axis=0), np.abs(points[:, :-1]).max(initial=0.0)
    return bool(moved.max(initial=0.0) <= STILL * size)


def taken_up(
    workspace: Workspace, control: Control, state: walk_states.Walk, last: Real
) -> walk_states.Walk | None:
    """Return the branch taken up a little further on, if a mean that nothing held is all that moves.

    Where a contact begins to stick again its mean has to be what the part's equilibrium asks for, wherever
    the part stood while nothing held it.
    """
    balance, span = workspace.balance, control.stop - control.start
    if not len(balance.system.loose) or len(last) < 2 or (last[-1, -1] - last[-2, -1]) * span <= 0.0:
        return None
    before = last[-1, :-1].reshape(balance.n_ports, -1)[:, 1:]
    for share in AHEAD[:3]:
        p = float(last[-1, -1]) + share * span
        if (p - control.stop) * span >= 0.0:
            return None
        found = workspace.solve(p)
        if not found.converged:
            continue
        moved = np.abs(found.u.reshape(balance.n_ports, -1)[:, 1:] - before).max()
        if moved > NEIGHBOUR * max(np.abs(before).max(), np.finfo(float).tiny):
            continue
        code, again = begin_walk(
            workspace.system, workspace.linear, workspace.point, control._replace(start=p), found.u
        )
        numbers, old = walk_by_value(again).numbers, walk_by_value(state).numbers
        for each in (walk_states.ITERATIONS, walk_states.REJECTED, walk_states.STEPPED_OVER):
            numbers[each] += old[each]
        numbers[walk_states.STEPPED_OVER] += 1
        return again if code == walk_states.RUNNING else None
    return None


def ratchets_ahead(workspace: Workspace, state: walk_states.Walk, control: Control) -> bool:
    """Return whether there is no periodic motion a little further on because a part drifts away."""
    if not len(workspace.balance.system.loose):
        return False
    at, span = float(walk_by_value(state).numbers[walk_states.P]), control.stop - control.start
    for share in AHEAD:
        p = at + share * span
        if (p - control.stop) * span <= 0.0 and workspace.solve(p).ratchets:
            return True
    return False
