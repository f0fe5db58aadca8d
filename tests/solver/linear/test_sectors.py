"""A sector given by its matrices against the same disk given otherwise."""

import math
import re
from typing import Any

import numpy as np
import pytest
from each import each
from scipy.linalg import eigh, eigvalsh
from sector_cases import ROWS, as_matrices

import solver
from solver import Scene, SceneError, SettingError, load_scene
from solver.linear.assembly import linear_model, structure_derivative
from solver.matrices.sectors.elimination import elimination, rotation
from solver.scene.cyclic.annulus import annulus

LUMPED = load_scene("bladed-disk")


def solved(scene: Scene, hz: float, harmonics: int = 7) -> Any:
    found = solver.solve(scene, frequency_hz=hz, harmonics=harmonics)
    assert found.converged
    return found


@pytest.mark.parametrize("order", [0, 1, 3, 4, 6])
def test_the_lumped_disk_as_matrices_gives_the_lumped_answer(order: int) -> None:
    raw = LUMPED.to_dict()
    raw["excitation"] = {**raw["excitation"], "engine_order": order}
    lumped, given = Scene.from_dict(raw), Scene.from_dict(as_matrices(Scene.from_dict(raw)))
    for values, hz in (({}, 690.0), ({"shroud.N0": 1e6, "root.N0": 1e6}, 700.0), ({"root.N0": 40.0}, 710.0)):
        one, other = (solved(scene.with_values(values), hz) for scene in (lumped, given))
        assert other.max_abs == pytest.approx(one.max_abs, rel=1e-9)
        np.testing.assert_allclose(other.observed, one.observed, atol=1e-9 * np.abs(one.observed).max())
        assert other.contacts[0].state is one.contacts[0].state


def test_every_sector_of_it_is_the_annulus_of_the_lumped_one() -> None:
    given = Scene.from_dict(as_matrices(LUMPED))
    one, other = (linear_model(annulus(scene)) for scene in (LUMPED, given))
    np.testing.assert_allclose(other.K0, one.K0, atol=1e-9 * one.K0.max())
    np.testing.assert_allclose(other.M, one.M, atol=1e-12)
    np.testing.assert_allclose(other.C0, one.C0, atol=1e-9 * one.C0.max())
    assert other.dofs == one.dofs
    found = [solver.solve(scene, frequency_hz=690.0, harmonics=5, effects=solver.Effects(every_sector=True))
             for scene in (LUMPED, given)]  # fmt: skip
    assert found[1].max_abs == pytest.approx(found[0].max_abs, rel=1e-9)
    assert found[1].max_abs == pytest.approx(solved(given, 690.0, 5).max_abs, rel=1e-8)


FACTORS = [1.02, 0.97, 1.0, 1.01, 0.99, 1.03, 0.98, 1.005]


def blade_spring(name: str) -> np.ndarray:
    """Stiffness of a spring of the blade over the rows of the sector."""
    (spring,) = (one for one in LUMPED.structure.springs if one.name == name)
    i, j = (ROWS[str(end.dof)] for end in spring.ends)
    part = np.zeros((5, 5))
    part[[i, j], [i, j]], part[[i, j], [j, i]] = spring.k, -spring.k
    return part


@pytest.mark.few(2)
@pytest.mark.parametrize("name", ["tip_middle", "root_disk"])
def test_a_mistuned_part_of_the_matrices_is_the_mistuned_spring(name: str) -> None:
    mistuning = {"of": [name], "values": FACTORS}
    raw = LUMPED.to_dict()
    raw["structure"] = {**raw["structure"], "mistuning": mistuning}
    table = as_matrices(LUMPED, parts={name: blade_spring(name).tolist()}, mistuning=mistuning)
    given = Scene.from_dict(table)
    assert Scene.from_dict(given.to_dict()) == given
    for hz in (690.0, 705.0):
        one, other = (solved(scene, hz, 5) for scene in (Scene.from_dict(raw), given))
        np.testing.assert_allclose(
            solver.blade_amplitudes(other).max_abs, solver.blade_amplitudes(one).max_abs, rtol=1e-9
        )
    tuned = Scene.from_dict(as_matrices(LUMPED, parts={name: blade_spring(name).tolist()}))
    others = [
        solver.mistuning_study(scene, of=name, spread=0.03, samples=2, seed=4, harmonics=1)
        for scene in (LUMPED, tuned)
    ]
    assert others[1].reached
    np.testing.assert_allclose(others[1].magnifications, others[0].magnifications, rtol=1e-7)


