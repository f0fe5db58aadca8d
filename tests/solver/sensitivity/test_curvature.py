"""The exact Hessian of amplitudes, peaks and band edges: against differences through the whole solve."""

import math

import numpy as np
import pytest
from curvature_cases import (
    ALL,
    HARMONICS,
    check_hessian_of_a_peak,
    difference,
    error_of_hessian,
    peak_of,
    sizes,
    solved,
)
from law_scene_cases import DAHL
from law_scene_cases import scene as two_directions
from matrix_cases import beam_scene
from sensitivity_cases import BEAM, TWO_DOF, disk, loose, two_dof

import solver
from solver.balance.simplifications import Effects
from solver.continuation.extrema.extrema import HALF_POWER
from solver.errors import SettingError
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities


def named_parts() -> Scene:
    """Masses, springs and dashpots that are parameters, one spring shared by two."""
    spring = {"between": ["m1", "ground"], "k": 40.0, "c": 0.5}
    return Scene.from_dict(
        {
            "name": "named",
            "structure": {
                "kind": "lumped",
                "masses": {"m1": {"m": 1.0, "name": "first"}, "m2": {"m": 1.2, "name": "second"}},
                "springs": [
                    {**spring, "name": "one", "group": "both"},
                    {"name": "two", "between": ["m1", "m2"], "k": 20.0, "c": 0.5, "group": "both",
                     "factor": 0.5},
                ],
                "dampers": [{"name": "dashpot", "between": ["m2", "ground"], "c": 0.3}],
            },
            "contacts": [{"name": "slider", "between": ["m2", "ground"], "kt": 30.0, "mu": 0.3, "N0": 60.0,
                          "N1": 20.0}],
            "excitation": [{"dof": "m1", "amplitude": 60.0}, {"dof": "m2", "amplitude": 20.0, "phase": 0.7},
                           {"dof": "m2", "amplitude": 9.0, "harmonic": 0}],
            "observe": {"dof": "m2", "band": [0.2, 2.0]},
        }
    )  # fmt: skip


CASES: dict[str, tuple[Scene, float, tuple[str, ...], Effects]] = {
    "two-dof": (two_dof(), 1.1, TWO_DOF, ALL),
    "two-dof, in matrices": (two_dof(), 1.1, ("damper.N0", "damper.kt", "damper.mu"),
                             Effects(whole_matrices=True)),
    "two-dof, separating": (two_dof(N1_ratio=1.5), 1.1, TWO_DOF, ALL),
    "two-dof, N1 untied": (two_dof(N1=30.0), 1.1, ("damper.N0", "damper.N1", "damper.N1_phase", "damper.mu"),
                           ALL),
    "two-dof, odd harmonics": (two_dof(N1_ratio=0.0), 1.1, ("damper.N0", "damper.kt", "structure.k1"),
                               Effects()),
    "bladed disk": (disk(), 753.0, ("shroud.N0", "shroud.kt", "root.mu", "root.kt", "structure.tip_middle",
                                    "structure.disk_next", "excitation.phase"), ALL),
    "bladed disk, separating": (disk(**{"shroud.N1": 400.0}), 700.0,
                                ("shroud.N0", "shroud.N1", "shroud.kt", "structure.middle_root"), ALL),
    "loose parts and groups": (loose(), 0.8, ("one.N0", "pair.kt", "pair.mu", "structure.both"), ALL),
    "a beam of matrices": (beam_scene(8, mass_proportional_damping=0.1), 2.4, BEAM, Effects()),
    "a beam of matrices, whole": (beam_scene(8, mass_proportional_damping=0.1), 2.4, BEAM,
                                  Effects(whole_matrices=True)),
    "named parts": (named_parts(), 0.85, ("structure.first", "structure.second", "structure.one",
                                          "structure.both", "structure.dashpot", "slider.N1_ratio",
                                          "excitation.amplitude", "excitation.phase"), ALL),
}  # fmt: skip


@pytest.mark.few(3)
@pytest.mark.parametrize("case", CASES)
def test_the_hessian_equals_differences_of_the_gradient(case: str) -> None:
    scene, hz, paths, effects = CASES[case]
    assert error_of_hessian(scene, hz, paths, effects) <= 1e-7


PEAKS: dict[str, tuple[Scene, float, tuple[str, ...]]] = {
    "two-dof": (two_dof(), 1.0, TWO_DOF[:-1]),
    "two-dof, second peak": (two_dof(), 2.3, TWO_DOF[:-1]),
    "two-dof, separating": (two_dof(N1_ratio=1.5), 1.0, TWO_DOF[:-1]),
    "bladed disk": (disk(), 754.0, ("shroud.N0", "shroud.kt", "root.mu", "root.N0", "structure.tip_middle")),
    "bladed disk, separating": (disk(**{"shroud.N1": 400.0}), 513.0,
                                ("shroud.N0", "shroud.kt", "shroud.N1", "structure.tip_middle")),
}  # fmt: skip


@pytest.mark.few(keep=("two-dof",))
@pytest.mark.parametrize("case", PEAKS)
def test_the_hessian_of_a_peak_equals_differences_through_the_sweep(case: str) -> None:
    scene, near, paths = PEAKS[case]
    check_hessian_of_a_peak(scene, near, paths)


