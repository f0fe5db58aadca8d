"""The table of a branch's points: rows keep their numbers, and what is kept of neighbours is never stale."""

import numpy as np
import pytest

import solver
from solver.balance.workspace import Workspace
from solver.continuation.branch import Points
from solver.continuation.extrema.nodes import NodeSolver, NodeTable


def test_rows_keep_their_numbers_while_the_table_grows():
    rng = np.random.default_rng(0)
    table, expected = NodeTable(3, 5, 2, 1), []
    for count in (1, 7, 40, 0, 100):
        rows = [rng.standard_normal((count, size)) for size in (4, 4, 2, 5)]
        assert table.add(*rows, np.full((count, 1), count)) == len(expected)
        expected += zip(*rows, strict=True)
    single = [rng.standard_normal(size) for size in (4, 4, 2, 5)]
    assert table.add(*single, np.array([9])) == len(expected)
    expected.append(tuple(single))
    for number, row in enumerate(expected):
        kept = table.solutions, table.tangents, table.measures, table.observed
        for array, values in zip(kept, row, strict=True):
            np.testing.assert_array_equal(array[number], values)


@pytest.mark.parametrize("name", ["two-dof", "bladed-disk"])
def test_a_look_after_nodes_came_between_is_that_of_a_solver_that_never_looked(name):
    scene = solver.load_scene(name)
    start, stop = scene.observe.band
    branch = solver.sweep(scene, start=start, stop=stop, harmonics=3)
    nothing = np.zeros((len(branch.values), branch.balance.n_coefficients))
    points = Points.of(branch, observed=nothing)
    top = float(branch.peak.value)
    looked = NodeSolver(Workspace.of(branch.balance))
    nodes = looked.nodes_of(points)
    looked.look(nodes, top)
    wanted = np.arange(len(nodes) - 1) % 5 == 2
    grown, _, lost = looked.halved(nodes, wanted)
    assert not lost
    assert len(grown) == len(nodes) + wanted.sum()
    fresh = NodeSolver(Workspace.of(branch.balance))
    again = fresh.look(fresh.nodes_of(looked.points_of(grown)), top)
    seen = looked.look(grown, top)
    for column in ("measures", "at", "slopes", "reach", "error", "flags"):
        np.testing.assert_array_equal(getattr(seen, column), getattr(again, column))
    # Without the nodes between, the neighbours of before are neighbours again.
    np.testing.assert_array_equal(looked.look(list(nodes), top).slopes, _slopes(branch.balance, points, top))


def _slopes(balance, points, top):
    fresh = NodeSolver(Workspace.of(balance))
    return fresh.look(fresh.nodes_of(points), top).slopes
