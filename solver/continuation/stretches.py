"""A branch of responses as a curve whose steps are stretches of points that compiled steps find.

The steps themselves are of `solver.continuation.kernels.pseudo_arclength`; a stretch has as many as leave the
caller time to watch and stop.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from solver.balance.kernels.mechanics import ALLOWED
from solver.balance.kernels.output import LOST
from solver.balance.workspace import PointSolution, Workspace
from solver.continuation.branch import BranchStatus
from solver.continuation.continuation_settings import ContinuationSettings
from solver.continuation.endings import MANY, ratchets_ahead, stands_still, taken_up
from solver.continuation.kernels import walk_state as walk_states
from solver.continuation.kernels.pseudo_arclength import walk_on
from solver.continuation.kernels.walk_state import Control, Walk, walk_by_value
from solver.continuation.segment import Stretch, rows_of, state_of
from solver.continuation.walk import Curve
from solver.jit.timer import clock

STRETCH = 64  # points between two looks at the caller, at most
_SHORT_STRETCH = 4  # the first of them where a point may take long
_LARGE = 400  # unknowns from which it may
_STRETCH_SECONDS = 0.5
_ENDINGS = {
    walk_states.FINISHED: BranchStatus.COMPLETED,
    walk_states.NO_START: BranchStatus.NO_START,
    walk_states.STALLED: BranchStatus.STALLED,
    walk_states.LEFT_RANGE: BranchStatus.TURNED_BACK,
}


def control_of(settings: ContinuationSettings, start: float, stop: float) -> Control:
    """Return the settings of the compiled steps from one λ to another (inside unit)."""
    return Control(
        start=start, stop=stop, first_step=settings.first_step, largest_step=settings.largest_step,
        smallest_step=settings.smallest_step, wanted_iterations=settings.wanted_iterations,
        most_iterations=settings.most_iterations, predictor=int(settings.predictor),
        largest_turn=settings.largest_turn, range_weight=settings.range_length,
    )  # fmt: skip


class BranchStretches(Curve[Stretch]):
    """A branch as it stands behind its last stretch.

    Parameters
    ----------
    code, state : of `begin_walk`.
    spent : Newton iterations before.
    begun : time at which the work began.
    """

    def __init__(
        self, workspace: Workspace, control: Control, code: int, state: Walk, spent: int, begun: float
    ) -> None:
        self._workspace, self._control, self._code, self._state = workspace, control, code, state
        self._spent, self._begun = spent, begun
        self._last = np.zeros((0, workspace.balance.n_unknowns + 1))
        self._status: BranchStatus | None = None

    @property
    def ended(self) -> bool:
        """Whether it goes no further."""
        return self._status is not None or self._code != walk_states.RUNNING

    @property
    def size(self) -> int:
        """Points of the first stretch."""
        return STRETCH if self._workspace.balance.n_unknowns <= _LARGE else _SHORT_STRETCH

    def tried(self, size: float) -> tuple[Stretch | None, float]:
        """Return the next stretch, of no more than `size` points, and how many the one behind it may have."""
        workspace, control, state, before = self._workspace, self._control, self._state, clock()
        rows, springs = rows_of(workspace.balance, int(size)), workspace.springs.rows(int(size))
        filled = [*rows.values(), springs]
        code, count = walk_on(
            workspace.system, workspace.linear, workspace.point, control, state, int(size), *filled
        )
        workspace.springs.keep(rows["solutions"][:count], springs)
        self._last = last = np.concatenate([self._last, rows["solutions"][:count]])[-MANY:]
        if code == walk_states.RUNNING and stands_still(last, control):
            code = walk_states.STALLED
        status, again = _ENDINGS.get(code), None
        if status is BranchStatus.STALLED:
            again = taken_up(workspace, control, state, last)
            if again is not None:
                status, code = None, walk_states.RUNNING
            elif ratchets_ahead(workspace, state, control):
                status = BranchStatus.RATCHETS
        stretch = balanced_part(workspace, self._stretch(rows, count, status))
        self._code, self._status, self._state = code, stretch.status, state if again is None else again
        longer = min(2.0, _STRETCH_SECONDS / max(clock() - before, 1e-9))
        return stretch, min(STRETCH, max(1, int(size * longer)))

    def _stretch(self, rows: dict[str, Any], count: int, status: BranchStatus | None) -> Stretch:
        numbers = walk_by_value(self._state).numbers
        return Stretch(
            **{name: row[:count] for name, row in rows.items()}, status=status,
            newton_iterations=self._spent + int(numbers[walk_states.ITERATIONS]),
            rejected_steps=int(numbers[walk_states.REJECTED]),
            stepped_over=int(numbers[walk_states.STEPPED_OVER]),
            seconds=clock() - self._begun, walk=state_of(self._state),
        )  # fmt: skip


def balanced_part(workspace: Workspace, stretch: Stretch) -> Stretch:
    """Return a stretch up to the first point that does not obey mechanics; itself if all do.

    What is cut ends as `ending` says of a solution from nothing there.
    """
    wrong = ~(stretch.measures[:, LOST] <= ALLOWED)
    if not wrong.any():
        return stretch
    first = int(np.argmax(wrong))
    found = Workspace.of(workspace.balance).solve(float(stretch.solutions[first, -1]))
    return replace(stretch.first(first), status=ending(found, BranchStatus.STALLED), walk=np.zeros(0))


def ending(found: PointSolution, else_: BranchStatus) -> BranchStatus:
    """Return why a branch ends where this was tried from nothing."""
    if found.ratchets:
        return BranchStatus.RATCHETS
    return BranchStatus.POWER_LOST if found.loses_power else else_
