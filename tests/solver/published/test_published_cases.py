"""Values that others published, with their laws: three masses, one Jenkins element, a lumped bladed disk."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.linalg import eigvalsh

from solver import ContinuationSettings, annulus, solve, sweep
from solver.linear.assembly import linear_model
from solver.scene.scene import Scene

RAD = 2.0 * math.pi


def three_masses(observed: str) -> Scene:
    """NLvib 1.3 (M. Krack, J. Gross), example 07: friction, cubic springs and a stop in a chain."""
    link: dict[str, Any] = {"k": 1.0, "c": 0.02}
    pairs = [["x1", "ground"], ["x1", "x2"], ["x2", "x3"], ["x3", "ground"]]
    jenkins: dict[str, Any] = {"kt": 20.0, "mu": 1.0, "N0": 1.0}
    return Scene.from_dict(
        {
            "name": "three-masses",
            "structure": {
                "kind": "lumped",
                "masses": {"x1": 1.0, "x2": 1.0, "x3": 1.0},
                "springs": [{"between": pair, **link} for pair in pairs],
            },
            "contacts": [
                {"name": "slider1", "between": ["x1", "ground"], **jenkins},
                {"name": "slider2", "between": ["x2", "x1"], **jenkins},
                {"name": "cubic2", "law": "polynomial", "between": ["x2", "ground"], "a3": 1.0},
                {"name": "cubic3", "law": "polynomial", "between": ["x3", "x2"], "a3": 1.0},
                {"name": "stop", "law": "gap", "between": ["x3", "ground"], "k": 1.0, "gap": 0.25},
            ],
            "excitation": {"dof": "x2", "amplitude": 1.0},
            "observe": {"dof": observed, "band": [0.05, 0.5]},
        }
    )


@pytest.mark.parametrize(
    ("observed", "rms", "omega"),
    [("x1", 0.167247, 1.2585), ("x2", 0.206248, 1.2684), ("x3", 0.699148, 1.6642)],
)
def test_three_masses_with_friction_cubic_springs_and_a_stop(observed: str, rms: float, omega: float):
    """The example's "RMS" is √((q0² + Σ c² + s²)/2), the mean halved like the rest, largest of its points.

    Its forces are sampled and its points stand about 0.005 rad/s apart, so four digits are its own. The
    response of the third mass bends over: the branch passes four folds on its way.
    """
    # The spline below needs points that lie close, as those of the example do.
    branch = sweep(
        three_masses(observed), parameter="frequency", start=0.6 / RAD, stop=3.0 / RAD, harmonics=7,
        settings=ContinuationSettings(largest_step=0.05),
    )  # fmt: skip
    assert branch.reached
    assert branch.folds == 4
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(branch.solutions, axis=0), axis=1))])
    size = CubicSpline(arc, np.sqrt(0.5 * (branch.observed**2).sum(axis=1)))
    tops = [s for s in size.derivative().roots() if 0.0 < s < arc[-1]]
    top = max(tops, key=size)
    assert float(size(top)) == pytest.approx(rms, rel=1.5e-4)
    assert float(CubicSpline(arc, branch.values)(top)) * RAD == pytest.approx(omega, abs=3e-3)


def test_one_jenkins_element():
    """tmdsimpy (J. H. Porter): a converged solution with the harmonics 0 to 3, the force being its sine."""
    scene = Scene.from_dict(
        {
            "name": "jenkins",
            "structure": {
                "kind": "lumped",
                "masses": {"x": 1.0},
                "springs": [{"between": ["x", "ground"], "k": 0.75, "c": 0.01}],
            },
            "contacts": [{"name": "slider", "between": ["x", "ground"], "kt": 0.25, "mu": 1.0, "N0": 0.2}],
            "excitation": {"dof": "x", "amplitude": 1.0},
            "observe": {"dof": "x", "band": [0.01, 1.0]},
        }
    )
    solution = solve(scene, frequency_hz=0.3115958 / RAD, harmonics=3)
    published = [0.0, 1.28497628, 0.28420474, 0.0, 0.0, 0.50029792, 0.22540700]
    np.testing.assert_allclose(solution.observed, published, atol=2e-7)


def lumped_disk() -> Scene:
    """Laxalde, Thouverez, Sinou, Lombard, Eur. J. Mech. A 26 (2007) 676: 24 sectors of three masses."""
    return Scene.from_dict(
        {
            "name": "lumped-disk",
            "structure": {
                "kind": "cyclic",
                "sectors": 24,
                "masses": {"disk": 1.2, "root": 0.35, "tip": 0.25},
                "springs": [
                    {"between": ["disk", "ground"], "k": 6e5},
                    {"between": ["disk", "disk@next"], "k": 5e7},
                    {"between": ["disk", "root"], "k": 1e6},
                    {"between": ["root", "tip"], "k": 2e6},
                ],
            },
            "excitation": {"dof": "tip", "amplitude": 1.0, "engine_order": 1},
            "observe": {"dof": "tip", "band": [50.0, 500.0]},
        }
    )


def test_frequencies_of_a_lumped_bladed_disk():
    model = linear_model(lumped_disk())
    found = []
    for diameter in range(13):
        turn = np.exp(2j * np.pi * diameter / 24)
        K = model.K0 + model.Kp * turn + model.Kp.T / turn
        found.append(np.sqrt(eigvalsh(K, model.M)) / RAD)
    assert found[0][0] == pytest.approx(88.26374399, abs=5e-9)
    assert found[0][1] == pytest.approx(249.31165161, abs=5e-9)
    assert found[1][0] == pytest.approx(169.3441295, abs=5e-8)
    assert found[2][0] == pytest.approx(189.3018526, abs=5e-8)
    assert found[12][2] == pytest.approx(2062.97567761, abs=5e-9)
    whole = linear_model(annulus(lumped_disk()))
    expected = np.sort(np.concatenate([f if d in (0, 12) else np.repeat(f, 2) for d, f in enumerate(found)]))
    np.testing.assert_allclose(np.sqrt(eigvalsh(whole.K0, whole.M)) / RAD, expected, rtol=1e-9)