@pytest.mark.parametrize(
    ("of", "values", "wanted"),
    [
        (["blade"], FACTORS, "there is no part of the matrices 'blade'; known: K, M, tip_middle"),
        (["tip_middle"], FACTORS[:3], "one factor for each of the 8 sectors, got 3"),
        (["K", "K"], FACTORS, "'K' twice"),
    ],
)
def test_mistuning_that_does_not_fit_is_told(of: list[str], values: list[float], wanted: str) -> None:
    parts = {"tip_middle": blade_spring("tip_middle").tolist()}
    with pytest.raises(SceneError, match=re.escape(wanted)):
        Scene.from_dict(as_matrices(LUMPED, parts=parts, mistuning={"of": of, "values": values}))


@pytest.mark.parametrize(
    ("parts", "wanted"),
    [
        ({"K": np.eye(5).tolist()}, "stands for that of the whole sector"),
        ({"a b": np.eye(5).tolist()}, "only letters, digits"),
        ({"blade": np.eye(4).tolist()}, "must have 5 rows like M, got 4"),
        ({"blade": np.triu(np.ones((5, 5))).tolist()}, "must be symmetric"),
        ({"blade": "blade.mtx"}, "must be given inline"),
        ({}, "must be a table of names and matrices"),
    ],
)
def test_parts_that_are_none_are_told(parts: dict[str, Any], wanted: str) -> None:
    with pytest.raises(SceneError, match=re.escape(wanted)):
        Scene.from_dict(as_matrices(LUMPED, parts=parts))


def test_a_standing_wave_and_the_march_write_it_out() -> None:
    raw = as_matrices(LUMPED)
    raw["excitation"] |= {"pattern": "standing"}
    standing = LUMPED.to_dict()
    standing["excitation"] |= {"pattern": "standing"}
    one, other = (solved(Scene.from_dict(each), 690.0, 3) for each in (standing, raw))
    assert other.max_abs == pytest.approx(one.max_abs, rel=1e-9)
    short = Scene.from_dict(as_matrices(LUMPED, sectors=3)).with_values({"shroud.N0": 20.0})
    marched = solver.march(short, frequency_hz=690.0, steps_per_period=400)
    assert marched.half_peak_to_peak == pytest.approx(solved(short, 690.0, 31).half_peak_to_peak, rel=1e-4)


def hermitian(M: np.ndarray, K: np.ndarray, n: int, sectors: int) -> tuple[np.ndarray, np.ndarray]:
    """Elimination of the last row, by hand."""
    P = np.vstack([np.eye(4), np.exp(2j * math.pi * n / sectors) * np.eye(4)[3]])
    return P.conj().T @ M @ P, P.conj().T @ K @ P


def test_reduced_matrices_of_each_nodal_diameter() -> None:
    """Given at every nodal diameter they are the same disk; at some, only what those carry is solved."""
    shroud = {**LUMPED.to_dict(), "contacts": LUMPED.to_dict()["contacts"][:1]}
    raw = as_matrices(Scene.from_dict(shroud))
    M, K = (np.array(raw["structure"].pop(key)) for key in "MK")
    reduced: dict[str, Any] = {"diameters": [], "M": [], "K": []}
    rng = np.random.default_rng(3)
    for n in range(5):
        # The disk follows the DOFs and moves in a mode of its own at each nodal diameter.
        T = np.eye(4, dtype=complex)
        T[3] = rng.normal(size=4) + (0.0 if n in (0, 4) else 1j) * rng.normal(size=4)
        reduced["diameters"].append(n)
        for key, matrix in zip("MK", hermitian(M, K, n, 8), strict=True):
            matrix = T.conj().T @ matrix @ T
            reduced[key].append({"real": matrix.real.tolist(), "imag": matrix.imag.tolist()})
    raw["structure"] |= {"diameters": reduced, "cyclic": {}, "dofs": {"tip": 0, "middle": 1, "root": 2}}
    given = Scene.from_dict(raw)
    assert Scene.from_dict(given.to_dict()) == given
    for order in (1, 2, 7):
        raw["excitation"]["engine_order"] = order
        lumped = {**shroud, "excitation": {**shroud["excitation"], "engine_order": order}}
        one, other = (solved(Scene.from_dict(each), 690.0, 5) for each in (lumped, raw))
        assert other.max_abs == pytest.approx(one.max_abs, rel=1e-9)
    every = solver.Effects(every_sector=True)
    whole = solver.solve(given, frequency_hz=690.0, harmonics=5, effects=every)
    assert whole.max_abs == pytest.approx(solved(given, 690.0, 5).max_abs, rel=1e-8)

    some = {key: [value[i] for i in (0, 4)] for key, value in reduced.items()}
    raw["structure"]["diameters"] = some
    raw["excitation"]["engine_order"] = 4
    assert solved(Scene.from_dict(raw), 690.0, 5).converged
    raw["excitation"]["engine_order"] = 3
    few = Scene.from_dict(raw)
    with pytest.raises(SettingError, match=r"reduced for \(0, 4\).*it; reduce again"):
        solved(few, 690.0, 2)
    with pytest.raises(SettingError, match="nodal diameter"):
        annulus(few)


