"""Quadratic and cubic tensors over several DOFs: the tensors themselves, closed forms, SciPy, the march."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each import each
from lumped_structure import lumped
from scipy.integrate import quad, solve_ivp
from scipy.io import savemat
from scipy.optimize import brentq

import solver
from solver.scene.tensor_springs import tensor_springs

Array = np.ndarray


def symmetric(tensor: Array) -> Array:
    return np.mean([np.transpose(tensor, order) for order in permutations(range(tensor.ndim))], axis=0)


def force(Q: Array | None, C: Array | None, x: Array) -> Array:
    found = np.zeros(x.size)
    if Q is not None:
        found = found + np.einsum("ijk,j,k->i", Q, x, x)
    if C is not None:
        found = found + np.einsum("ijkl,j,k,l->i", C, x, x, x)
    return found


def force_of(contacts: list[dict[str, Any]], dofs: list[str], x: Array) -> Array:
    found = np.zeros(x.size)
    for contact in contacts:
        w = np.array([contact["motions"][0].get(dof, 0.0) for dof in dofs])
        u = float(w @ x)
        found += w * (contact.get("a2", 0.0) * u**2 + contact.get("a3", 0.0) * u**3)
    return found


@each("seed", range(30))
def test_the_springs_have_the_force_of_the_tensors(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, sizes = int(rng.integers(1, 6)), 10.0 ** rng.uniform(-3, 3, size=5)
    dofs, s = [f"x{i}" for i in range(n)], sizes[:n]
    Q, C = (symmetric(rng.normal(size=(n,) * d) * (rng.random((n,) * d) < 0.6)) for d in (3, 4))
    if seed % 2:  # each DOF alone says how large its motions are
        Q[(range(n),) * 3], C[(range(n),) * 4] = rng.uniform(0.5, 2.0, size=(2, n))
    else:
        s = np.ones(n)
    Q, C = np.einsum("ijk,i,j,k->ijk", Q, *[1 / s] * 3), np.einsum("ijkl,i,j,k,l->ijkl", C, *[1 / s] * 4)
    given = [(Q, C), (Q, None), (None, C)][seed % 3]
    contacts = tensor_springs("t", dofs, quadratic=given[0], cubic=given[1])
    for _ in range(5):
        x = rng.normal(size=n) * s
        size = 1e-300 + np.abs(force(*(None if T is None else np.abs(T) for T in given), np.abs(x)) * s).max()
        error = np.abs((force_of(contacts, dofs, x) - force(*given, x)) * s).max()
        assert error <= 1e-11 * size


def test_what_is_written_in_one_order_alone_is_the_same() -> None:
    """f_0 = 6 x_0 x_1, f_1 = 3 x_0²: entries behind the first index in any order."""
    Q = np.zeros((2, 2, 2))
    Q[0, 0, 1], Q[1, 0, 0] = 6.0, 3.0
    found = tensor_springs("t", ["a", "b"], quadratic=Q)
    assert force_of(found, ["a", "b"], np.array([0.3, -0.7])) == pytest.approx([6 * 0.3 * -0.7, 3 * 0.09])


def scene(masses: dict[str, float], k: list[float], contacts: list[dict[str, Any]], **more: Any) -> Any:
    springs = [(dof, "ground", each, 0.02) for dof, each in zip(masses, k, strict=True)]
    raw = {
        "name": "coupled", "structure": lumped(masses, *springs), "contacts": contacts,
        "excitation": {"dof": next(iter(masses)), "amplitude": 0.1},
        "observe": {"dof": next(iter(masses)), "band": [0.02, 0.6]},
    }  # fmt: skip
    return solver.Scene.from_dict({**raw, **more})


@pytest.mark.parametrize("hz", [0.1, 0.13, 0.25])
def test_duffings_oscillator_has_its_amplitude(hz: float) -> None:
    given = scene({"a": 1.0}, [1.0], tensor_springs("t", ["a"], cubic=[[[[0.4]]]]))
    omega = 2.0 * math.pi * hz

    def mismatch(a: float) -> float:
        return (((1.0 - omega**2 + 0.75 * 0.4 * a**2) ** 2 + (0.02 * omega) ** 2) * a**2) - 0.01

    found = solver.solve(given, frequency_hz=hz, harmonics=1)
    assert found.max_abs == pytest.approx(
        brentq(mismatch, 0.9 * found.max_abs, 1.1 * found.max_abs), rel=1e-9
    )


def two_springs(w1: float, w2: float) -> tuple[Array, Array]:
    """A mass on two springs in a plane, moved finitely: C. Touzé, O. Thomas, A. Chaigne, J. Sound Vib. 273
    (2004) 77, doi:10.1016/j.jsv.2003.04.005: with squares p, q of the frequencies,

    f_1 = p/2 (3 x² + y²) + q x y + (p + q)/2 x (x² + y²),
    f_2 = q/2 (3 y² + x²) + p x y + (p + q)/2 y (x² + y²).
    """
    p, q = w1**2, w2**2
    Q, C = np.zeros((2,) * 3), np.zeros((2,) * 4)
    Q[0, 0, 0], Q[0, 1, 1], Q[0, 0, 1] = 1.5 * p, 0.5 * p, q
    Q[1, 1, 1], Q[1, 0, 0], Q[1, 0, 1] = 1.5 * q, 0.5 * q, p
    C[0, 0, 0, 0] = C[0, 0, 1, 1] = C[1, 1, 1, 1] = C[1, 0, 0, 1] = 0.5 * (p + q)
    return Q, C


@pytest.mark.few(4)
@pytest.mark.parametrize("hz", [0.1, 0.2, 0.3])
def test_a_mass_on_two_springs_is_what_marching_and_scipy_give(hz: float) -> None:
    Q, C = two_springs(1.0, 1.7)
    given = scene({"x": 1.0, "y": 1.0}, [1.0, 1.7**2], tensor_springs("t", ["x", "y"], quadratic=Q, cubic=C))
    found = solver.solve(given, frequency_hz=hz, harmonics=15)
    referee = solver.march(given, frequency_hz=hz)
    assert found.converged
    assert found.max_abs == pytest.approx(referee.max_abs, rel=1e-6)
    K = np.array([1.0, 1.7**2])

    def rate(t: float, s: Array) -> Array:
        push = np.array([0.1 * math.cos(2.0 * math.pi * hz * t), 0.0])
        return np.concatenate([s[2:], push - K * s[:2] - 0.02 * s[2:] - force(Q, C, s[:2])])

    run = solve_ivp(rate, (0.0, 180.0 / hz), np.zeros(4), method="DOP853", rtol=1e-9, atol=1e-11)
    last = run.t > 178.0 / hz
    assert referee.max_abs == pytest.approx(np.abs(run.y[0, last]).max(), rel=2e-2)


def clamped_mode(b: float) -> tuple[float, Callable[[float], float], Callable[[float], float]]:
    s = (math.cosh(b) - math.cos(b)) / (math.sinh(b) - math.sin(b))

    def shape(x: float) -> float:
        return math.cosh(b * x) - math.cos(b * x) - s * (math.sinh(b * x) - math.sin(b * x))

    def slope(x: float) -> float:
        return b * (math.sinh(b * x) + math.sin(b * x) - s * (math.cosh(b * x) - math.cos(b * x)))

    return b, shape, slope


def clamped(count: int) -> list[Any]:
    """β, mode with ∫φ² = 1 and its slope of a clamped beam of unit length."""

    def characteristic(b: float) -> float:
        return math.cos(b) * math.cosh(b) - 1.0

    roots = [brentq(characteristic, (i + 1.4) * math.pi, (i + 1.6) * math.pi) for i in range(count)]
    return [clamped_mode(b) for b in roots]


def stretched(modes: list[Any]) -> tuple[Array, Array]:
    """β⁴ and the cubic tensor of von Kármán's beam, deflections in radii of gyration: f = ½ S q (q · S q)."""
    S = np.array([[quad(lambda x, f=f, g=g: f(x) * g(x), 0, 1)[0] for *_, g in modes] for *_, f in modes])
    return np.array([b**4 for b, *_ in modes]), symmetric(0.5 * np.einsum("ij,kl->ijkl", S, S))