@pytest.mark.few(2)
@pytest.mark.parametrize("half_power", [False, True])
def test_band_edges_to_second_order(half_power: bool) -> None:
    """With a fixed limit, and with one that is a share of the peak."""
    scene, paths = two_dof(), ("damper.N0", "damper.kt", "structure.k2")
    _, peak = peak_of(scene, 1.0)
    limit = None if half_power else 0.8 * peak.value
    size = sizes(scene, paths)

    def edges(there: Scene) -> np.ndarray:
        swept = solver.sweep(there, harmonics=HARMONICS, effects=ALL, limit=limit)
        sensitivities = Sensitivities(swept.balance, paths)
        highest, band = swept.peak, swept.band
        assert highest is not None
        assert band is not None
        dlimit = sensitivities.gradient(highest.solution, highest.at).by_parameters * HALF_POWER
        return np.array([
            sensitivities.hessian(edge.solution, edge.at).of_edge(dlimit if half_power else None).gradient
            for edge in band.edges
        ])  # fmt: skip

    swept = solver.sweep(scene, harmonics=HARMONICS, effects=ALL, limit=limit)
    assert swept.band is not None
    sensitivities = Sensitivities(swept.balance, paths)
    highest = sensitivities.peak_hessian(peak.solution, peak.at)
    derivatives = (highest.gradient * HALF_POWER, highest.hessian * HALF_POWER) if half_power else ()
    for j, edge in enumerate(swept.band.edges):
        found = sensitivities.hessian(edge.solution, edge.at).of_edge(*derivatives)
        np.testing.assert_allclose(found.gradient, edges(scene)[j], rtol=1e-9)
        for i, path in enumerate(paths):

            def moved(x: float, path: str = path, j: int = j) -> np.ndarray:
                return edges(scene.with_values({path: scene.value(path) + x}))[j] * size

            wanted = found.hessian[i] * size
            error = np.abs(difference(moved, wanted, size[i]) - wanted) * size[i]
            scale = max(edge.at, float(np.abs(found.hessian * np.outer(size, size)).max()))
            assert error.max() <= 1e-6 * scale


def test_the_peak_is_homogeneous_in_force_and_loads() -> None:
    """A(s f0, s N0) = s A(f0, N0), so the Hessian takes (f0, N0) to 0; the law knows kt u and mu N alone."""
    branch, peak = peak_of(two_dof(), 1.0)
    paths = ("excitation.amplitude", "damper.N0", "damper.mu")
    found = Sensitivities(branch.balance, paths).peak_hessian(peak.solution, peak.at)
    f0, N0, mu = (branch.balance.scene.value(path) for path in paths)
    scale = float(np.abs(found.hessian * [f0, N0, mu]).max())
    by_both = [0.0, 0.0, found.gradient[2]]
    np.testing.assert_allclose(found.hessian @ [f0, N0, 0.0], by_both, atol=1e-9 * scale)
    np.testing.assert_allclose(found.gradient @ [f0, N0, 0.0], peak.value, rtol=1e-9)
    np.testing.assert_allclose(found.drift @ [f0, N0, 0.0], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.hessian[1, 1] * N0**2, found.hessian[2, 2] * mu**2, rtol=1e-9)


def test_a_peak_that_is_not_smooth_has_no_hessian() -> None:
    """Off the peak, and at a peak where a contact changes its state."""
    scene = disk(**{"shroud.N1": 250.0})
    branch, peak = peak_of(scene, 532.0)
    sensitivities = Sensitivities(branch.balance, ("shroud.N0",))
    assert abs(sensitivities.gradient(peak.solution, peak.at).by_frequency) > 0.1 * peak.value / peak.at
    assert np.isnan(sensitivities.peak_hessian(peak.solution, peak.at).hessian).all()
    balance, u = solved(scene, 812.0, ALL)
    beside = Sensitivities(balance, ("shroud.N0",)).hessian(u, 812.0)
    assert np.isfinite(beside.hessian).all()
    assert np.isnan(beside.of_peak().drift).all()


def test_what_breaks_a_symmetry_has_a_kink_and_no_hessian() -> None:
    scene = two_dof(N1_ratio=0.0)
    balance, u = solved(scene, 1.1, ALL)
    found = Sensitivities(balance, ("damper.N0", "damper.N1_ratio")).hessian(u, 1.1)
    assert math.isfinite(found.hessian[0, 0])
    assert math.isfinite(found.mixed[0])
    assert np.isnan(found.hessian[1]).all()
    assert np.isnan(found.hessian[:, 1]).all()


def test_what_has_no_hessian_is_refused_by_name() -> None:
    other = two_directions(DAHL, {"kt": 1.0, "mu": 0.3, "N0": 0.4})
    balance, u = solved(other, 0.2, ALL)
    with pytest.raises(SettingError, match=r"no second derivatives: c0 \(dahl\)"):
        Sensitivities(balance, ["c1.N0"]).hessian(u, 0.2)
    balance, u = solved(two_dof(), 1.1, ALL)
    for paths in (("damper.N1", "damper.N0"), ("damper.N1", "damper.N1_ratio")):
        with pytest.raises(SettingError, match="contradict each other"):
            Sensitivities(balance, paths).hessian(u, 1.1)
    balance, u = solved(two_dof(N1=30.0), 1.1, ALL)
    with pytest.raises(SettingError, match="contradict each other"):
        Sensitivities(balance, ("damper.N1_ratio", "damper.N0")).hessian(u, 1.1)


def test_a_singular_balance_has_no_hessian() -> None:
    balance, u = solved(two_dof(), 1.1, ALL)
    found = Sensitivities(balance, ("damper.N0", "damper.kt")).hessian(u * math.nan, 1.1)
    assert math.isnan(found.value)
    assert np.isnan(found.hessian).all()
    assert np.isnan(found.of_peak().hessian).all()
