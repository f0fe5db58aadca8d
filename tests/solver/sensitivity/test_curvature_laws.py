"""Hessians and gradients of amplitudes and peaks for the laws beside `coulomb`: against the whole solve."""

import numpy as np
import pytest
from curvature_cases import (
    ALL,
    check_hessian_of_a_peak,
    error_of_hessian,
    solved,
)
from law_scene_cases import CUBIC, DAHL, GAP, PLANE, RUB, scene
from space_cases import MOVING, SPACE, in_space

from solver.balance.simplifications import Effects
from solver.errors import SettingError
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities

PLAIN = {"kt": 1.0, "mu": 0.3, "N0": 0.4}
_BOX = {"limit": "box", "kt_second": 1.2}
CASES: dict[str, tuple[Scene, tuple[str, ...]]] = {
    "elastic-normal": (scene(RUB), ("c0.kt", "c0.mu", "c0.N0", "c0.kn", "excitation.amplitude")),
    "elastic-normal, load varies": (scene({**RUB, "N1": 0.15, "N1_phase": 0.6, "prestressed": True}),
                                    ("c0.kn", "c0.N1", "c0.N1_phase", "c0.mu")),
    "elastic-normal beside coulomb": (scene(RUB, PLAIN), ("c0.kn", "c1.N0", "c1.kt", "c0.N0")),
    "coulomb-2d, box": (scene({**PLANE, "limit": "box"}), ("c0.kt", "c0.mu", "c0.N0")),
    "coulomb-2d": (scene(PLANE), ("c0.kt", "c0.mu", "c0.N0", "excitation.amplitude")),
    "coulomb-3d": (in_space(MOVING), ("c0.kt", "c0.mu", "c0.N0", "c0.kn", "excitation.amplitude")),
    "coulomb-3d, two stiffnesses": (in_space({**MOVING, "kt_second": 1.2, "N1": 0.2, "N1_phase": 0.5}),
                                    ("c0.kt", "c0.kt_second", "c0.N1", "c0.kn")),
    "coulomb-3d, opening": (in_space({**MOVING, "N0": 0.1, "prestressed": False}),
                            ("c0.kt", "c0.mu", "c0.N0", "c0.kn")),
    "coulomb-3d, given load": (in_space({**SPACE, "N1_ratio": 0.4}),
                               ("c0.kt", "c0.mu", "c0.N0", "c0.N1_ratio")),
    "coulomb-3d, box": (in_space({**MOVING, **_BOX}), ("c0.kt", "c0.kt_second", "c0.mu", "c0.N0", "c0.kn")),
    "gap": (scene(GAP, PLAIN), ("c0.k", "c0.gap", "c1.N0", "excitation.amplitude")),
    "polynomial": (scene(CUBIC, PLAIN), ("c0.a1", "c0.a2", "c0.a3", "c0.a5", "c1.mu")),
}  # fmt: skip

FREQUENCIES = (0.13, 0.19, 0.27)


@pytest.mark.few(6)
@pytest.mark.parametrize("hz", FREQUENCIES)
@pytest.mark.parametrize("case", CASES)
def test_the_hessian_of_a_law_equals_differences_of_the_gradient(case: str, hz: float) -> None:
    assert error_of_hessian(CASES[case][0], hz, CASES[case][1]) <= 1e-6


@pytest.mark.few(6)
@pytest.mark.parametrize("count", [1, pytest.param(40, marks=pytest.mark.long)])
@pytest.mark.parametrize("law", CASES)
def test_hessians_of_random_scenes_equal_differences(law: str, count: int) -> None:
    """Loads, stiffnesses and amplitudes drawn over a decade; contacts that stick, slip and open."""
    rng, errors = np.random.default_rng(9), []
    base, paths = CASES[law]
    for _ in range(count):
        drawn = {path: base.value(path) * 10.0 ** rng.uniform(-0.5, 0.5) for path in paths}
        errors.append(error_of_hessian(base.with_values(drawn), float(rng.uniform(0.1, 0.3)), paths))
    assert max(errors) <= 1e-5, sorted(errors)[-3:]


@pytest.mark.few(keep=("elastic-normal",))
@pytest.mark.parametrize("case", ["elastic-normal", "coulomb-3d", "gap"])
def test_gradient_and_hessian_of_a_peak_equal_differences_of_sweeps(case: str) -> None:
    there, paths = CASES[case][0], CASES[case][1][:3]
    check_hessian_of_a_peak(there, 0.2, paths)


def test_the_hessian_in_space_without_even_harmonics() -> None:
    """Under a constant load: the balance keeps odd harmonics alone."""
    there = in_space(SPACE)
    for hz in (0.13, 0.19, 0.27):
        assert error_of_hessian(there, hz, ("c0.kt", "c0.mu", "c0.N0"), Effects()) <= 1e-6


def test_a_law_without_second_derivatives_is_named() -> None:
    other = scene(DAHL, PLAIN)
    balance, u = solved(other, 0.2, ALL)
    with pytest.raises(SettingError, match=r"no second derivatives: c0 \(dahl\)"):
        Sensitivities(balance, ["c1.N0"]).hessian(u, 0.2)
