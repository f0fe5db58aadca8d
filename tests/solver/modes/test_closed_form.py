"""Nonlinear modes whose frequency and damping are formulas."""

import math
from typing import Any

import numpy as np
import pytest
from each import each

import solver
from tests.cases.mode_cases import one_mass, slider


@pytest.mark.parametrize(
    ("amplitude", "frequency", "zeta"), [(2.0, 1.174710, 0.121515), (10.0, 1.019577, 0.080908)]
)
def test_one_slider_has_the_published_numbers(amplitude: float, frequency: float, zeta: float) -> None:
    scene = one_mass(1.0, 39.478, 0.5, 30.0, 30.0)
    found = solver.nonlinear_mode(scene, amplitudes=(amplitude, 1.1 * amplitude), harmonics=1)
    assert found.frequency_hz[0] == pytest.approx(frequency, abs=5e-7)
    assert found.damping_ratio[0] == pytest.approx(zeta, abs=5e-7)


@each("seed", range(12))
def test_one_slider_with_one_harmonic_is_the_formula(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m, k = 10.0 ** rng.uniform(-3, 3), 10.0 ** rng.uniform(-2, 6)
    kt, limit = k * 10.0 ** rng.uniform(-3, 3), 10.0 ** rng.uniform(-3, 3)
    c = 0.0 if seed % 3 == 0 else 2.0 * 10.0 ** rng.uniform(-4, -1) * math.sqrt(k * m)
    full = limit / kt * math.sqrt(m)  # modal amplitude at which it begins to slip
    found = solver.nonlinear_mode(
        one_mass(m, k, c, kt, limit), amplitudes=(0.1 * full, 1e4 * full), harmonics=1
    )
    assert found.reached, found.status
    for a, frequency, zeta in zip(found.amplitude, found.frequency_hz, found.damping_ratio, strict=True):
        stiffness, damping = slider(a / math.sqrt(m), kt, limit)
        omega = math.sqrt((k + stiffness) / m)
        assert 2.0 * math.pi * frequency == pytest.approx(omega, rel=1e-10)
        assert zeta == pytest.approx((c * omega + damping) / (2.0 * m * omega**2), rel=1e-9, abs=1e-11)


def test_a_mode_no_contact_sees_is_linear() -> None:
    raw: dict[str, Any] = {
        "name": "apart",
        "structure": {
            "kind": "lumped",
            "masses": {"x": 1.0, "y": 2.0},
            "springs": [
                {"between": ["x", "ground"], "k": 100.0, "c": 0.2},
                {"between": ["y", "ground"], "k": 50.0, "c": 0.3},
            ],
        },
        "contacts": [{"name": "d", "between": ["x", "ground"], "kt": 30.0, "mu": 0.3, "N0": 1.0}],
        "excitation": {"dof": "x", "amplitude": 1.0},
        "observe": {"dof": "x", "band": [0.5, 2.0]},
    }
    found = solver.nonlinear_mode(solver.Scene.from_dict(raw), 1, amplitudes=(1e-3, 1.0), harmonics=3)
    assert found.reached
    np.testing.assert_allclose(found.frequency_hz, 5.0 / (2.0 * math.pi), rtol=1e-12)
    np.testing.assert_allclose(found.damping_ratio, 0.3 / (2.0 * 2.0 * 5.0), rtol=1e-10)


def test_a_mode_without_contacts_is_the_linear_one() -> None:
    scene = one_mass(2.0, 50.0, 0.4, 1.0, 1.0)
    bare = scene.model_copy(update={"contacts": ()})
    found = solver.nonlinear_mode(bare, amplitudes=(1e-3, 1.0))
    assert found.reached
    np.testing.assert_allclose(found.damping_ratio, 0.4 / (2.0 * math.sqrt(100.0)), rtol=1e-10)


@each(
    ("keys", "name"),
    [
        ({"mode": 0}, "mode"), ({"mode": 2}, "mode"), ({"mode": True}, "mode"), ({"mode": 1.5}, "mode"),
        ({"amplitudes": (1.0, 1.0)}, "amplitudes"), ({"amplitudes": (-1.0, 1.0)}, "amplitudes"),
        ({"amplitudes": (1e-300, 1e300)}, "amplitudes"), ({"amplitudes": (1.0,)}, "amplitudes"),
        ({"amplitudes": (1.0, math.inf)}, "amplitudes"),
        ({"amplitudes": ("a", 1.0)}, "amplitudes"), ({"harmonics": 0}, "harmonics"),
        ({"nodal_diameter": 1}, "nodal_diameter"), ({"most_points": 0}, "most_points"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_by_name(keys: dict[str, Any], name: str) -> None:
    scene = one_mass(1.0, 39.478, 0.5, 30.0, 30.0)
    with pytest.raises(solver.SettingError) as refused:
        solver.nonlinear_mode(scene, **{"amplitudes": (0.1, 1.0), **keys})
    assert refused.value.name == name
    assert repr(keys[name]) in str(refused.value)


def test_a_nodal_diameter_must_fit_the_disk() -> None:
    with pytest.raises(solver.SettingError, match="from -4 to 4"):
        solver.nonlinear_mode(solver.load_scene("bladed-disk"), amplitudes=(1e-6, 1e-5), nodal_diameter=5)
