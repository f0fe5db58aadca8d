"""The condensed balance: residual against a direct evaluation, derivatives against central differences."""

import math
from collections import Counter
from dataclasses import dataclass

import numba
import numpy as np
import pytest
from contact_cases import central_difference
from each import each
from scene_cases import (
    bladed_disk,
    critically_damped,
    joined_by_a_damper,
    loose_mass,
    mixed_disk,
    oscillator,
    two_dof,
)

from solver.balance.balance import Kind, build, for_parameter, resolve
from solver.balance.kernels.output import HALF_RANGE, MAX_ABS, RANGE_SLOPE, SLOPE
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import DENSE, MODES, POLES
from solver.errors import SettingError
from solver.jit import fourier
from solver.linear.assembly import linear_model
from solver.linear.condensation import force_amplitudes
from solver.response.time_history import matrices
from solver.scene.scene import Scene

HARMONICS = 5
SCENES = {
    "two-dof": (two_dof(), 1.198),
    "two-dof stuck": (two_dof(N0=3000.0), 1.198),
    "two-dof untied": (two_dof(N1=60.0), 2.3),
    "two-dof separating": (two_dof(N1=180.0, N1_phase=0.4), 1.1),
    "bladed-disk": (bladed_disk(), 755.0),
    "bladed-disk separating": (bladed_disk(N1_ratio=1.6), 640.0),
    "mixed disk": (mixed_disk(), 620.0),
    "loose mass": (loose_mass(), 1.7),
    "critically damped": (critically_damped(), 0.2),
    "nearly so": (joined_by_a_damper(critically_damped().structure.dampers[0].c * (1.0 + 1e-7)), 0.2),
}
CASES = [
    (name, path)
    for name, (scene, _) in SCENES.items()
    for path in ("frequency", *scene.parameter_paths())
    # The loads of the second contact of the disks are covered by the first one's.
    if not (path.startswith("root.") and not path.endswith("N0"))
]

LOOSE_KT = [("loose mass", "link.kt"), ("loose mass", "floor.kt")]


@dataclass(frozen=True, kw_only=True)
class Point:
    """A place to evaluate at: near a solution, but not on it."""

    scene: Scene
    workspace: Workspace
    u: np.ndarray
    p: float


def inside_value(scene: Scene, path: str, frequency_hz: float) -> float:
    return 2.0 * math.pi * frequency_hz if path == "frequency" else scene.value(path)


def point(name: str, path: str = "frequency", *, perturbed: float = 0.2) -> Point:
    scene, frequency_hz = SCENES[name]
    fixed = None if path == "frequency" else frequency_hz
    workspace = Workspace.of(build(scene, path, harmonics=HARMONICS, frequency_hz=fixed))
    p = inside_value(scene, path, frequency_hz)
    found = workspace.solve(p)
    assert found.converged
    rng = np.random.default_rng(5)
    u = found.u + perturbed * np.abs(found.u).max() * rng.normal(size=found.u.size) / HARMONICS
    return Point(scene=scene, workspace=workspace, u=u, p=p)


def steps(p: float) -> list[float]:
    return [size * max(abs(p), 0.1) for size in (1e-4, 1e-5, 1e-6)]


@each("name", SCENES)
def test_residual_against_a_direct_evaluation(name: str):
    """r = u − L Z⁻¹ (f̂ − Lᴴ (F̂ − s û)) with Z of the whole structure, harmonic by harmonic."""
    here = point(name)
    _, evaluation = here.workspace.evaluate(here.u, here.p)
    model, shift = linear_model(here.scene), here.workspace.balance.system.shift
    u = fourier.to_complex(here.u.reshape(len(here.scene.contacts), -1))
    force = fourier.to_complex(evaluation.F)
    expected = np.empty_like(u)
    for k in range(HARMONICS + 1):
        K, C, L = matrices(model, k)
        Z = K + L.conj().T @ (shift[:, None] * L) - (k * here.p) ** 2 * model.M + 1j * k * here.p * C
        f = force_amplitudes(model, np.array([k]))[0]
        expected[:, k] = u[:, k] - L @ np.linalg.solve(Z, f - L.conj().T @ (force[:, k] - shift * u[:, k]))
    got = fourier.to_complex(evaluation.residual.reshape(u.shape[0], -1))
    np.testing.assert_allclose(got, expected, atol=1e-11 * np.abs(u).max())


def test_every_form_and_state_is_met():
    forms, states = set(), Counter()
    for name, path in CASES:
        here = point(name, path)
        forms.add(here.workspace.balance.system.form)
        _, evaluation = here.workspace.evaluate(here.u, here.p)
        states.update(evaluation.states.tolist())
    assert forms == {MODES, POLES, DENSE}
    assert min(states[state] for state in (1, 2, 3)) >= 5
    # Parameters of the other laws: tests/solver/contacts/test_laws.py.
    own = {kind for kind in Kind if kind.name.startswith("OWN")}
    assert {resolve(SCENES[name][0], path).kind for name, path in CASES} == set(Kind) - own


def test_every_balance_has_the_same_types():
    """The loops are compiled for one set of array types; another set would cost a minute at first use."""
    types = {
        tuple(str(numba.typeof(value)) for value in point(name, path).workspace.balance.system)
        for name, path in CASES
    }
    assert len(types) == 1


