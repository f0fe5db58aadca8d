"""Second derivatives of frequency and damping ratio against a closed form and differences of gradients."""

import math

import numpy as np
import pytest

import solver
from solver.modes.at_amplitudes import ModePoints, damping_hessian, mode_at_amplitudes
from solver.modes.mode_gradient import ModeSensitivities, mode_hessian
from solver.modes.nonlinear_mode import pose
from tests.cases.matrix_cases import chain_raw
from tests.cases.mode_cases import one_mass, slider
from tests.cases.random_scenes import random_scene


def at(scene: solver.Scene, amplitude: float, paths: list[str], harmonics: int, **keys: object) -> ModePoints:
    return mode_at_amplitudes(scene, np.array([amplitude]), paths, harmonics=harmonics, **keys)


def check(scene: solver.Scene, amplitude: float, paths: list[str], harmonics: int) -> None:
    """Both Hessians against central differences of the gradients, relative to the largest entry."""
    found = at(scene, amplitude, paths, harmonics)
    (point,) = found.points
    assert point is not None
    problem = pose(scene, 1, None, harmonics, paths=paths)
    of_omega, of_zeta = mode_hessian(ModeSensitivities(problem.equations, paths, turns=problem.turns), point)
    sizes = np.array([abs(scene.value(path)) or 1.0 for path in paths])
    wanted = np.empty((2, len(paths), len(paths)))
    for i, path in enumerate(paths):
        step = 1e-5 * sizes[i]
        sides = [scene.with_values({path: scene.value(path) + s}) for s in (-step, step)]
        low, high = (at(side, amplitude, paths, harmonics, guesses=found.points) for side in sides)
        wanted[0, i] = 2.0 * math.pi * (high.by_frequency - low.by_frequency)[0] / (2.0 * step)
        wanted[1, i] = (high.by_damping - low.by_damping)[0] / (2.0 * step)
    both = np.outer(sizes, sizes)
    for got, difference in zip((of_omega, of_zeta), wanted, strict=True):
        assert np.abs((got - difference) * both).max() <= 1e-5 * np.abs(difference * both).max()


def test_a_slider_in_closed_form() -> None:
    """One harmonic: ω² m = k + k_eq, ζ = (ω c + ω c_eq)/(2 m ω²), by differences."""
    m, k, c, kt, limit, a = 2.0, 50.0, 0.3, 20.0, 4.0, 0.9

    def ratio(kt: float, limit: float, k: float) -> float:
        stiffness, lossy = slider(a / math.sqrt(m), kt, limit)
        omega2 = (k + stiffness) / m
        return 0.5 * (c / math.sqrt(omega2) + lossy / omega2) / m

    paths, values = ["damper.kt", "damper.N0", "structure.spring"], np.array([kt, limit, k])
    scene = one_mass(m, k, c, kt, limit)
    (point,) = at(scene, a, paths, 1).points
    assert point is not None
    found = damping_hessian(scene, paths, point, harmonics=1) * np.outer([1, 2, 1], [1, 2, 1])  # N0 = 2 limit
    steps = np.diag(2e-4 * values)
    for i in range(3):
        for j in range(3):
            corners = [(si, sj) for si in (1, -1) for sj in (1, -1)]
            total = sum(si * sj * ratio(*(values + si * steps[i] + sj * steps[j])) for si, sj in corners)
            wanted = total / (4.0 * steps[i, i] * steps[j, j])
            assert found[i, j] * values[i] * values[j] == pytest.approx(
                wanted * values[i] * values[j], rel=1e-4, abs=1e-6
            )


@pytest.mark.parametrize("seed", [1, *(pytest.param(one, marks=pytest.mark.long) for one in range(2, 12))])
def test_every_path_of_a_random_scene(seed: int) -> None:
    scene, _, _ = random_scene(seed)
    paths = [p for p in scene.parameter_paths() if p.split(".")[-1] in ("kt", "mu", "N0")]
    check(scene, 0.5, paths, 5)


def test_structure_masses_and_loads_that_move() -> None:
    raw = chain_raw()
    raw["structure"]["masses"] = {"a": {"m": 1.0, "name": "heavy"}, "b": 0.7, "c": 0.4}
    raw["structure"]["springs"][0]["name"] = "foot"
    raw["structure"]["springs"][1] |= {"c": 0.3, "name": "lossy"}
    paths = ["structure.heavy", "structure.foot", "structure.lossy", "one.N1", "one.N1_phase", "two.mu"]
    check(solver.Scene.from_dict(raw), 0.3, [*paths, "excitation.phase"], 5)


def test_a_disk() -> None:
    paths = ["shroud.kt", "shroud.N0", "structure.tip_middle", "root.mu"]
    check(solver.load_scene("bladed-disk"), 1e-5, paths, 3)


def test_a_law_without_second_derivatives_is_refused() -> None:
    scene = solver.load_scene("platform-wedge")
    found = at(scene, 1e-5, ["wedge.mass"], 1)
    (point,) = found.points
    assert point is not None
    with pytest.raises(solver.SettingError, match=r"second derivatives|places"):
        damping_hessian(scene, ["wedge.angle"], point, harmonics=1)
