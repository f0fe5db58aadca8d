"""Sectors of finite-element programs: decks, boundaries, reduction, the command; CalculiX beside them."""

import json
import math
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import eigsh

import solver
from service.cli import main
from solver import Scene
from solver.linear.assembly import linear_model
from solver.matrices import craig_bampton
from solver.matrices.load_set import MatrixSet, read_set
from solver.matrices.readers.numbers_in_text import FormatError, Label
from solver.matrices.sectors.elimination import elimination, rotation
from solver.matrices.sectors.loading import Deck, boundaries, groups, paired, read_deck
from solver.matrices.sectors.sector_reduction import diameters_met, reduce_sector
from stickslip.lab.worst_mistuning.linear_disk import Contacts, linear_disk, with_factors

ROOT = Path(__file__).resolve().parents[3]
SECTORS = 6
AXIS = (0.0, 0.0, 1.0)


def a_sector() -> tuple[Deck, MatrixSet, list[int], list[int]]:
    """A sixth of a ring of bricks (skfem): two along the radius, two around, one high, held inside."""
    skfem = pytest.importorskip("skfem")
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    pitch = 2.0 * math.pi / SECTORS
    grid = skfem.MeshHex.init_tensor(
        np.linspace(0.1, 0.2, 3), np.linspace(0.0, pitch, 3), np.array([0.0, 0.02])
    )
    r, angle, z = grid.p
    mesh = skfem.MeshHex(np.array([r * np.cos(angle), r * np.sin(angle), z]), grid.t)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=3)
    K = csr_array(linear_elasticity(*lame_parameters(2.1e11, 0.3)).assemble(basis))
    mass = skfem.BilinearForm(lambda u, v, _: 7850.0 * skfem.helpers.dot(u, v))
    M = csr_array(mass.assemble(basis))
    free = np.flatnonzero(np.repeat(r > 0.1001, 3))
    order = basis.nodal_dofs.T.reshape(-1)[free]
    labels = tuple(Label(i // 3 + 1, ("UX", "UY", "UZ")[i % 3]) for i in free.tolist())
    deck = Deck({i + 1: tuple(place) for i, place in enumerate(mesh.p.T.tolist())}, {})
    low = [i + 1 for i in np.flatnonzero((angle < 1e-9) & (r > 0.1001)).tolist()]
    high = [i + 1 for i in np.flatnonzero((angle > pitch - 1e-9) & (r > 0.1001)).tolist()]
    found = MatrixSet(
        matrices={"M": M[order][:, order].tocoo(), "K": K[order][:, order].tocoo()}, labels=labels
    )
    return deck, found, low, high


def joined() -> tuple[MatrixSet, Any]:
    deck, found, low, high = a_sector()
    pairs = paired(deck, low, high[::-1], AXIS, SECTORS)
    ours, theirs = groups(pairs, found)
    return found, elimination(found.matrices["M"].shape[0], ours, theirs, AXIS, SECTORS)


def ring(matrix: Any, deck: Deck, found: MatrixSet) -> np.ndarray:
    """The annulus assembled from turned sectors, node by node at its place, in fixed axes."""
    places: dict[tuple[float, ...], int] = {}
    total = np.zeros((0, 0))
    parts = []
    for j in range(SECTORS):
        R = rotation(AXIS, 2.0 * math.pi * j / SECTORS)
        rows, turned = [], np.zeros((matrix.shape[0],) * 2)
        for i, label in enumerate(found.labels or ()):
            place = tuple((np.round(R @ np.array(deck.nodes[label.node]), 7) + 0.0).tolist())
            rows.append(3 * places.setdefault(place, len(places)) + i % 3)
        for i in range(0, matrix.shape[0], 3):
            turned[i : i + 3, i : i + 3] = R
        parts.append((rows, turned @ matrix.toarray() @ turned.T))
    total = np.zeros((3 * len(places),) * 2)
    for rows, part in parts:
        total[np.ix_(rows, rows)] += part
    return total


def test_frequencies_of_every_nodal_diameter_are_those_of_the_annulus_of_turned_sectors() -> None:
    deck, found, _, _ = a_sector()
    _, gone = joined()
    M, K = (gone.of(csr_array(found.matrices[key])) for key in "MK")
    ours = [
        eigh(K.at(n, SECTORS).toarray(), M.at(n, SECTORS).toarray(), eigvals_only=True)
        for n in range(SECTORS)
    ]
    whole = [ring(csr_array(found.matrices[key]), deck, found) for key in "KM"]
    np.testing.assert_allclose(np.sort(np.concatenate(ours)), eigh(*whole, eigvals_only=True), rtol=2e-8)


def scene_of(structure: dict[str, Any], order: int) -> Scene:
    """The ring with a corner of each sector that rubs on the next one, where no element joins them."""
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    return Scene.from_dict(
        {
            "name": "ring",
            "structure": {"kind": "matrices", "sectors": SECTORS, "damping_ratio": 0.01, **structure},
            "nodes": [
                {"name": "p", "at": [0.15, 0.0, 0.02], "dofs": {"x": "px", "y": "py", "z": "pz"}},
                {"name": "q", "at": [0.2 * c, 0.2 * s, 0.02], "dofs": {"x": "qx", "y": "qy", "z": "qz"}},
            ],
            "contacts": [
                {
                    "name": "rub", "law": "coulomb-2d", "between": ["q", "p@next"], "at": [0.1, 0.15, 0.02],
                    "normal": [-0.5, 0.7, 0.5], "kt": 2e8, "mu": 0.3, "N0": 60.0,
                },
                {
                    "name": "press", "law": "elastic-normal", "between": ["q", "p@next"],
                    "at": [0.1, 0.15, 0.0],
                    "normal": [-0.5, 0.7, -0.5], "kt": 1e8, "kn": 1e8, "mu": 0.3, "N0": 30.0,
                },
            ],
            "excitation": {"dof": "qz", "amplitude": 100.0, "engine_order": order},
            "observe": {"dof": "qz", "band": [500.0, 5000.0]},
        }
    )  # fmt: skip


def rows_in_use(found: MatrixSet, deck: Deck) -> dict[str, int]:
    """The low boundary at half the radius above, and the middle outside above."""
    table = {}
    for name, at in (("p", (0.15, 0.0)), ("q", (0.2, math.pi / 6))):
        place = np.array([at[0] * math.cos(at[1]), at[0] * math.sin(at[1]), 0.02])
        node = min(deck.nodes, key=lambda one: float(np.linalg.norm(np.array(deck.nodes[one]) - place)))
        for c in "xyz":
            row = found.row(Label(node, f"U{c.upper()}"))
            assert row is not None
            table[f"{name}{c}"] = row
    return table


def test_a_response_with_friction_is_that_of_the_annulus_and_of_the_reduced_sector() -> None:
    deck, found, low, high = a_sector()
    pairs = paired(deck, low, high, AXIS, SECTORS)
    ours, theirs = groups(pairs, found)
    rows = rows_in_use(found, deck)
    full = {key: matrix.toarray().tolist() for key, matrix in found.matrices.items()}
    boundary = {
        "low_rows": list(map(list, ours)),
        "high_rows": list(map(list, theirs)),
        "axis": [0.0, 0.0, 1.0],
    }
    _, gone = joined()
    matrices = {key: csr_array(matrix) for key, matrix in found.matrices.items()}
    kept = reduce_sector(matrices, gone, rows, 12, diameters_met([2, 1], SECTORS), SECTORS)
    small = {"diameters": kept.matrices, "dofs": kept.rows, "cyclic": {"axis": [0.0, 0.0, 1.0]}}
    for order in (1, 2):
        scene = scene_of(full | {"dofs": rows, "cyclic": boundary}, order)
        one = solver.solve(scene, frequency_hz=3200.0, harmonics=3)
        assert one.converged
        assert {contact.state.value for contact in one.contacts} != {"stuck"}
        whole = solver.solve(
            scene, frequency_hz=3200.0, harmonics=3, effects=solver.Effects(every_sector=True)
        )
        assert whole.max_abs == pytest.approx(one.max_abs, rel=1e-8)
        reduced = solver.solve(scene_of(small, order), frequency_hz=3200.0, harmonics=3)
        assert reduced.max_abs == pytest.approx(one.max_abs, rel=1e-3)


def check_linear_limit(scene: Scene, mistuning: dict[str, Any]) -> None:
    """The disk of the worst mistuning, its contacts open, is that of the solver without contacts."""
    free = scene.model_copy(update={"contacts": ()})
    wanted = solver.blade_amplitudes(solver.solve(free, frequency_hz=3200.0, harmonics=1))
    disk = linear_disk(free, mistuning["of"], Contacts.OPEN, (3000.0, 3400.0), wanted.dof)
    delta, omega = np.array(mistuning["values"]) - 1.0, 2.0 * math.pi * 3200.0
    own = with_factors(disk, free, mistuning["of"], Contacts.OPEN, delta)
    exact = np.abs(own.amplitudes(np.zeros(SECTORS), omega))
    np.testing.assert_allclose(exact, wanted.max_abs, rtol=1e-7)
    # A damping ratio is one of the modes, so that C is not quite linear in the factors.
    np.testing.assert_allclose(np.abs(disk.amplitudes(delta, omega)), exact, rtol=0.02)


def test_a_mistuned_reduced_disk_is_the_annulus_of_full_sectors() -> None:
    """With all modes kept exactly; with some to the error of the reduction; by the file too."""
    deck, found, low, high = a_sector()
    ours, theirs = groups(paired(deck, low, high, AXIS, SECTORS), found)
    rows = rows_in_use(found, deck)
    matrices = {key: csr_array(matrix) for key, matrix in found.matrices.items()}
    outside = np.zeros(matrices["K"].shape[0])
    outside[
        [i for i, one in enumerate(found.labels or ()) if math.hypot(*deck.nodes[one.node][:2]) > 0.16]
    ] = 1.0
    blade = csr_array(outside[:, None] * matrices["K"].toarray() * outside[None, :])
    values = [1.06, 0.95, 1.0, 1.03, 0.98, 1.02]
    mistuning = {"of": ["blade", "M"], "values": values}
    boundary = {"low_rows": list(map(list, ours)), "high_rows": list(map(list, theirs)), "axis": list(AXIS)}
    whole = {key: matrix.toarray().tolist() for key, matrix in matrices.items()}
    whole |= {"parts": {"blade": blade.toarray().tolist()}, "mistuning": mistuning}
    whole |= {"cyclic": boundary, "dofs": rows}
    scene = scene_of(whole, 2)
    one = solver.solve(scene, frequency_hz=3200.0, harmonics=2)
    assert one.converged
    assert {contact.state.value for contact in one.contacts} != {"stuck"}
    alone = solver.solve(scene_of({**whole, "mistuning": None}, 2), frequency_hz=3200.0, harmonics=2)
    blades = solver.blade_amplitudes(one).max_abs
    assert np.ptp(blades) > 0.05 * alone.max_abs  # the factors matter

    _, gone = joined()
    free = gone.kept.size - len(rows)
    parts = {"blade": blade, "M": matrices["M"]}
    for modes, tolerance in ((free, 1e-8), (16, 3e-3)):
        kept = reduce_sector(matrices, gone, rows, modes, range(SECTORS // 2 + 1), SECTORS, parts)
        small = {"diameters": kept.matrices, "dofs": kept.rows, "cyclic": {"axis": [0.0, 0.0, 1.0]}}
        given = scene_of(small | {"mistuning": mistuning}, 2)
        other = solver.solve(given, frequency_hz=3200.0, harmonics=2)
        np.testing.assert_allclose(solver.blade_amplitudes(other).max_abs, blades, rtol=tolerance)
        check_linear_limit(given, mistuning)
    check_linear_limit(scene, mistuning)
    assert Scene.from_dict(given.to_dict()) == given
    with pytest.raises(solver.SceneError, match="there is no part of the matrices 'K'; known: blade, M"):
        scene_of(small | {"mistuning": {**mistuning, "of": ["K"]}}, 2)


def test_the_reduction_reports_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where ARPACK takes the place of what serves small models."""
    deck, found, _, _ = a_sector()
    _, gone = joined()
    matrices = {key: csr_array(matrix) for key, matrix in found.matrices.items()}
    every = tuple(range(SECTORS // 2 + 1))
    plain = reduce_sector(matrices, gone, rows_in_use(found, deck), 8, every, SECTORS)
    monkeypatch.setattr(craig_bampton, "DENSE", 10)
    large = reduce_sector(matrices, gone, rows_in_use(found, deck), 8, every, SECTORS)
    np.testing.assert_allclose(large.quality[1].held_hz, plain.quality[1].held_hz, rtol=1e-10)
    for n, quality in zip(every, plain.quality, strict=True):
        M, K = (gone.of(matrices[key]).at(n, SECTORS).toarray() for key in "MK")
        true = np.sqrt(eigh(K, M, eigvals_only=True)) / (2.0 * math.pi)
        off = quality.system_hz / true[: quality.system_hz.size] - 1.0
        assert np.all(off > -1e-9)
        assert np.all(off[quality.system_hz <= quality.good_to_hz] <= 1e-3)
        np.testing.assert_array_less(off[:4], 1.1 * quality.system_error[:4] + 1e-9)


DECKS = {
    "a.inp": "*NODE, NSET=ALL\n1, 0.0, 1., 2e-1\n2, 1.0\n** a remark\n*NSET, NSET=low, GENERATE\n1, 2, 1\n"
    "*NSET, NSET=BOTH\nLOW, 2,\n",
    "b.cdb": "NBLOCK,6,SOLID\n(3i9,6e21.13e3)\n        1        0        0 0.0000000000000E+000"
    " 1.0000000000000E+000 2.0000000000000E-001\n        2        0        0 1.0000000000000E+000\n"
    "N,R5.3,LOC,       -1,\n"
    "CMBLOCK,LOW,NODE,       2  ! users node component definition\n(8i10)\n         1        -2\n",
    "c.bdf": "GRID           1              0.      1.    2.-1\nGRID,2,,1.0\n",
}  # fmt: skip


@pytest.mark.parametrize("name", DECKS)
def test_decks_of_three_programs(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text(DECKS[name])
    deck = read_deck(path)
    assert deck.nodes == {1: (0.0, 1.0, 0.2), 2: (1.0, 0.0, 0.0)}
    if name != "c.bdf":
        assert deck.sets["LOW"] == [1, 2]
    path.write_text("no nodes here\n")
    with pytest.raises(FormatError, match="has no nodes"):
        read_deck(path)


def test_boundaries_that_do_not_fit_are_told() -> None:
    deck, found, low, high = a_sector()
    assert sorted(paired(deck, low, high, AXIS, SECTORS)) == sorted(zip(low, high, strict=True))
    # By position the held nodes match too: they have no rows.
    by_position = paired(deck, None, None, AXIS, SECTORS)
    assert groups([pair for pair in by_position if pair[0] in low], found) == groups(
        sorted(paired(deck, low, high, AXIS, SECTORS)), found
    )
    assert len(groups(by_position, found)[0]) == len(low)
    with pytest.raises(ValueError, match="are exchanged"):
        paired(deck, high, low, AXIS, SECTORS)
    with pytest.raises(ValueError, match=rf"without a partner.*1 of `low`: {low[0]}"):
        paired(deck, low, high[1:], AXIS, SECTORS)
    with pytest.raises(ValueError, match="no node lies where another one comes by a turn of 1/7"):
        paired(deck, None, None, AXIS, 7)
    with pytest.raises(ValueError, match="needs as many nodes"):
        paired(None, low, high[1:], AXIS, SECTORS, pair_by="order")


def test_nodal_diameters_that_harmonics_meet() -> None:
    assert diameters_met([3], 24) == (0, 3, 6, 9, 12)
    assert diameters_met([23], 24) == tuple(range(13))
    assert diameters_met([0], 24) == (0,)
    assert diameters_met([8, 12], 24) == (0, 8, 12)


@pytest.fixture
def beside_docs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("ccx") is None:
        pytest.skip("CalculiX is not installed (apt-get install calculix-ccx)")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    subprocess.run([sys.executable, "docs/fe/disk.py"], check=True, capture_output=True)
    subprocess.run(["ccx", "matrices"], check=True, capture_output=True)


def cyclic_frequencies() -> dict[int, list[float]]:
    """The lowest two pairs of every nodal diameter of CalculiX's own analysis."""
    found: dict[int, list[float]] = {}
    number = r"\s+-?(\d\.\d+E[+-]\d+)"
    for match in re.finditer(
        rf"^\s+(\d+)\s+(\d+){number * 4}\s*$", Path("cyclic.dat").read_text(), re.MULTILINE
    ):
        found.setdefault(int(match[1]), []).append(float(match[5]))
    return {n: values[::2] for n, values in found.items()}


@pytest.mark.usefixtures("beside_docs")
def test_a_sector_of_calculix_has_the_frequencies_of_its_own_cyclic_symmetry() -> None:
    deck = Path("cyclic.inp")
    deck.write_text(deck.read_text().replace("NMAX=12", "NMAX=4"))
    subprocess.run(["ccx", "cyclic"], check=True, capture_output=True)
    given = read_set({"M": Path("matrices.mas"), "K": Path("matrices.sti")})
    table = {"low": "LOW", "high": "HIGH", "nodes": "sector.inp"}
    gone = boundaries(table, given, 24, Path()).elimination(given.matrices["M"].shape[0], 24)
    M, K = (gone.of(csr_array(given.matrices[key])) for key in "MK")
    theirs = cyclic_frequencies()
    assert sorted(theirs) == list(range(5))
    for n in theirs:
        ours = eigsh(
            csc_array(K.at(n, 24)), k=4, M=csc_array(M.at(n, 24)), sigma=0.0, return_eigenvectors=False
        )
        np.testing.assert_allclose(np.sqrt(np.sort(ours)) / (2.0 * math.pi), theirs[n], rtol=1e-5)


@pytest.mark.usefixtures("beside_docs")
def test_the_command_makes_the_scene_of_a_disk(capsys: pytest.CaptureFixture[str]) -> None:
    files = [
        "import",
        "matrices.sti",
        "matrices.mas",
        "--sectors",
        "24",
        "--dof",
        "tip=383.UY",
        "--nodes",
        "sector.inp",
    ]
    ends = ["--low", "LOW", "--high", "HIGH", "--engine-order", "8"]
    assert main([*files, *ends, "--out", "small.toml", "--reduce", "--modes", "6", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["reduction"]
    assert [each["diameter"] for each in said["diameters"]] == [0, 8]
    assert main([*files, *ends, "--out", "found.toml", "--keep-modes", "6"]) == 0
    scenes = [solver.load_scene(f"{name}.toml") for name in ("small", "found")]
    assert [scene.structure.n_coordinates for scene in scenes] == [7, 7]
    found = [solver.solve(s, frequency_hz=150.0, harmonics=1).max_abs for s in scenes]
    np.testing.assert_allclose(found, found[0], rtol=1e-9)
    assert main([*files, "--out", "joined.toml", "--reduce", "--modes", "6"]) == 0
    assert "faces that only touch the next sector" in " ".join(capsys.readouterr().out.split())
    assert main([*files, "--low", "LOW", "--high", "SIDE", "--out", "none.toml"]) != 0
    assert (
        "there is no set 'SIDE' of nodes in the deck; known: ALL, FOOT, HIGH, LOW" in capsys.readouterr().err
    )
    assert not Path("none.toml").exists()


@pytest.mark.usefixtures("beside_docs")
def test_the_command_keeps_what_is_to_be_mistuned(capsys: pytest.CaptureFixture[str]) -> None:
    files = ["import", "matrices.sti", "matrices.mas", "--sectors", "24", "--dof", "tip=383.UY"]
    files += ["--nodes", "sector.inp", "--low", "LOW", "--high", "HIGH", "--engine-order", "8"]
    reduced = [*files, "--reduce", "--modes", "4"]
    assert main([*reduced, "--out", "disk.toml", "--mistune", "K"]) == 0
    scene = solver.load_scene("disk.toml")
    assert scene.structure.diameters.diameters == tuple(range(13))
    # With one factor on all of them the disk is tuned, and its stiffness that many times as large.
    tuned = solver.mistuned(scene, of="K", values=[1.21] * 24)
    frequencies = [
        np.sqrt(eigh(model.K0, model.M, eigvals_only=True)[:6])
        for model in map(linear_model, (tuned, solver.annulus(scene)))
    ]
    np.testing.assert_allclose(frequencies[0], 1.1 * frequencies[1], rtol=1e-9)
    capsys.readouterr()
    for wrong, wanted in (
        (["--mistune", "blade"], "`--mistune` must be K, M, or the name of a part and its file"),
        (["--mistune", "blade=none.mtx"], "there is no file 'none.mtx'"),
        (["--mistune", "K", "--mistune", "K"], "twice"),
    ):
        assert main([*reduced, "--out", "none.toml", "--reduced", "none.npz", *wrong]) != 0
        assert wanted in capsys.readouterr().err
    assert main([*files, "--out", "none.toml", "--mistune", "K"]) != 0
    assert "goes with --sectors and --reduce" in capsys.readouterr().err
    assert not Path("none.toml").exists()
    assert not Path("none.npz").exists()


def test_the_shipped_disk() -> None:
    """One sector, all of them, and a wave that runs backward."""
    scene = solver.load_scene("fe-disk")
    found = solver.solve(scene, frequency_hz=255.0, harmonics=1)
    assert found.converged
    assert found.max_abs == pytest.approx(0.22e-3, rel=0.05)
    backward = scene.to_dict()
    backward["excitation"]["engine_order"] = 20
    free = {"shroud.N0": 0.0}
    one = solver.solve(scene.with_values(free), frequency_hz=172.0, harmonics=1)
    other = solver.solve(Scene.from_dict(backward).with_values(free), frequency_hz=172.0, harmonics=1)
    assert other.max_abs == pytest.approx(one.max_abs, rel=1e-9)
    effects = {effect.name: effect.reason for effect in solver.plan(scene, harmonics=5).effects}
    assert "engine order 4 meet 4, 12 of 0 to 12" in effects["nodal diameters"]
    assert "1080 DOFs were reduced to the 13 in use and 16 modes" in effects["reduction of the model"]
