"""The part of a branch on which the mean forces on what contacts alone hold balance.

The residual of a branch is one of displacements, and relative: of a part far away it is small whatever the
forces are, which then are rounding. Every point is held against the forces themselves.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solver.balance.workspace import BALANCED, Workspace
from solver.continuation.branch import BranchStatus
from solver.continuation.segment import Stretch


def balanced_part(workspace: Workspace, stretch: Stretch) -> Stretch:
    """Return a stretch up to the first point at which a mean force drives a loose part; itself if none does.

    What is cut ends as RATCHETS where no force balance is found there because the part drifts away, else as
    STALLED.
    """
    system = workspace.balance.system
    if not len(system.loose) or system.ks[0] != 0:
        return stretch
    workspace = Workspace.of(workspace.balance)  # that of the continuation goes on from its last point
    for i, row in enumerate(stretch.solutions):
        at = float(row[-1])
        if workspace.drive(row[:-1].copy(), at).relative <= BALANCED:
            continue
        drifts = workspace.solve(at).ratchets
        status = BranchStatus.RATCHETS if drifts else BranchStatus.STALLED
        return replace(stretch.first(i), status=status, walk=np.zeros(0))
    return stretch
