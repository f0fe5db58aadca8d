"""Uploaded matrices looked at: what was read, what is wrong beside its key, and the scene they begin."""

from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from fe_files import abaqus_input, ansys_mapping, coordinate, dmig, hbmat, op4_binary
from matrix_cases import beam
from service_helpers import is_problem
from upload_cases import npz, upload

import solver
from service.uploads import inspection

M, K = beam(8)
NODES = [(2 + row // 2, (2, 6)[row % 2]) for row in range(len(M))]
LABELS = [(node, {2: "UY", 6: "ROTZ"}[dof]) for node, dof in NODES]
CALCULIX_LABELS = "".join(f"{node}.{dof}\n" for node, dof in NODES)
SETS: dict[str, dict[str, str | bytes]] = {
    "Ansys": {
        "blade_K.matrix": hbmat(K), "blade_M.matrix": hbmat(M), "blade_K.mapping": ansys_mapping(LABELS),
    },
    "Nastran, text": {"job.pch": dmig("KAAX", K, NODES) + dmig("MAAX", M, NODES)},
    "Nastran, binary": {"job.op4": op4_binary({"KAA": K, "MAA": M})},
    "Abaqus": {"job_STIF2.mtx": abaqus_input(K, NODES), "job_MASS2.mtx": abaqus_input(M, NODES)},
    "CalculiX": {"job.sti": coordinate(K), "job.mas": coordinate(M), "job.dof": CALCULIX_LABELS},
    "NumPy": {"pair.npz": npz(M=M, K=K)},
}  # fmt: skip
LABELLED = ("Ansys", "Nastran, text", "Abaqus", "CalculiX")
ASKED: dict[str, Any] = {
    "name": "beam",
    "contacts": [{"name": "damper", "between": ["tip", "ground"]}],
    "excitation": {"dof": "mid"},
    "observe": {"dof": "mid"},
}


def sent(client: httpx.Client, files: dict[str, str | bytes]) -> list[str]:
    answers = [
        upload(client, name, data.encode() if isinstance(data, str) else data) for name, data in files.items()
    ]
    return [answer.json()["id"] for answer in answers]


def look(client: httpx.Client, **body: object) -> dict[str, Any]:
    answer = client.post("/v1/matrices", json=body)
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def looked_at(folder: Path, files: dict[str, str | bytes], **body: object) -> dict[str, Any]:
    """What the reader's process finds, without the process."""
    for name, data in files.items():
        (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
    asked = {"structure": None, "files": list(files), **body}
    return inspection._answer("look", asked)


@pytest.mark.parametrize("program", SETS)
def test_files_are_told_apart_and_begin_a_scene(
    program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = looked_at(tmp_path, SETS[program])["found"]
    assert {"M", "K"} <= set(found["structure"])
    assert [one["rows"] for one in found["matrices"]] == [16, 16]
    true = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real) / (2.0 * np.pi)
    assert found["frequencies_hz"][:3] == pytest.approx(np.sort(true)[:3], rel=1e-6)
    assert found["notes"] == []
    assert (found["labels"] is not None) == (program in LABELLED)
    dofs = {"tip": "9.UY", "mid": "5.UY"} if found["labels"] else {"tip": 14, "mid": 6}
    structure = {**found["structure"], "dofs": dofs, "keep_modes": 4, "damping_ratio": 1e-3}
    made = looked_at(tmp_path, SETS[program], structure=structure, **ASKED)["found"]
    assert made["scene"]["structure"] == {"kind": "matrices", **structure}
    assert made["reduction"]["modes"] == 4
    assert made["reduction"]["good_to_hz"] > made["frequencies_hz"][0]


def test_a_scene_of_uploads_is_computed(shipped: httpx.Client) -> None:
    found = look(shipped, uploads=sent(shipped, SETS["Ansys"]))
    structure = {**found["structure"], "dofs": {"tip": "9.UY", "mid": "5.UY"}, "keep_modes": 4}
    made = look(shipped, structure=structure, **ASKED)
    assert made["scene"]["structure"] == {"kind": "matrices", **structure}
    assert all(item.startswith("upload:") for item in found["structure"].values())
    body = {"kind": "solve", "scene": made["scene"], "frequency_hz": made["frequencies_hz"][0]}
    job = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
    assert job["status"] == "successful"


def test_the_values_to_begin_with_make_a_damper(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither stuck nor free: the least peak lies within the page's range of loads, and far below both."""
    monkeypatch.chdir(tmp_path)
    structure = {"dofs": {"tip": 14, "mid": 6}, "damping_ratio": 1e-3}
    files = {"M": "pair.npz", "K": "pair.npz"}
    raw = looked_at(tmp_path, SETS["NumPy"], structure={**files, **structure}, **ASKED)["found"]["scene"]
    contact = raw["contacts"][0]
    # The static stiffness of a cantilever of length 1 m and E I = 10 N m² at its tip is 3 E I / L³.
    assert contact["kt"] == pytest.approx(30.0, rel=0.02)
    inline = {"kind": "matrices", "M": M.tolist(), "K": K.tolist(), **structure}
    scene = solver.Scene.from_dict({**raw, "structure": inline})
    load = contact["N0"]
    best = solver.least_peak(scene, "damper.N0", load / 10, load * 15)
    assert load / 10 < best.at < load * 15
    for value in (load / 1000, load * 1000):
        end = solver.sweep(scene.with_values({"damper.N0": value})).peak
        assert end is not None
        assert end.value > 3.0 * best.peak


def refused(client: httpx.Client, **body: object) -> dict[str, str]:
    problem = is_problem(client.post("/v1/matrices", json=body), 422)
    return {issue["pointer"]: issue["detail"] for issue in problem["errors"]}


@pytest.mark.usefixtures("read_here")
def test_what_does_not_fit_is_said_beside_its_key(shipped: httpx.Client) -> None:
    small, _ = beam(5)
    mass, stiffness, other, rows = sent(
        shipped,
        {"M.mtx": abaqus_input(M, NODES), "K.mtx": coordinate(K), "M5.npz": npz(M=small),
         "few.mapping": ansys_mapping(LABELS[:5])},
    )  # fmt: skip
    pair = {"M": f"upload:{mass}", "K": f"upload:{stiffness}"}
    sizes = refused(shipped, structure={**pair, "M": f"upload:{other}"})
    assert "M has 10 rows, K has 16 rows: export all of them from one analysis" in sizes["/structure"]
    assert refused(shipped, structure={"M": pair["M"]})["/structure/K"].endswith("is missing")
    labels = refused(shipped, structure={**pair, "M": pair["K"], "mapping": f"upload:{rows}"})
    assert "'few.mapping' names 5 rows, the matrices have 16" in labels["/structure/mapping"]
    named = {**pair, "dofs": {"tip": "99.UY", "mid": 6}}
    assert "no node 99" in refused(shipped, structure=named, **ASKED)["/structure/dofs/tip"]
    named["dofs"]["tip"] = 14
    assert set(refused(shipped, structure=named)) == {"/excitation/dof"}
    wrong = {**ASKED, "contacts": [{"name": "damper", "between": ["tip", "wing"]}]}
    assert any(
        where.startswith("/contacts/0/between") for where in refused(shipped, structure=named, **wrong)
    )
    assert "no upload" in refused(shipped, uploads=[mass, "none"])["/uploads/1"]
    assert "not read here" in refused(shipped, structure={**pair, "K": "/etc/passwd"})["/structure/K"]
    assert set(refused(shipped)) == {"/uploads"}
    assert "alone must hold M and K" in refused(shipped, uploads=[mass])["/uploads"]


@pytest.mark.long
def test_a_large_model_is_reduced(shipped: httpx.Client) -> None:
    n = 2400
    main, side = np.full(n, 2e6), np.full(n - 1, -1e6)
    lines = [f"{i + 1} {i + 1} {v:.6e}" for i, v in enumerate(main)]
    lines += [f"{i + 2} {i + 1} {v:.6e}" for i, v in enumerate(side)]
    stiffness = "\n".join(lines) + "\n"
    mass = "".join(f"{i + 1} {i + 1} 1.0e-02\n" for i in range(n))
    uploads = sent(shipped, {"K.sti": stiffness, "M.mas": mass})
    found = look(shipped, uploads=uploads)
    first = np.sqrt(1e8) * np.pi / (n + 1) / (2.0 * np.pi)
    assert found["frequencies_hz"][0] == pytest.approx(first, rel=1e-4)
    structure = {**found["structure"], "dofs": {"tip": 1000, "mid": 500}}
    assert "2000 are the most" in refused(shipped, structure=structure, **ASKED)["/structure/keep_modes"]
    made = look(shipped, structure={**structure, "keep_modes": 12}, **ASKED)
    assert made["frequencies_hz"][0] == pytest.approx(first, rel=1e-3)
    assert made["reduction"]["good_to_hz"] > 3.0 * first


def test_modes_begin_a_scene_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    omega2, modes = np.array([100.0, 4000.0]), np.array([[1.0, 0.5], [0.6, -1.0], [0.1, 0.2]])
    files: dict[str, str | bytes] = {"modes.npz": npz(modes=modes, omega2=omega2)}
    found = looked_at(tmp_path, files)["found"]
    assert (found["rows"], found["modes"], found["structure"]) == (3, 2, {"modes": "modes.npz"})
    structure = {**found["structure"], "dofs": {"tip": 0, "mid": 1}}
    made = looked_at(tmp_path, files, structure=structure, **ASKED)["found"]
    assert made["frequencies_hz"] == pytest.approx(np.sqrt(omega2) / (2.0 * np.pi))
    assert made["scene"]["observe"]["dof"] == "mid"
