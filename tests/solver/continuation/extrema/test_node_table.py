"""The table of a branch's points: rows keep their numbers, and what is kept of neighbours is never stale."""

import numpy as np
import pytest

import solver
from solver.balance.workspace import Workspace
from solver.continuation.branch import ROWS, Points
from solver.continuation.extrema.extrema import Survey
from solver.continuation.extrema.kernels.node_table import halve
from solver.continuation.extrema.nodes import NodeSolver
from solver.continuation.stretches import rows_of


def points_of(name: str) -> tuple[solver.Branch, Points]:
    branch = solver.sweep(solver.load_scene(name), harmonics=3)
    nothing = np.zeros((len(branch.values), branch.balance.n_coefficients))
    return branch, Points.of(branch, observed=nothing)


def test_rows_keep_their_numbers_while_the_table_grows():
    rng = np.random.default_rng(0)
    branch, _ = points_of("two-dof")
    none = Points(**rows_of(branch.balance, 0))
    table, count = NodeSolver(Workspace.of(branch.balance), none), 0
    expected = {name: [] for name in ROWS}
    for more in (1, 7, 40, 0, 100):
        rows = rows_of(branch.balance, more)
        for name, row in rows.items():
            row[...] = rng.integers(0, 9, row.shape)
            expected[name] += list(row)
        nodes = table.added(Points(**rows))
        assert [node.number for node in nodes] == list(range(count, count + more))
        count += more
    kept = table.points_of(range(count))
    for name in ROWS:
        np.testing.assert_array_equal(getattr(kept, name), np.array(expected[name]))


@pytest.mark.parametrize("name", ["two-dof", "bladed-disk"])
def test_a_look_after_nodes_came_between_is_that_of_a_solver_that_never_looked(name):
    branch, points = points_of(name)
    top = float(branch.peak.value)
    looked = NodeSolver(Workspace.of(branch.balance), points)
    before = looked.look(top)
    wanted = np.arange(len(branch.values) - 1) % 5 == 2
    off = looked.run(halve, wanted, True)
    assert off.size == looked.order.size - 1 == wanted.size + wanted.sum()
    assert not looked.undone.size
    again = NodeSolver(Workspace.of(branch.balance), looked.points_of(looked.order)).look(top)
    for one, other in zip(looked.look(top), again, strict=True):
        np.testing.assert_array_equal(one, other)
    # Without the nodes between, the neighbours of before are neighbours again.
    looked.begin(np.arange(len(branch.values)))
    np.testing.assert_array_equal(looked.look(top).slopes, before.slopes)


def test_what_is_asked_for_from_nothing_is_found_and_the_search_begun_again(monkeypatch):
    """Newton's method from the points beside a place fails all the time: each is found from nothing."""
    scene = solver.load_scene("two-dof")
    plain = solver.sweep(scene, harmonics=5)
    points = Points.of(plain, observed=np.zeros((len(plain.values), plain.balance.n_coefficients)))
    solver_, middle = NodeSolver(Workspace.of(plain.balance), points), 0.5 * (points.solutions[3:5, -1]).sum()
    asked, solve = [], Workspace.solve

    def counted(self, p, guess=None):
        asked.append(p)
        return solve(self, p, guess)

    monkeypatch.setattr(Workspace, "solve", counted)
    nonsense = np.full(plain.balance.n_unknowns, np.nan)
    node = solver_.at(middle, [nonsense], 1.0)
    assert asked == [middle]
    near = solver_.at(middle, [points.solutions[3, :-1]], 1.0)
    assert asked == [middle]
    np.testing.assert_allclose(node.solution, near.solution, rtol=1e-8, atol=1e-12)
    assert solver_.at(middle, [nonsense], 1.0, from_nothing=False) is None
    assert solver_.order.size == len(points.solutions)


def test_a_survey_of_one_point_and_of_none():
    branch, points = points_of("two-dof")
    one = Points(**{name: getattr(points, name)[:1] for name in ROWS})
    survey = Survey.of(Workspace.of(branch.balance), one)
    assert len(survey.peaks) == 1
    assert survey.band(1e-9).intervals == ()
    none = Points(**{name: getattr(points, name)[:0] for name in ROWS})
    survey = Survey.of(Workspace.of(branch.balance), none)
    assert survey.peaks == ()
    assert not survey.certificate(completed=True).known