def turned_frame(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """M, K of a sector of three nodes in space, and of the ring of `n` of them about a slanted axis."""
    rng = np.random.default_rng(7)
    A = rng.normal(size=(9, 9))
    K, M = A @ A.T + 3.0 * np.eye(9), np.diag(rng.uniform(1.0, 2.0, 9))
    R = np.kron(np.eye(1), rotation((1.0, 2.0, 2.0), 2.0 * math.pi / n))
    size = 6 * n
    whole = [np.zeros((size, size)), np.zeros((size, size))]
    for j in range(n):
        # Each sector in its own axes: low and inner node are its own, the high node is the next low one.
        P = np.zeros((9, size))
        P[:6, 6 * j : 6 * j + 6] = np.eye(6)
        ahead = 6 * ((j + 1) % n)
        P[6:, ahead : ahead + 3] = R
        for total, own in zip(whole, (M, K), strict=True):
            total += P.T @ own @ P
    return M, K, whole[0], whole[1]


@pytest.mark.parametrize("n", [1, 2, 5, 6])
def test_frequencies_of_every_nodal_diameter_are_those_of_the_annulus(n: int) -> None:
    M, K, whole_M, whole_K = turned_frame(n)
    gone = elimination(9, [(0, 1, 2)], [(6, 7, 8)], (1.0, 2.0, 2.0), n)
    parts = gone.of(M), gone.of(K)
    found = [eigvalsh(parts[1].at(d, n), parts[0].at(d, n)) for d in range(n)]
    np.testing.assert_allclose(np.sort(np.concatenate(found)), eigh(whole_K, whole_M)[0], rtol=1e-10)
    assert all(np.isrealobj(parts[1].at(d, n)) for d in range(n) if 2 * d % n == 0)


def test_derivatives_by_the_proportional_damping() -> None:
    scene = Scene.from_dict(as_matrices(LUMPED, mass_proportional_damping=0.5))
    diameters = np.array([0, 1, 4, 6])
    moving = np.ones(4, np.bool_)
    for name in ("stiffness_proportional_damping", "mass_proportional_damping"):
        value, step = scene.value(f"structure.{name}"), 1e-3 * scene.value(f"structure.{name}")
        up, down = (linear_model(scene.with_values({f"structure.{name}": value + s})) for s in (step, -step))
        dC = structure_derivative(scene, f"structure.{name}").at(diameters, moving)[1]
        expected = (up.at(diameters, moving)[1] - down.at(diameters, moving)[1]) / (2.0 * step)
        np.testing.assert_allclose(dC, expected, atol=1e-6 * np.abs(expected).max())


def test_a_damping_ratio_is_that_of_every_mode() -> None:
    scene = Scene.from_dict(as_matrices(LUMPED, stiffness_proportional_damping=0.0, damping_ratio=0.01))
    K, C, M = (each[0] for each in linear_model(scene).at(np.array([3]), np.ones(1, np.bool_)))
    values, modes = eigh(K, M)
    np.testing.assert_allclose(
        modes.conj().T @ C @ modes, np.diag(0.02 * np.sqrt(values)), atol=1e-9 * np.sqrt(values[-1])
    )


@each(
    ("change", "words"),
    [
        ({"sectors": None}, "`sectors` is missing"),
        ({"cyclic": None}, "needs the boundaries"),
        ({"cyclic": {"low_rows": [3], "high_rows": [3]}}, "name row 3 twice"),
        ({"cyclic": {"low_rows": [3], "high_rows": [9]}}, "rows from 0 to 4, got 9"),
        ({"cyclic": {"low_rows": [3, 2], "high_rows": [4]}}, "pairs, at least one, got 2 and 1"),
        ({"cyclic": {"low_rows": [[1, 2, 3]], "high_rows": [[4, -1, -1]]}}, "`axis` is missing"),
        ({"cyclic": {"low_rows": [0], "high_rows": [3]}}, "'disk' is row 3, on the high boundary"),
        ({"cyclic": {"low_row": [3]}}, "known keys: axis, low_rows, high_rows"),
    ],
)
def test_what_is_wrong_is_said(change: dict[str, Any], words: str) -> None:
    raw = as_matrices(LUMPED)
    raw["structure"] = {k: v for k, v in (raw["structure"] | change).items() if v is not None}
    with pytest.raises(SceneError, match=words):
        Scene.from_dict(raw)