def hinged() -> list[Any]:
    root = math.sqrt(2.0)
    return [(
        math.pi, lambda x: root * math.sin(math.pi * x), lambda x: root * math.pi * math.cos(math.pi * x)
    )]  # fmt: skip


def of_clamped() -> float:
    """3/8 (∫φ'²)² / (β⁴ φ(½)²), ∫φ'² = σβ (σβ − 2): R. D. Blevins, Formulas for Natural Frequency, 1979."""
    ((b, shape, _),) = clamped(1)
    sb = b * (math.cosh(b) - math.cos(b)) / (math.sinh(b) - math.sin(b))
    return 0.375 * (sb * (sb - 2.0)) ** 2 / (b**4 * shape(0.5) ** 2)


@pytest.mark.parametrize(("modes", "coefficient"), [(hinged(), 3.0 / 16.0), (clamped(1), of_clamped())])
def test_a_stretched_beam_stiffens_as_published(modes: list[Any], coefficient: float) -> None:
    """ω² = ω_0² (1 + coefficient (a/r)²) of the deflection a at mid-span, to the first harmonic.

    S. Woinowsky-Krieger, J. Appl. Mech. 17 (1950) 35, for hinged ends.
    """
    squares, C = stretched(modes)
    contacts = tensor_springs("t", ["q"], cubic=C)
    unit = float(squares[0])
    contacts = [{**each, "a3": each["a3"] / unit} for each in contacts]
    middle = modes[0][1](0.5)
    found = solver.nonlinear_mode(scene({"q": 1.0}, [1.0], contacts), 1, amplitudes=[0.01, 1.0], harmonics=1)
    ratio = (2.0 * math.pi * found.frequency_hz[-1]) ** 2
    a = middle * found.max_abs[-1]
    assert (ratio - 1.0) / a**2 == pytest.approx(coefficient, rel=1e-5)


