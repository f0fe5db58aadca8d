"""The part of a branch that obeys mechanics.

The residual of a branch is one of displacements, and relative: of a part far away it is small whatever the
forces are, which then are rounding. The walk measures at every point by what share powers and mean forces
themselves do not balance (`solver.balance.kernels.mechanics`), and a point that loses too much is none of the
branch.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solver.balance.kernels.mechanics import ALLOWED
from solver.balance.kernels.output import LOST
from solver.balance.workspace import PointSolution, Workspace
from solver.continuation.branch import BranchStatus
from solver.continuation.segment import Stretch


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
