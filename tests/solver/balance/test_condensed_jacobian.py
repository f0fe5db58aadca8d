"""The condensed Jacobian solves what the whole one does, directly and transposed, by one factorisation."""

import math

import numpy as np
import pytest
from each import each
from scene_cases import bladed_disk, mixed_disk, two_dof

from solver.balance.balance import build
from solver.balance.kernels.jacobian import (
    FREE,
    HELD,
    factorise,
    fill_jacobian,
    step_back,
    step_back_transposed,
)
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import evaluation_by_value
from solver.jit.lapack import back_substitute, back_substitute_transposed
from solver.jit.lapack import factorise as factorise_block
from solver.scene.scene import Scene


def pressed() -> Scene:
    """Two points in space that rub and stay closed: friction feels the normal motions, which are springs'."""
    names, k = ("p", "q"), 4.0 * math.pi**2
    springs = [{"between": [f"{name}{axis}", "ground"], "k": k, "c": 0.4} for name in names for axis in "xyz"]
    springs += [
        {"between": ends, "k": 0.5 * k, "c": 0.1} for ends in (["px", "qx"], ["py", "qz"], ["px", "pz"])
    ]
    contacts = [
        {
            "name": f"on_{name}", "law": "coulomb-3d", "between": [f"{name}x", "ground"],
            "between_second": [f"{name}y", "ground"], "normal_between": [f"{name}z", "ground"],
            "kt": 0.7 * k, "kn": k, "mu": 0.3, "N0": 60.0,
        }
        for name in names
    ]  # fmt: skip
    return Scene.from_dict(
        {
            "name": "pressed",
            "structure": {
                "kind": "lumped",
                "masses": {f"{name}{axis}": 1.0 for name in names for axis in "xyz"},
                "springs": springs,
            },
            "contacts": contacts,
            "excitation": [
                {"dof": f"{name}{axis}", "amplitude": 20.0, "phase": 0.3 * i}
                for i, (name, axis) in enumerate((name, axis) for name in names for axis in "xyz")
            ],
            "observe": {"dof": "px", "band": [0.7, 1.7]},
        }
    )


# Scene, frequency [Hz], harmonics, free and held ports.
CASES = [
    (two_dof(), 1.0, 11, (1, 0)),
    (two_dof(N0=1e5), 1.0, 11, (0, 1)),
    (bladed_disk(N0=150.0), 750.0, 11, (1, 1)),
    (bladed_disk(N0=150.0), 750.0, 3, (1, 1)),
    (mixed_disk(), 700.0, 7, None),
    (pressed(), 0.8, 5, (4, 2)),
]


@pytest.mark.parametrize(("scene", "frequency", "harmonics", "parts"), CASES)
def test_solves_as_the_whole_jacobian(
    scene: Scene, frequency: float, harmonics: int, parts: tuple[int, int] | None
) -> None:
    workspace = Workspace.of(build(scene, harmonics=harmonics))
    found = workspace.solve(2.0 * math.pi * frequency, None)
    assert found.converged
    fill_jacobian(workspace.system, workspace.linear, workspace.point)
    point = evaluation_by_value(workspace.point)
    J = point.jacobian.copy()
    tangent = np.zeros(found.u.size + 1)
    assert factorise(workspace.system, workspace.linear, workspace.point, tangent, 0.0, 0.0) != 0.0
    if parts is not None:
        assert (point.counts[FREE], point.counts[HELD]) == parts
    rng = np.random.default_rng(5)
    for _ in range(3):
        rhs = rng.normal(size=found.u.size)
        direct, transposed = rhs.copy(), rhs.copy()
        step_back(workspace.system, workspace.point, direct)
        step_back_transposed(workspace.system, workspace.point, transposed)
        assert direct == pytest.approx(np.linalg.solve(J, rhs), rel=1e-9, abs=1e-10 * np.abs(direct).max())
        exact = np.linalg.solve(J.T, rhs)
        assert transposed == pytest.approx(exact, rel=1e-9, abs=1e-10 * np.abs(exact).max())


@pytest.mark.parametrize(("scene", "frequency", "harmonics", "parts"), CASES)
def test_solves_as_the_whole_jacobian_with_a_border(
    scene: Scene, frequency: float, harmonics: int, parts: tuple[int, int] | None
) -> None:
    workspace = Workspace.of(build(scene, harmonics=harmonics))
    found = workspace.solve(2.0 * math.pi * frequency, None)
    fill_jacobian(workspace.system, workspace.linear, workspace.point)
    point, n = evaluation_by_value(workspace.point), found.u.size
    rng = np.random.default_rng(6)
    tangent, weight_u, weight_p = rng.normal(size=n + 1), 1.0 / np.abs(found.u).max() ** 2, 3.0
    tangent[:n] *= np.abs(found.u).max()
    border = np.append(weight_u * tangent[:n], weight_p * tangent[n])
    whole = np.vstack([np.column_stack([point.jacobian, point.dr_dp]), border])
    sign = factorise(workspace.system, workspace.linear, workspace.point, tangent, weight_u, weight_p)
    if parts is not None:
        assert (point.counts[FREE], point.counts[HELD]) == parts
    assert sign == np.linalg.slogdet(whole)[0]
    rhs = rng.normal(size=n + 1)
    x = rhs.copy()
    step_back(workspace.system, workspace.point, x)
    exact = np.linalg.solve(whole, rhs)
    for part in (slice(n), slice(n, n + 1)):
        assert x[part] == pytest.approx(exact[part], rel=1e-8, abs=1e-9 * np.abs(exact[part]).max())


@each("n", [1, 2, 3, 4, 5, 7, 24, 36, 37, 60])
def test_both_sides_of_one_factorisation(n: int) -> None:
    """Below and above the size from which LAPACK factorises."""
    rng = np.random.default_rng(n)
    matrix, rhs = rng.normal(size=(n, n)), rng.normal(size=n)
    factors, pivots = np.zeros((n + 1, n + 1)), np.zeros(n + 1, np.int32)
    factors[:n, :n] = matrix
    assert factorise_block(factors, n, pivots) == np.sign(np.linalg.det(matrix))
    direct, transposed = rhs.copy(), rhs.copy()
    back_substitute(factors, n, pivots, direct)
    back_substitute_transposed(factors, n, pivots, transposed)
    assert matrix @ direct == pytest.approx(rhs, abs=1e-10)
    assert matrix.T @ transposed == pytest.approx(rhs, abs=1e-10)
