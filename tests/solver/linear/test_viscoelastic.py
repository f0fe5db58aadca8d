"""Parts whose stiffness matrix relaxes: the complex matrix of NumPy, scenes of single branches, the march."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each import each
from lumped_structure import lumped

import solver
from solver.linear.assembly import linear_model, structure_derivative

HZ = 0.17
OMEGA = 2.0 * math.pi * HZ
CONTACT = {"name": "d", "between": ["b", "ground"], "kt": 0.7, "mu": 0.5, "N0": 0.05}


def part(K: Any, point: str = "z", **more: Any) -> dict[str, Any]:
    return {"kind": "viscoelastic", "K": np.asarray(K).tolist(), "point": point, "tau": 0.7, **more}


def relaxing(k: float, tau: float, omega: float = OMEGA) -> complex:
    return k * 1j * omega * tau / (1.0 + 1j * omega * tau)


def random_model(rng: np.random.Generator, n: int) -> dict[str, np.ndarray]:
    """M, K, C and a part of random rank, their sizes some decades apart."""
    root, thin = rng.normal(size=(n, n)), rng.normal(size=(n, int(rng.integers(1, n + 1))))
    K = 10.0 ** rng.uniform(-2, 2) * (root @ root.T + np.eye(n))
    return {
        "M": np.diag(10.0 ** rng.uniform(-1, 1, n)), "K": K, "C": 0.01 * K,
        "part": 10.0 ** rng.uniform(-3, 2) * thin @ thin.T,
    }  # fmt: skip


def scene(given: dict[str, np.ndarray], couplings: list[dict[str, Any]], **more: Any) -> solver.Scene:
    matrices = {key: given[key].tolist() for key in ("M", "K", "C")}
    dofs = {"a": 0, "b": len(given["M"]) - 1}
    return solver.Scene.from_dict(
        {
            "name": "layered", "structure": {"kind": "matrices", **matrices, "dofs": dofs},
            "couplings": couplings, "contacts": [], "excitation": {"dof": "a", "amplitude": 0.5},
            "observe": {"dof": "b", "band": [0.05, 0.4]}, **more,
        }
    )  # fmt: skip


@each("seed", range(12))
def test_random_matrices_are_the_complex_matrix(seed: int) -> None:
    rng = np.random.default_rng(seed)
    given = random_model(rng, int(rng.integers(2, 8)))
    branches = [(10.0 ** rng.uniform(-3, 2), 10.0 ** rng.uniform(-4, 4)) for _ in range(1 + seed % 3)]
    rows = [part(given["part"], f"z{i}", k=k, tau=tau) for i, (k, tau) in enumerate(branches)]
    omega = 10.0 ** rng.uniform(-2, 1.5)
    Z = given["K"] + 1j * omega * given["C"] - omega**2 * given["M"]
    Z = Z + sum(relaxing(k, tau, omega) for k, tau in branches) * given["part"]
    truth = 0.5 * np.linalg.solve(Z, np.eye(len(Z))[0])[-1]
    found = solver.solve(scene(given, rows), frequency_hz=omega / (2.0 * math.pi), harmonics=1)
    assert found.max_abs == pytest.approx(abs(truth), rel=1e-8)


def test_a_layer_of_springs_is_a_branch_at_each_with_friction_in_time_too() -> None:
    """The same chain with points of their own between all masses, a larger ordinary scene."""
    chain = lumped(
        {"a": 1.0, "m": 0.4, "b": 0.7}, ("a", "ground", 1.0, 0.02), ("a", "m", 0.9), ("m", "b", 0.5)
    )
    pairs = [("a", "m", 0.8), ("m", "b", 0.3)]
    K = np.zeros((3, 3))
    for i, (*_, k) in enumerate(pairs):
        K[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    single = [
        {"kind": "maxwell", "on": on, "of": of, "point": f"y{on}", "k": 0.6 * k, "tau": 1.3}
        for on, of, k in pairs
    ]
    rest = {
        "name": "chain", "structure": chain, "contacts": [CONTACT],
        "excitation": {"dof": "a", "amplitude": 0.5}, "observe": {"dof": "b", "band": [0.05, 0.4]},
    }  # fmt: skip
    layer = part(K, k=0.6, tau=1.3, on=["a", "m", "b"])
    one, other = (solver.Scene.from_dict({**rest, "couplings": c}) for c in ([layer], single))
    found, wanted = (solver.solve(each, frequency_hz=HZ, harmonics=15) for each in (one, other))
    assert found.converged
    assert found.max_abs == pytest.approx(wanted.max_abs, rel=1e-10)
    marched, referee = (solver.march(each, frequency_hz=HZ) for each in (one, other))
    assert marched.max_abs == pytest.approx(referee.max_abs, rel=1e-7)
    fine = solver.solve(one, frequency_hz=HZ, harmonics=31)
    assert fine.max_abs == pytest.approx(marched.max_abs, rel=1e-6)
    assert solver.stability(fine).stable is True


@pytest.mark.parametrize("path", ["pad.k", "pad.tau"])
def test_derivatives_are_differences(path: str) -> None:
    given = random_model(np.random.default_rng(5), 5)
    rows = [part(given["part"], name="pad", k=0.4), part(given["part"], "y", k=0.2, tau=9.0)]
    start = scene(given, rows, contacts=[CONTACT])
    value, step = start.value(path), 1e-5
    above, below = (start.with_values({path: value + sign * step}) for sign in (1.0, -1.0))
    at = np.zeros(1, np.int64), np.ones(1, np.bool_)
    slope = structure_derivative(start, path).at(*at)
    for mine, high, low in zip(slope, linear_model(above).at(*at), linear_model(below).at(*at), strict=True):
        np.testing.assert_allclose(mine, (high - low) / (2.0 * step), atol=1e-8 * np.abs(given["part"]).max())
    found = solver.sweep(start, start=0.1, stop=0.12, harmonics=5)
    hz = float(found.values[1])
    gradient = solver.Sensitivities(found.balance, [path]).gradient(found.solutions[1][:-1], hz)
    high, low = (solver.solve(each, frequency_hz=hz, harmonics=5).max_abs for each in (above, below))
    assert gradient.by_parameters[0] == pytest.approx((high - low) / (2.0 * step), rel=1e-4)


def test_files_are_read_in_their_units_and_reduced_with_the_structure(tmp_path: Path) -> None:
    given = random_model(np.random.default_rng(2), 6)
    for key, array in given.items():
        np.save(tmp_path / f"{key}.npy", array / 1e3)  # N/mm are 1e3 N/m, t are 1e3 kg
    structure = {
        "kind": "matrices", "units": "mm", "M": "M.npy", "K": "K.npy", "C": "C.npy", "dofs": {"a": 0, "b": 5},
        "keep_modes": 4,
    }  # fmt: skip
    raw = {**scene(given, []).to_dict(), "structure": structure}
    raw["couplings"] = [{"kind": "viscoelastic", "K": "part.npy", "point": "z", "tau": 0.7, "k": 0.5}]
    (tmp_path / "scene.json").write_text(json.dumps(raw))
    found = solver.load_scene(tmp_path / "scene.json")
    whole = scene(given, [part(given["part"], k=0.5)])
    one, other = (solver.solve(each, frequency_hz=HZ, harmonics=1).max_abs for each in (found, whole))
    assert one == pytest.approx(other, rel=1e-7)  # all modes of the rest are kept: nothing is lost
    assert solver.Scene.from_dict(found.to_dict()) == found
    raw["couplings"][0]["K"] = "nowhere.npy"
    (tmp_path / "scene.json").write_text(json.dumps(raw))
    with pytest.raises(solver.SceneError, match=r"`K`: .*nowhere") as refused:
        solver.load_scene(tmp_path / "scene.json")
    assert refused.value.issues[0].pointer == "/couplings/0/K"


def test_each_sector_of_a_disk_has_its_own() -> None:
    """A travelling wave over one sector, and all sectors in time."""
    raw = {
        "name": "disk",
        "structure": {
            "kind": "cyclic", "sectors": 4, "masses": {"t": 1.0, "r": 2.0},
            "springs": [
                {"between": ["t", "r"], "k": 1.0, "c": 0.01}, {"between": ["r", "ground"], "k": 3.0},
                {"between": ["r", "r@next"], "k": 0.4},
            ],
        },
        "couplings": [part([[1.0, -1.0], [-1.0, 1.0]], on=["t", "r"], k=0.3)], "contacts": [],
        "excitation": {"dof": "t", "amplitude": 0.5, "engine_order": 1},
        "observe": {"dof": "t", "band": [0.05, 0.4]},
    }  # fmt: skip
    given = solver.Scene.from_dict(raw)
    k = 1.0 + 0.01j * OMEGA + relaxing(0.3, 0.7)
    turned = 3.0 + 0.8 * (1.0 - math.cos(math.pi / 2.0))
    Z = np.array([[k - OMEGA**2, -k], [-k, k + turned - 2.0 * OMEGA**2]])
    truth = abs(0.5 * np.linalg.solve(Z, [1.0, 0.0])[0])
    assert solver.solve(given, frequency_hz=HZ, harmonics=1).max_abs == pytest.approx(truth, rel=1e-10)
    assert solver.march(given, frequency_hz=HZ).max_abs == pytest.approx(truth, rel=1e-6)


EYE = [[1.0, 0.0], [0.0, 1.0]]


@each(
    ("row", "said"),
    [
        ({"K": [[1.0, 0.5], [0.0, 1.0]]}, r"`K` of a viscoelastic part must be symmetric"),
        ({"K": [[1.0, 0.0], [0.0, -1.0]]}, r"must be a stiffness: .*, got -1 to 1"),
        ({"K": [[0.0, 0.0], [0.0, 0.0]]}, r"must be a stiffness: .*, got 0 to 0"),
        ({"K": "part.mtx"}, r"files are read by load_scene only, got the path 'part.mtx'"),
        ({"K": np.eye(3).tolist()}, r"`K` must have 2 rows as M has, got 3"),
        ({"on": ["a"]}, r"`K` must have a row for each of the 1 DOFs, got 2"),
        ({"on": ["a", "a"]}, r"`on` must name different DOFs"),
        ({"on": ["a", "c"]}, r"`on`: there is no DOF 'c'"),
        ({"tau": 0.0}, r"`tau` must be"),
        ({"k": -1.0}, r"`k` must be"),
        ({"point": "a"}, r"is that of another DOF"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(row: dict[str, Any], said: str) -> None:
    given = {"M": np.eye(2), "K": np.eye(2), "C": np.zeros((2, 2))}
    with pytest.raises(solver.SceneError, match=said):
        scene(given, [{**part(EYE), **row}])


def test_rows_alone_are_those_of_a_whole_structure() -> None:
    lone = {
        "name": "one", "structure": lumped({"a": 1.0}, ("a", "ground", 1.0)), "couplings": [part([[1.0]])],
        "contacts": [], "excitation": {"dof": "a", "amplitude": 1.0},
        "observe": {"dof": "a", "band": [0.1, 0.2]},
    }  # fmt: skip
    with pytest.raises(solver.SceneError, match="`K` needs `on`, the DOFs of its rows"):
        solver.Scene.from_dict(lone)