def test_three_modes_of_a_clamped_beam_are_marched() -> None:
    squares, C = stretched(clamped(3))
    unit, dofs = float(squares[0]), ["q1", "q2", "q3"]
    given = scene(
        dict.fromkeys(dofs, 1.0), (squares / unit).tolist(), tensor_springs("t", dofs, cubic=C / unit),
        excitation=[{"forces": {"q1": 1.0, "q2": 0.7, "q3": 0.5}, "amplitude": 2.0}],
    )  # fmt: skip
    found, referee = (
        solver.solve(given, frequency_hz=0.1, harmonics=25),
        solver.march(given, frequency_hz=0.1),
    )
    assert found.converged
    assert found.max_abs == pytest.approx(referee.max_abs, rel=1e-5)
    assert solver.stability(found).stable is True


@pytest.mark.parametrize("ending", ["npz", "json", "mat"])
def test_a_scene_reads_its_tensors_from_a_file(tmp_path: Path, ending: str) -> None:
    Q, C = two_springs(1.0, 1.7)
    path = tmp_path / f"springs.{ending}"
    if ending == "npz":
        np.savez(path, quadratic=Q, cubic=C)
    elif ending == "mat":
        savemat(path, {"quadratic": Q, "cubic": C})
    else:
        path.write_text(json.dumps({"quadratic": Q.tolist(), "cubic": C.tolist()}))
    plain = scene({"x": 1.0, "y": 1.0}, [1.0, 1.7**2], [])
    raw = {**plain.to_dict(), "tensors": [{"name": "t", "dofs": ["x", "y"], "file": path.name}]}
    (tmp_path / "scene.json").write_text(json.dumps(raw))
    found = solver.load_scene(tmp_path / "scene.json")
    contacts = tensor_springs("t", ["x", "y"], quadratic=Q, cubic=C)
    assert found == scene({"x": 1.0, "y": 1.0}, [1.0, 1.7**2], contacts)
    assert solver.Scene.from_dict(found.to_dict()) == found


def test_what_is_wrong_is_told(tmp_path: Path) -> None:
    lopsided = np.zeros((2, 2, 2))
    lopsided[0, 1, 1] = 3.0
    with pytest.raises(solver.SettingError, match=r"`quadratic` must be that of a potential.*got 'entry"):
        tensor_springs("t", ["a", "b"], quadratic=lopsided)
    with pytest.raises(solver.SettingError, match=r"`cubic` must have 2 x 2 x 2 x 2 finite numbers"):
        tensor_springs("t", ["a", "b"], cubic=np.ones((2, 2)))
    with pytest.raises(solver.SettingError, match=r"must need at most"):
        tensor_springs("t", [f"x{i}" for i in range(14)], cubic=np.ones((14,) * 4))
    raw = scene({"x": 1.0}, [1.0], []).to_dict()
    for table, said in [
        ({"name": "t", "dofs": ["x"], "file": "no.npz"}, r"must be a .npz, .json or .mat file"),
        ({"name": "t", "dofs": ["x"], "sextic": 1.0}, r"must be a table with"),
        ({"name": "t", "dofs": ["z"], "cubic": [[[[1.0]]]]}, r"there is no DOF 'z'"),
    ]:
        (tmp_path / "scene.json").write_text(json.dumps({**raw, "tensors": [table]}))
        with pytest.raises(solver.SceneError, match=said):
            solver.load_scene(tmp_path / "scene.json")
