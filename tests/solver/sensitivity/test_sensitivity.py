"""Derivatives by many parameters from one adjoint: against one at a time, and against differences."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from contact_cases import central_difference
from each import each
from law_scene_cases import CUBIC, GAP, PLANE, RUB
from law_scene_cases import scene as two_directions
from matrix_cases import beam_scene
from sensitivity_cases import BEAM, TWO_DOF, disk, loose, two_dof

import solver
from solver.balance.balance import Balance, build, for_parameter
from solver.balance.kernels.output import MAX_ABS, SLOPE
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.errors import SettingError
from solver.scene.parameter_paths import parameter_paths
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.nonsmooth import PeakKind, peak_gradient

HARMONICS = 7
DISK = ("shroud.N0", "shroud.N1", "shroud.kt", "root.mu", "root.kt", "structure.tip_middle",
        "structure.disk_next", "excitation.amplitude")  # fmt: skip


ANY_LAW = two_directions(RUB, GAP, CUBIC, {"kt": 1.0, "mu": 0.3, "N0": 0.4, "N1": 0.1})
CASES: dict[str, tuple[Scene, float, tuple[str, ...]]] = {
    "two-dof": (two_dof(), 1.1, TWO_DOF),
    "two-dof, separating": (two_dof(N1_ratio=1.5), 1.1, TWO_DOF),
    "two-dof, N1 untied": (two_dof(N1=30.0), 1.1, (*TWO_DOF, "damper.N1")),
    "two-dof, symmetric": (two_dof(N1_ratio=0.0), 1.1, TWO_DOF),
    "bladed disk": (disk(), 753.0, DISK),
    "bladed disk, separating": (disk(**{"shroud.N1": 400.0}), 700.0, DISK),
    "loose parts and groups": (
        loose(), 0.8, ("one.N0", "pair.kt", "pair.mu", "one.N1", "structure.both", "structure.left"),
    ),
    "a beam of matrices": (beam_scene(8, mass_proportional_damping=0.1), 2.4, BEAM),
    "a beam of matrices, not proportional": (
        beam_scene(8, mass_proportional_damping=0.1, C=np.diag(np.linspace(0.0, 0.5, 16)).tolist()), 2.4,
        BEAM,
    ),
    "mistuned disk": (
        solver.mistuned(disk(), of=["tip_middle"], spread=0.02, seed=1), 753.0,
        ("shroud.N0", "root.kt", "structure.tip_middle"),
    ),
    "every law": (ANY_LAW, 0.2, parameter_paths(ANY_LAW)),
    "two directions": (
        two_directions(PLANE | {"limit": "circle", "N1": 0.1}), 0.2, ("c0.N0", "c0.kt", "c0.mu", "c0.N1"),
    ),
    "two directions, square limit": (
        two_directions(PLANE | {"limit": "box", "N1": 0.1}, CUBIC), 0.2, ("c0.N0", "c0.kt", "c0.mu", "c1.a3"),
    ),
}  # fmt: skip


def solved(case: str) -> tuple[Balance, np.ndarray, float]:
    scene, hz, _ = CASES[case]
    balance = build(scene, harmonics=HARMONICS, effects=Effects(even_harmonics=True))
    found = Workspace.of(balance).solve(2.0 * math.pi * hz)
    assert found.converged
    return balance, found.u, hz


@each("case", CASES)
def test_all_parameters_at_once_equal_one_at_a_time(case: str) -> None:
    balance, u, hz = solved(case)
    paths = CASES[case][2]
    found = Sensitivities(balance, paths).gradient(u, hz)
    by_frequency = Workspace.of(balance).measure(u, 2.0 * math.pi * hz)
    assert by_frequency is not None
    assert found.value == pytest.approx(by_frequency.values[MAX_ABS], rel=1e-13)
    assert found.by_frequency == pytest.approx(2.0 * math.pi * by_frequency.values[SLOPE], rel=1e-9)
    for path, slope in zip(paths, found.by_parameters, strict=True):
        alone = for_parameter(balance, path, hz)
        value = balance.scene.value(path)
        measured = Workspace.of(alone).measure(u, value)
        assert measured is not None
        floor = 1e-12 * found.value / (abs(value) or 1.0)
        assert slope == pytest.approx(measured.values[SLOPE], rel=1e-8, abs=floor), path


@pytest.mark.parametrize("case", [case for case in CASES if "symmetric" not in case])
def test_the_gradient_equals_differences_through_the_solve(case: str) -> None:
    balance, u, hz = solved(case)
    paths = CASES[case][2]
    scene = CASES[case][0]
    found = Sensitivities(balance, paths).gradient(u, hz)

    def amplitude(there: Scene, at: float) -> np.ndarray:
        moved = Workspace.of(build(there, harmonics=HARMONICS, effects=Effects(even_harmonics=True)))
        point = moved.solve(2.0 * math.pi * at, u)
        assert point.converged
        measured = moved.measure(point.u, 2.0 * math.pi * at)
        assert measured is not None
        return np.array(measured.values[MAX_ABS])

    def error(exact: float, function: Any, size: float) -> float:
        floor = 1e-9 * found.value / size
        differences = [central_difference(function, step * size) for step in (1e-3, 1e-4)]
        return min(abs(float(d) - exact) - 1e-6 * abs(exact) - floor for d in differences if d is not None)

    assert error(found.by_frequency, lambda x: amplitude(scene, hz + x), 0.1 * hz) < 0.0
    for path, slope in zip(paths, found.by_parameters, strict=True):
        value = scene.value(path)

        def moved(x: float, path: str = path, value: float = value) -> np.ndarray:
            return amplitude(scene.with_values({path: value + x}), hz)

        assert error(float(slope), moved, abs(value) or 1.0) < 0.0, path


def test_a_structure_without_contacts() -> None:
    """The amplitude of one mass is amplitude/|k − mω² + icω|."""
    scene = Scene.from_dict(
        {
            "name": "plain",
            "structure": {"kind": "lumped", "masses": {"a": {"m": 2.0, "name": "m"}},
                          "springs": [{"name": "k", "between": ["a", "ground"], "k": 50.0, "c": 0.4}]},
            "contacts": [], "excitation": {"dof": "a", "amplitude": 3.0},
            "observe": {"dof": "a", "band": [0.2, 2.0]},
        }
    )  # fmt: skip
    balance = build(scene, harmonics=1)
    paths = ("structure.k", "structure.m", "excitation.amplitude", "excitation.phase")
    found = Sensitivities(balance, paths).gradient(np.zeros(0), 0.9)
    omega = 2.0 * math.pi * 0.9
    z = 50.0 - 2.0 * omega**2 + 0.4j * omega
    value = 3.0 / abs(z)
    by_real = -value * z.real / abs(z) ** 2
    by_omega = by_real * -4.0 * omega - value * z.imag / abs(z) ** 2 * 0.4
    assert found.value == pytest.approx(value, rel=1e-12)
    assert found.by_frequency == pytest.approx(2.0 * math.pi * by_omega, rel=1e-12)
    expected = [by_real, by_real * -(omega**2), value / 3.0, 0.0]
    np.testing.assert_allclose(found.by_parameters, expected, rtol=1e-12, atol=1e-12)


def test_what_cannot_be_differentiated_is_refused_by_name() -> None:
    scene = two_dof(N1_ratio=0.0)
    with pytest.raises(SettingError, match="even harmonics"):
        Sensitivities(build(scene, harmonics=3), ["damper.N1_ratio"])
    with pytest.raises(SettingError, match="frequency"):
        Sensitivities(build(scene, harmonics=3), ["frequency"])
    with pytest.raises(SettingError, match="damper"):
        Sensitivities(build(scene, harmonics=3), ["damper.N9"])
    with pytest.raises(SettingError, match="must continue in the frequency"):
        Sensitivities(build(scene, "damper.N0", harmonics=3, frequency_hz=1.0), ["damper.kt"])
    sampled = build(scene, harmonics=3)
    sampled = replace(sampled, system=sampled.system._replace(samples=64))
    with pytest.raises(SettingError, match="closed form"):
        Sensitivities(sampled, ["damper.N0"])


def test_a_singular_balance_gives_no_number() -> None:
    """Without damping, at the resonance."""
    scene = two_dof().with_values({"damper.mu": 0.0})
    balance = build(scene, harmonics=3)
    found = Sensitivities(balance, ["damper.N0"]).gradient(np.full(balance.n_unknowns, math.nan), 1.0)
    assert math.isnan(found.value)
    assert math.isnan(found.by_frequency)
    assert np.isnan(found.by_parameters).all()


def height(scene: Scene, near: float, **settings: Any) -> solver.Peak:
    branch = solver.sweep(scene, harmonics=HARMONICS, effects=Effects(even_harmonics=True), **settings)
    return min(branch.peaks, key=lambda peak: abs(peak.at - near))


@pytest.mark.parametrize("half", ["top", "side"])
def test_a_peak_that_is_a_corner(half: str) -> None:
    """The shroud begins to slip at the top: neither side's partial derivative is that of the peak."""
    scene, paths = disk(**{"shroud.N1": 250.0}), ("shroud.N0", "shroud.kt", "shroud.N1", "root.N0")
    peak = height(scene, 532.6)
    balance = build(scene, harmonics=HARMONICS)
    sensitivities = Sensitivities(balance, paths)
    if half == "side":
        workspace = Workspace.of(balance)
        beside = workspace.solve(2.0 * math.pi * 0.999 * peak.at, peak.solution)
        off = solver.Peak(value=peak.value, at=0.999 * peak.at, solution=beside.u, interior=True)
        assert peak_gradient(sensitivities, off).kind is PeakKind.UNRESOLVED
        return
    found = peak_gradient(sensitivities, peak)
    assert found.kind is PeakKind.CORNER
    alone = sensitivities.gradient(peak.solution, peak.at).by_parameters
    assert abs(alone[0] / found.gradient[0] - 1.0) > 0.5
    for path, slope in zip(paths, found.gradient, strict=True):
        value = scene.value(path)

        def top(x: float, path: str = path, value: float = value) -> np.ndarray:
            return np.array(height(scene.with_values({path: value + x}), peak.at).value)

        difference = central_difference(top, 1e-4 * value)
        assert slope == pytest.approx(float(difference), abs=1e-6 * peak.value / value * 15.0)


def test_smooth_peaks_and_ends_of_the_band() -> None:
    scene, paths = two_dof(), ("damper.N0", "damper.kt")
    branch = solver.sweep(scene, harmonics=HARMONICS, start=1.1, stop=1.6)
    sensitivities = Sensitivities(branch.balance, paths)
    end = next(peak for peak in branch.peaks if not peak.interior)
    found = peak_gradient(sensitivities, end)
    assert found.kind is PeakKind.END
    expected = sensitivities.gradient(end.solution, end.at).by_parameters
    np.testing.assert_array_equal(found.gradient, expected)
    smooth = height(scene, 1.0)
    assert peak_gradient(sensitivities, smooth).kind is PeakKind.SMOOTH
