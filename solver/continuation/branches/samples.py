"""A frequency response solved at frequencies all over a range, where no path has to be followed.

Where the response is unique (`solver.continuation.branches.point_by_point`) every solution at a frequency is
the response there, whatever it was found from. Steps along an arc are short wherever contacts change, also
far below the peaks: who looks for the highest peak alone begins with few points and solves for more where it
may stand (`solver.continuation.extrema.extrema`).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from solver.balance.balance import build
from solver.balance.parameter import Kind
from solver.balance.rounding import resonates_undamped
from solver.balance.workspace import Workspace
from solver.continuation.branch import Branch, BranchStatus
from solver.continuation.branches.point_by_point import is_unique
from solver.continuation.branches.sweep import walk, without_peaks
from solver.continuation.branches.symmetry_breaking import branch_flags
from solver.continuation.continuation_settings import ContinuationSettings
from solver.continuation.extrema.node_table import PointRow
from solver.continuation.extrema.nodes import NodeSolver
from solver.continuation.parameter_scale import check_range
from solver.continuation.segment import joined
from solver.jit.timer import clock
from solver.results.watch import ShouldStop
from solver.scene.scene import Scene

LEAST, STEP = 40, 0.015  # intervals of a range at least, and share of a frequency that one is long at most


def sampled(
    scene: Scene, start: float | None, stop: float | None, harmonics: int,
    should_stop: ShouldStop = None,
) -> Branch | None:  # fmt: skip
    """Return the response at a few frequencies of a range [Hz], without peaks.

    None if it is not unique, nothing damps it, or a frequency has no solution.
    """
    begun = clock()
    balance = build(scene, harmonics=harmonics)
    if not is_unique(balance) or balance.parameter.kind is not Kind.FREQUENCY:
        return None
    low, high = scene.observe.band
    start, stop = check_range(
        balance.parameter, low if start is None else start, high if stop is None else stop
    )
    workspace = Workspace.of(balance)
    solver = NodeSolver(workspace)
    first, last = map(balance.parameter.inside, (start, stop))
    if resonates_undamped(balance, first, last):
        return None
    count = max(LEAST, math.ceil(abs(math.log(last / first)) / STEP))
    places = np.geomspace(first, last, count + 1).tolist()
    node, status = solver.at(places[0], [], math.copysign(1.0, last - first)), BranchStatus.COMPLETED
    nodes = [] if node is None else [node]
    for p in places[1:]:
        if should_stop is not None and should_stop():
            status = BranchStatus.STOPPED
            break
        more = _until(solver, nodes[-1], p, count) if nodes else []
        if not more:
            return None
        nodes += more
    branch = without_peaks(balance, solver.points_of(nodes), status, start, stop)
    return replace(
        branch, newton_iterations=solver.spent, seconds=clock() - begun,
        flags=branch_flags(workspace, branch.solutions),
    )  # fmt: skip


def _until(solver: NodeSolver, last: PointRow, p: float, intervals: int) -> list[PointRow]:
    """Return the node at the next of so many λ, or those of the arc there where Newton's method fails.

    None where the arc does not lead there either.
    """
    length = p - last.at
    ahead = last.solution[:-1] + length * last.tangent[:-1] / last.tangent[-1]
    node = solver.at(p, [ahead], math.copysign(1.0, length), from_nothing=False)
    if node is not None:
        return [node]
    outside = solver.workspace.balance.parameter.outside
    settings = ContinuationSettings()
    settings = replace(settings, range_length=settings.range_length / intervals)
    ends = float(outside(last.at)), float(outside(p))
    arc = joined(list(walk(solver.workspace, *ends, settings, last.solution[:-1])))
    return solver.nodes_of(arc)[1:] if arc.status is BranchStatus.COMPLETED else []
