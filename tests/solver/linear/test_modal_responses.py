"""The way through the modes against the receptance between all pairs, which shares none of its sums."""

import numpy as np
import pytest

import solver
from solver.balance.balance import build
from solver.balance.kernels.output import LOST, MEASURES, measure, measure_through_modes
from solver.balance.kernels.residual import evaluate, evaluate_forces, prepare_forces
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import MODES, POLES, evaluation_by_value, receptance_by_value
from solver.linear.kernels.receptance import goes_through_modes, modal_responses, receptance
from solver.scene.scene import Scene


def a_disk(*, coupled_damping: bool) -> Scene:
    """Six blades that are not equal; with a dashpot that couples the modes the structure is kept in poles."""
    raw = solver.load_scene("bladed-disk").to_dict()
    raw["structure"]["sectors"] = 6
    if coupled_damping:
        raw["structure"]["dampers"] = [{"name": "d", "between": ["tip", "disk"], "c": 40.0}]
    return solver.mistuned(Scene.from_dict(raw), of=["tip_middle", "tip"], spread=0.05, seed=4)


CASES = [(False, MODES), (True, POLES)]


@pytest.mark.parametrize(("coupled_damping", "form"), CASES)
def test_motions_and_residuals_are_those_of_the_receptance(coupled_damping: bool, form: int) -> None:
    workspace = Workspace.of(build(a_disk(coupled_damping=coupled_damping), "frequency", harmonics=4))
    system, linear, point = workspace.balance.system, workspace.linear, workspace.point
    assert system.form == form
    assert goes_through_modes(system)
    draw, nc = np.random.default_rng(2), system.owner.size
    u = 1e-4 * draw.normal(size=workspace.balance.n_unknowns)
    for p in 2.0 * np.pi * np.array([0.7, 420.0, 655.5, 5000.0]):
        receptance(workspace.system, p, linear)
        norm = evaluate(workspace.system, linear, u, p, 0.0, point)
        exact = evaluation_by_value(point).residual.copy()
        for i in range(system.ks.size):
            forces = draw.normal(size=nc) + 1j * draw.normal(size=nc)
            motions = np.empty(nc, np.complex128)
            modal_responses(workspace.system, p, i, forces, motions)
            whole = receptance_by_value(linear).A[0, i] @ forces
            np.testing.assert_allclose(motions, whole, rtol=0, atol=1e-12 * np.abs(whole).max())
        # At another frequency nothing is left of the first but the entries of A, of which the size is used.
        receptance(workspace.system, 1.01 * p, linear)
        prepare_forces(workspace.system, linear, p)
        again = evaluate_forces(workspace.system, linear, u, p, point)
        residual = evaluation_by_value(point).residual
        np.testing.assert_allclose(residual, exact, rtol=0, atol=1e-12 * np.abs(exact).max())
        assert again == pytest.approx(norm, rel=0.5)


@pytest.mark.parametrize(("coupled_damping", "form"), CASES)
def test_observers_measure_what_each_would_alone(coupled_damping: bool, form: int) -> None:
    scene = a_disk(coupled_damping=coupled_damping)
    others = [
        Workspace.of(
            build(
                scene.model_copy(update={"observe": scene.observe.model_copy(update={"dof": dof})}),
                "frequency",
                harmonics=4,
            )
        )
        for dof in ("tip@0", "tip@3", "disk@5")
    ]
    first = others[0]
    assert first.balance.system.form == form
    draw, n = np.random.default_rng(5), first.balance.n_unknowns
    u, du, dp, p = 1e-4 * draw.normal(size=n), 1e-4 * draw.normal(size=n), 0.3, 4100.0
    receptance(first.system, p, first.linear)
    evaluate(first.system, first.linear, u, p, 0.0, first.point)
    seen = np.array([each.balance.system.observe_modes for each in others])
    size = first.balance.n_coefficients
    xs, outs = np.empty((len(others), 1, size)), np.zeros((len(others), 1, MEASURES))
    at, along = np.append(u, p)[None], np.append(du, dp)[None]
    measure_through_modes(first.system, first.point, seen, at, along, xs, outs)
    for each, (x,), (out,) in zip(others, xs, outs, strict=True):
        y, alone = np.empty(size), np.zeros(MEASURES)
        receptance(each.system, p, each.linear)
        measure(each.system, each.linear, u, first.point, du, dp, y, alone)
        np.testing.assert_allclose(x, y, rtol=0, atol=1e-12 * np.abs(y).max())
        # What a motion loses is the same whoever looks at it.
        np.testing.assert_allclose(out[:LOST], alone[:LOST], rtol=1e-9, atol=1e-12 * np.abs(y).max())