@each("name", SCENES)
def test_jacobian(name: str):
    here = point(name)
    _, evaluation = here.workspace.evaluate(here.u, here.p)
    exact = evaluation.jacobian.copy()

    def residual(direction: np.ndarray, x: float) -> np.ndarray:
        return here.workspace.evaluate(here.u + x * direction, here.p)[1].residual.copy()

    best = math.inf
    for step in (1e-4, 1e-5, 1e-6):
        size = step * np.abs(here.u).max()
        columns = [central_difference(lambda x, d=d: residual(d, x), size) for d in np.eye(here.u.size)]
        best = min(best, np.abs(np.array(columns).T - exact).max() / np.abs(exact).max())
    assert best < 1e-6


@each(("name", "path"), CASES)
def test_derivative_by_a_parameter(name: str, path: str):
    here = point(name, path)
    _, evaluation = here.workspace.evaluate(here.u, here.p)
    exact = evaluation.dr_dp.copy()

    def residual(x: float) -> np.ndarray:
        return here.workspace.evaluate(here.u, here.p + x)[1].residual.copy()

    floor = 1e-9 * np.abs(here.u).max() / max(abs(here.p), 0.1)
    errors = [np.abs(central_difference(residual, step) - exact).max() for step in steps(here.p)]
    assert min(errors) < 1e-6 * np.abs(exact).max() + floor


# Where contacts alone hold a part, their kt is also in the form of the equations, not only in their solution.
@each(("name", "path"), [case for case in CASES if case not in LOOSE_KT])
def test_a_moved_parameter_is_a_moved_scene(name: str, path: str):
    """λ at another value gives the residual of a scene written with that value."""
    here = point(name, path)
    p = here.p * 1.07 + 0.01
    _, evaluation = here.workspace.evaluate(here.u, p)
    frequency = 2.0 * math.pi * SCENES[name][1]
    if path == "frequency":
        other, at = here.scene, p
    else:
        other, at = here.scene.with_values({path: p}), frequency
    direct = Workspace.of(build(other, harmonics=HARMONICS))
    _, expected = direct.evaluate(here.u, at)
    scale = np.abs(here.u).max()
    np.testing.assert_allclose(evaluation.residual, expected.residual, atol=1e-10 * scale)


@each(("name", "path"), [case for case in CASES if case[1] != "frequency"])
def test_another_parameter_of_the_same_balance(name: str, path: str):
    here, start = point(name, path), build(SCENES[name][0], harmonics=HARMONICS)
    moved = Workspace.of(for_parameter(start, path, SCENES[name][1]))
    _, expected = here.workspace.evaluate(here.u, here.p)
    _, got = moved.evaluate(here.u, here.p)
    scale = np.abs(here.u).max()
    np.testing.assert_allclose(got.residual, expected.residual, atol=1e-10 * scale)
    np.testing.assert_allclose(got.dr_dp, expected.dr_dp, atol=1e-8 * np.abs(expected.dr_dp).max())


@each(("name", "path"), CASES)
def test_slopes_through_the_whole_solve(name: str, path: str):
    """d max|x| / dλ and d half-range / dλ of the solution against solving again at λ ± h."""
    here = point(name, path, perturbed=0.0)
    measures = here.workspace.measure(here.u, here.p)
    assert measures is not None
    exact = measures.values[[SLOPE, RANGE_SLOPE]].copy()

    def amplitudes(x: float) -> np.ndarray:
        found = here.workspace.solve(here.p + x, here.u)
        assert found.converged
        again = here.workspace.measure(found.u, here.p + x)
        assert again is not None
        return again.values[[MAX_ABS, HALF_RANGE]].copy()

    floor = 1e-8 * measures.values[MAX_ABS] / max(abs(here.p), 0.1)
    errors = [np.abs(central_difference(amplitudes, step) - exact).max() for step in steps(here.p)]
    assert min(errors) < 1e-6 * np.abs(exact).max() + floor


def test_no_contact_is_a_linear_answer():
    scene = oscillator(k=3.0, c=0.1, phase=0.3)
    balance = build(scene, harmonics=3)
    assert balance.n_unknowns == 0
    workspace = Workspace.of(balance)
    measures = workspace.measure(workspace.solve(1.2).u, 1.2)
    assert measures is not None
    assert measures.values[MAX_ABS] == pytest.approx(1.0 / abs(3.0 - 1.44 + 0.12j), rel=1e-12)


@pytest.mark.parametrize("harmonics", [-1, 1001, 3.0, True, "11", None])
def test_bad_numbers_of_harmonics(harmonics: object):
    with pytest.raises(SettingError) as error:
        build(two_dof(), harmonics=harmonics)  # type: ignore[arg-type]
    assert error.value.name == "harmonics"
    assert repr(harmonics) in str(error.value)


@pytest.mark.parametrize("frequency_hz", [0.0, -1.0, math.nan, math.inf, True, "1", None])
def test_bad_frequencies(frequency_hz: object):
    with pytest.raises(SettingError) as error:
        build(two_dof(), "damper.N0", frequency_hz=frequency_hz)  # type: ignore[arg-type]
    assert error.value.name == "frequency_hz"
    assert repr(frequency_hz) in str(error.value)


@pytest.mark.parametrize("path", ["damper.N2", "frequencies", "structure.k9", ""])
def test_unknown_paths_list_the_known_ones(path: str):
    with pytest.raises(SettingError, match=r"damper\.N0") as error:
        build(two_dof(), path, frequency_hz=1.0)
    assert error.value.value == path
