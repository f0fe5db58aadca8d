"""Structural damping of an unsymmetric stiffness: K (1 + iη), the antisymmetric part with it."""

import numpy as np
import pytest

import solver
from solver import Scene

K = np.array([[400.0, -90.0, 0.0], [-30.0, 300.0, -70.0], [20.0, -70.0, 250.0]])
M = np.diag([1.0, 2.0, 1.5])


def scene(loss: float) -> Scene:
    return Scene.from_dict(
        {
            "name": "lossy",
            "structure": {
                "kind": "matrices", "M": M.tolist(), "K": K.tolist(), "symmetric": False,
                "dofs": ["a", "b", "c"], "loss_factor": loss,
            },
            "excitation": {"dof": "a", "amplitude": 1.0},
            "observe": {"dof": "c", "band": [0.5, 5.0]},
        }
    )  # fmt: skip


@pytest.mark.parametrize(("hz", "loss"), [(1.1, 0.3), (2.2, 0.05), (3.0, 1.2)])
def test_the_response_is_that_of_the_complex_stiffness(hz: float, loss: float) -> None:
    omega = 2 * np.pi * hz
    truth = np.linalg.solve(K * (1 + 1j * loss) - omega**2 * M, [1.0, 0.0, 0.0])[2]
    found = solver.solve(scene(loss), frequency_hz=hz, harmonics=3)
    assert found.max_abs == pytest.approx(abs(truth), rel=1e-8)


def test_its_derivative_by_the_loss_factor_has_the_antisymmetric_part_too() -> None:
    from solver.linear.assembly import structure_derivative

    given = scene(0.3)
    diameters, moving = np.zeros(1, np.int64), np.ones(1, np.bool_)
    dK = structure_derivative(given, "structure.loss_factor").at(diameters, moving)[0][0]
    np.testing.assert_allclose(dK, 1j * K, atol=1e-9)
