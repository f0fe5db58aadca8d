"""The response over one parameter solved point by point, where it is unique and its arc cannot be followed.

Contacts far stiffer than the structure bend the arc of a branch sharply within the tolerances of a solution;
continuation then turns round on its own traces. Where the response is unique, every solution at a given value
of the parameter is the response there, whatever it was found from, and no fold exists: a branch that turns
back is told by that, and its rest is solved at values of the parameter, in steps that prediction by the
tangent controls.

Elastic Coulomb friction under a given load is monotone in the motion, and so are linear springs and dampers
that dissipate; the periodic response of such a structure is unique but for tractions that stay where contacts
stick.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solver.balance.balance import Balance
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import DENSE, MODES
from solver.continuation.branch import ROWS, BranchStatus
from solver.continuation.extrema.kernels.node_table import PointRow
from solver.continuation.extrema.nodes import NodeSolver
from solver.continuation.stretches import Stretch, ending
from solver.continuation.walk import Pace, walk
from solver.jit.fourier import Real
from solver.jit.timer import clock

TURN = 1e-6  # share of the range by which a branch has to turn back to be lost: less is a step over a kink
# Steps, as shares of the range; the effort is how far the solution lies from the prediction, over `_OFF`.
_PACE = Pace(first=1e-3, least=1e-9, largest=0.0143, grow=1.6, easy=0.3)
_OFF = 0.1  # that distance relative to the motion, above which a step is halved
# The same over the smallest step, above which nothing connects the two: a motion that grows without bound
# towards a resonance that nothing damps comes back with its phase turned round.
_TORN = 1.0
_STRETCH = 64


def is_unique(balance: Balance) -> bool:
    """Return whether every value of the parameter has one response: given loads, nothing that feeds it."""
    system = balance.system
    if not all(contact.load_is_given for contact in balance.scene.contacts):
        return False
    if not balance.model.is_symmetric:
        return False
    if system.form == DENSE:
        return all(_dissipates(C) for C in system.C)
    if system.form == MODES:
        return bool(np.all(system.dampings >= 0.0) and np.all(system.eigenvalues.real >= -1e-9))
    return bool(np.all(system.eigenvalues.real <= 0.0))


def _dissipates(C: Real) -> bool:
    values = np.linalg.eigvalsh(0.5 * (C + C.conj().T))
    return bool(values.min(initial=0.0) >= -1e-12 * np.abs(values).max(initial=0.0))


def rows_before_a_turn(stretch: Stretch, start: float, stop: float) -> int | None:
    """Return how many points of a stretch come before it turns back; None if it does not."""
    values = stretch.solutions[:, -1] * np.sign(stop - start)
    back = np.maximum.accumulate(values) - values > TURN * abs(stop - start)
    return int(np.argmax(back)) if back.any() else None


def walk_by_points(
    workspace: Workspace, before: Stretch, stop: float, span: float, begun: float
) -> Iterator[Stretch]:
    """Yield the rest of a branch behind the last point of `before`, solved at values of the parameter.

    Parameters
    ----------
    before : points of the branch, at least one, the last of them before any turn.
    stop, span : end and length of the whole range (inside unit).
    begun : time at which the work began.
    """
    curve = _Unique(workspace, before, stop, span)
    nodes: list[PointRow] = []
    for node in walk(curve, curve.pace):
        nodes.append(node)
        if len(nodes) == _STRETCH:
            yield _stretch(before, nodes, None, curve, begun)
            nodes = []
    yield _stretch(before, nodes, curve.status, curve, begun)


class _Unique:
    """The response over the parameter as it stands at its last point.

    Attributes
    ----------
    pace : its steps.
    status : how it ended; None as long as it goes on.
    """

    def __init__(self, workspace: Workspace, before: Stretch, stop: float, span: float) -> None:
        self._workspace, self._stop, self.pace = workspace, stop, _PACE.times(span)
        self.solver, self.rejected = NodeSolver(workspace, before.first(0)), 0
        last = before.solutions[-1]
        self._onward = float(np.sign(stop - last[-1])) or 1.0
        self._last = self.solver.at(float(last[-1]), [last[:-1]], self._onward)
        self._there = float(last[-1])  # where it was tried last
        self.status: BranchStatus | None = None
        if self._last is None:
            self.status = BranchStatus.STALLED
        elif (stop - self._last.at) * self._onward <= 0.0:
            self.status = BranchStatus.COMPLETED

    @property
    def ended(self) -> bool:
        """Whether it goes no further."""
        return self.status is not None

    def tried(self, size: float) -> tuple[PointRow | None, float]:
        """Solve at a value of the parameter, from where the tangent leads or from the last point."""
        last, onward, least = self._last, self._onward, self.pace.least
        if last is None:
            return None, 0.0
        ahead = (self._stop - last.at) * onward
        self._there = there = self._stop if ahead <= 1.5 * size else last.at + onward * size
        guess = last.solution[:-1] + (there - last.at) * onward * last.tangent[:-1]
        node = self.solver.at(there, [guess, last.solution[:-1]], onward)
        scale = max(_moved(self._workspace.balance, last.solution[:-1]), self.solver.least)
        far = np.inf if node is None else _moved(self._workspace.balance, node.solution[:-1] - guess)
        if node is None or (far > _OFF * scale and size > least):
            self.rejected += 1
            return None, self.pace.shorter(size, 0.0 if node is None else least)
        if far > _TORN * scale:
            self.status = BranchStatus.STALLED
            return None, 0.0
        self._last = node
        if there == self._stop:
            self.status = BranchStatus.COMPLETED
        return node, self.pace.after(size, far / (_OFF * scale))

    def leapt(self) -> tuple[None, float]:
        """Say why nothing was found where it was tried last."""
        self.status = self.status or ending(self._workspace.solve(self._there), BranchStatus.STALLED)
        return None, 0.0


def _moved(balance: Balance, u: Real) -> float:
    """Return the largest coefficient of motions or of their change [m], but for where loose parts stand.

    Where a part that contacts alone hold stands is a gauge as long as none holds it, and jumps to what its
    equilibrium asks for where one begins to: neither tells how far the tangent leads. Its rigid-body motions
    are taken out of the means by Σ l (kt l)ᵀ, since Σ_c l_i kt l_j = δ_ij.
    """
    system = balance.system
    if len(system.loose) and system.ks[0] == 0:
        n = balance.n_coefficients
        u = u.copy()
        u[::n] -= (system.loose @ (system.shift * u[::n])) @ system.loose
    return float(np.abs(u).max(initial=0.0))


def _stretch(
    before: Stretch, nodes: list[PointRow], status: BranchStatus | None, curve: _Unique, begun: float
) -> Stretch:
    """Return nodes as points behind others; without the state of a continuation, since there is none."""
    points = curve.solver.points_of(node.number for node in nodes)
    return Stretch(
        **{name: getattr(points, name) for name in ROWS}, status=status,
        newton_iterations=before.newton_iterations + curve.solver.spent,
        rejected_steps=before.rejected_steps + curve.rejected, stepped_over=before.stepped_over,
        seconds=clock() - begun, walk=np.zeros(0),
    )  # fmt: skip
