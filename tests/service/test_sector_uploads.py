"""One sector of a disk by uploads: the same scene as from files, and refusals that name field and remedy."""

import json
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from sector_files import DOFS, SECTORS, TABLES, scene_of, sector_files
from service_helpers import ServedClient, is_problem, stored_upload
from upload_cases import npz, upload

import solver
from service.auth.callers import Caller
from service.cli import main
from service.errors import InvalidRequestError, NotFoundError
from service.uploads import inspection
from service.uploads.uploads import file_names
from solver.linear.assembly import linear_model
from solver.matrices.scene_files import with_files
from solver.scene.scene import Scene

ROOT = Path(__file__).resolve().parents[2]
FILES = sector_files()
NAMES = {"M": "ring.mas", "K": "ring.sti", "mapping": "ring.dof"}
WAIT = {"Prefer": "wait=120"}


def sent(client: httpx.Client, name: str, data: bytes, **params: str) -> str:
    answer = upload(client, name, data, **params)
    assert answer.status_code in (200, 201), answer.text
    return f"upload:{answer.json()['id']}"


def tables(nodes: str = "ring.inp", files: dict[str, str] = NAMES, **cyclic: Any) -> dict[str, Any]:
    return {**files, "dofs": DOFS, "cyclic": {**TABLES, "nodes": nodes, **cyclic}}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, data in FILES.items():
        (tmp_path / name).write_bytes(data)
    return tmp_path


@pytest.fixture(scope="module")
def ids(shipped: ServedClient) -> dict[str, str]:
    return {name: sent(shipped, name, data) for name, data in FILES.items()}


def uploaded(ids: dict[str, str], **cyclic: Any) -> dict[str, Any]:
    files = {key: ids[name] for key, name in NAMES.items()}
    return tables(cyclic.pop("nodes", ids["ring.inp"]), files, **cyclic)


def from_files(folder: Path, structure: dict[str, Any]) -> Scene:
    return Scene.from_dict(with_files(scene_of(structure), folder))


def swept(client: httpx.Client, scene: Any) -> dict[str, Any]:
    body = {"kind": "sweep", "scene": scene, "harmonics": 1}
    answer = client.post("/v1/jobs", json=body, headers=WAIT)
    assert answer.status_code in (200, 201, 202), answer.text
    job: dict[str, Any] = answer.json()
    assert job["status"] == "successful", job
    return job


@pytest.mark.parametrize("cyclic", [{}, {"keep_modes": 4}], ids=["as it is", "reduced"])
def test_a_sweep_of_an_uploaded_sector_is_that_of_its_files(
    shipped: ServedClient, folder: Path, ids: dict[str, str], cyclic: dict[str, Any]
) -> None:
    here = from_files(folder, tables(**cyclic))
    branch = solver.sweep(here, harmonics=1)
    assert branch.peak is not None
    job = swept(shipped, scene_of(uploaded(ids, **cyclic)))
    peak = job["sweeps"][0]["peak"]
    assert (peak["value"], peak["at"]) == pytest.approx((branch.peak.value, branch.peak.at), rel=1e-9)
    stuck = solver.sweep(here.with_values({"rub.N0": 1e4}), harmonics=1).peak
    assert stuck is not None
    assert peak["value"] != pytest.approx(stuck.value, rel=1e-2), "the contact slips"
    again = swept(shipped, here.to_dict())
    assert again["result_of"] == job["id"], "the same scene, however it came"


def test_a_reduced_file_takes_the_place_of_the_matrices(shipped: ServedClient, folder: Path) -> None:
    """At every nodal diameter, with what mistuning may scale."""
    command = [
        "import",
        *(str(folder / name) for name in ("ring.mas", "ring.sti")),
        "--sectors",
        str(SECTORS),
    ]
    command += ["--nodes", str(folder / "ring.inp"), "--low", "LOW", "--high", "HIGH", "--reduce"]
    command += ["--modes", "4", "--mistune", "K", "--engine-order", "2", "--out", str(folder / "scene.toml")]
    command += [word for name, label in DOFS.items() for word in ("--dof", f"{name}={label}")]
    assert main(command) == 0
    made = tomllib.loads((folder / "scene.toml").read_text())["structure"]
    answer = upload(shipped, "reduced.npz", (folder / made["diameters"]).read_bytes()).json()
    held = {"name": "diameters", "rows": 6, "columns": SECTORS // 2 + 1, "entries": None}
    assert answer["contents"] == [held]
    structure = {"diameters": made["diameters"], "dofs": made["dofs"], "cyclic": made["cyclic"]}
    mistuning = {"of": ["K"], "values": [1.05, 0.97, 1.0, 1.02, 0.98, 1.01]}
    for more in ({}, {"mistuning": mistuning}):
        branch = solver.sweep(from_files(folder, {**structure, **more}), harmonics=1)
        given = {**structure, **more, "diameters": f"upload:{answer['id']}"}
        peak = swept(shipped, scene_of(given))["sweeps"][0]["peak"]
        assert branch.peak is not None
        assert peak["value"] == pytest.approx(branch.peak.value, rel=1e-9)


def test_a_sector_is_reduced_for_its_engine_order_and_with_its_parts(
    shipped: ServedClient, folder: Path, ids: dict[str, str]
) -> None:
    """The nodal diameters built follow from the excitation, so what is kept of one scene is not another's."""
    scene = scene_of(uploaded(ids, keep_modes=3))
    for order, met in ((2, [0, 2]), (1, [0, 1, 2, 3]), (3, [0, 3])):
        excitation = {**scene["excitation"], "engine_order": order}
        stored = shipped.post("/v1/scenes", json={**scene, "name": f"order{order}", "excitation": excitation})
        assert stored.status_code == 201, stored.text
        kept = shipped.get(f"/v1/scenes/order{order}").json()
        assert kept["scene"]["structure"]["diameters"]["diameters"] == met
    (folder / "blade.sti").write_bytes(FILES["ring.sti"])
    for name in ("blade", "../../blade"):
        parts = {**scene["structure"], "parts": {name: ids["ring.sti"]}}
        answer = shipped.post("/v1/scenes", json={**scene, "name": "parts", "structure": parts})
        if name == "blade":
            assert answer.status_code == 201, answer.text
            reduced = shipped.get("/v1/scenes/parts").json()["scene"]["structure"]["diameters"]
            here = from_files(folder, {**tables(keep_modes=3), "parts": {"blade": "blade.sti"}})
            assert (
                Scene.from_dict(
                    {**here.to_dict(), "structure": {**here.to_dict()["structure"], "diameters": reduced}}
                )
                == here
            )
        else:
            assert "letters, digits" in is_problem(answer, 422)["errors"][0]["detail"]


def refused(client: httpx.Client, structure: dict[str, Any]) -> dict[str, str]:
    body = {"kind": "solve", "scene": scene_of(structure), "frequency_hz": 30.0}
    problem = is_problem(client.post("/v1/jobs", json=body), 422)
    assert "/tmp" not in str(problem)
    return {issue["pointer"].removeprefix("/scene/structure"): issue["detail"] for issue in problem["errors"]}


@pytest.mark.usefixtures("read_here")
def test_what_does_not_fit_names_field_and_remedy(shipped: ServedClient, ids: dict[str, str]) -> None:
    no_deck = refused(shipped, uploaded(ids, nodes=ids["ring.dof"]))
    assert "has no nodes: *NODE (CalculiX, Abaqus)" in no_deck["/cyclic/nodes"]
    assert "must be inline or an upload" in refused(shipped, uploaded(ids, nodes="ring.inp"))["/cyclic/nodes"]
    assert "there is no upload" in refused(shipped, uploaded(ids, nodes="upload:none"))["/cyclic/nodes"]
    no_set = refused(shipped, uploaded(ids, low="SIDE"))["/cyclic/low"]
    assert "there is no set 'SIDE' of nodes in the deck; known: ALL, HIGH, LOW" in no_set
    assert "are exchanged" in refused(shipped, uploaded(ids, low="HIGH", high="LOW"))["/cyclic/low"]
    assert "without a partner" in refused(shipped, uploaded(ids, low=[1, 2]))["/cyclic/low"]
    for axis in ([0, 0, 0], ["z", 0, 1], [0, 1], [1.7e308, 1.7e308, 0], "z"):
        assert "must be a direction" in refused(shipped, uploaded(ids, axis=axis))["/cyclic/axis"]
    assert "whole number" in refused(shipped, uploaded(ids, keep_modes=10**9))["/cyclic/keep_modes"]
    unknown = {**uploaded(ids, keep_modes=3), "dofs": {"rim": None, "hub": 1}}
    assert "`dofs`" in refused(shipped, unknown)["/dofs"]
    one = uploaded(ids, keep_modes=3)
    del one["K"]
    assert "must come from a file too" in refused(shipped, one)["/K"]
    missing = uploaded(ids)
    del missing["mapping"]
    missing["dofs"] = {"rim": 17, "hub": 9}
    assert "`mapping`" in refused(shipped, missing)["/cyclic/low"]
    small = sent(shipped, "C.npz", npz(C=np.eye(5)))
    unlike = {**uploaded(ids), "dofs": missing["dofs"], "C": small}
    assert "export all matrices from one analysis" in refused(shipped, unlike)["/C"]
    other = sent(shipped, "M.npz", npz(M=np.eye(5)))
    for diameters, remedy in ((other, "has no array 'diameters'"), (ids["ring.sti"], "must end in .npz")):
        issue = refused(shipped, {"diameters": diameters, "dofs": {"rim": 0, "hub": 1}})["/diameters"]
        assert remedy in issue
        assert "stickslip import" in issue
    both = {**uploaded(ids), "diameters": other}
    assert "remove one or the other" in refused(shipped, both)["/diameters"]


@pytest.mark.usefixtures("read_here")
def test_no_file_of_the_service_is_read(shipped: ServedClient, ids: dict[str, str], tmp_path: Path) -> None:
    """Whatever key names it: nothing that is there, and nothing that a deck includes."""
    secret = tmp_path / "secret.inp"
    secret.write_text("*NODE\n1, secret\n")
    np.savez(tmp_path / "secret.npz", M=np.eye(3))
    npz_path = str(tmp_path / "secret.npz")
    for key in ("G", "K_omega2", "C", "diameters"):
        assert "files are not read here" in refused(shipped, {**uploaded(ids), key: npz_path})[f"/{key}"]
    parts = {**uploaded(ids), "parts": {"blade": npz_path}}
    assert "files are not read here" in refused(shipped, parts)["/parts/blade"]
    assert "files are not read here" in refused(shipped, uploaded(ids, nodes=str(secret)))["/cyclic/nodes"]
    deck = f"*NODE\n1, 0.0\n  *include, INPUT={secret}\n".encode()
    problem = is_problem(upload(shipped, "deck.inp", deck), 422)
    assert "line 3 includes another file, which is not read here: put the nodes" in problem["detail"]
    assert "secret" not in str(problem)
    disguised = sent(shipped, "deck.dof", FILES["ring.dof"])
    row = shipped.service.uploads.repository.get(disguised.removeprefix("upload:"))
    assert row is not None
    said = {"owner": row.owner, "name": "deck.dof", "format": "dof", "sha256": "1" * 64}
    held, _ = stored_upload(shipped.service.uploads.repository, deck, **said)
    told = refused(shipped, uploaded(ids, nodes=f"upload:{held.id}"))
    assert "includes another file" in told["/cyclic/nodes"], "whatever format the upload says"


def test_names_never_lead_out_of_the_folder(shipped: ServedClient) -> None:
    repository = shipped.service.uploads.repository
    rows = {}
    for number, (place, name) in enumerate(
        [(("M",), "K.npz"), (("parts", "../../x"), "K.npz"), (("K",), "2-K.npz"), (("C",), "K.npz")]
    ):
        said = {"owner": "names", "name": name, "format": "npz", "sha256": f"{number}" * 64}
        rows[place] = stored_upload(repository, b"x", **said)[0]
    names = list(file_names(rows).values())
    assert len(set(names)) == len(names), "each upload its own"
    assert not any("/" in name for name in names)


def test_what_another_one_uploaded_is_not_there(shipped: ServedClient) -> None:
    uploads = shipped.service.uploads
    theirs = {}
    for number, (name, data) in enumerate(FILES.items()):
        form = name.rpartition(".")[2].replace("mas", "sti")
        said = {"owner": "ann", "name": name, "format": form, "sha256": f"{number}" * 64}
        theirs[name] = f"upload:{stored_upload(uploads.repository, data, **said)[0].id}"
    ann, ben = (Caller(owner=name, key_id=name) for name in ("ann", "ben"))
    scene = {**scene_of(uploaded(theirs)), "name": "theirs"}
    assert "low_rows" in uploads.resolved(scene, ann)["structure"]["cyclic"]  # type: ignore[index,call-overload]
    with pytest.raises(InvalidRequestError) as caught:
        uploads.resolved(scene, ben)
    assert {issue.pointer for issue in caught.value.issues} == {
        f"/structure/{key}" for key in ("M", "K", "mapping", "cyclic/nodes")
    }
    assert all("there is no upload" in issue.said() for issue in caught.value.issues)
    with pytest.raises(NotFoundError):  # answered 404
        uploads.get(theirs["ring.inp"].removeprefix("upload:"), ben)


NBLOCK = b"NBLOCK,6\n(3i9,6e21.13e3)\n        1        0        0 0.0\nN,\n"
BAD_DECKS = {
    "none": (b"no nodes here\n", "has no nodes"),
    "an archive": (npz(M=np.eye(3)), "has no nodes"),
    "words": (b"*NODE\n1, here\n", "line 2 must hold a node"),
    "not a number": (b"*NODE\n1, nan, 0, 0\n", "finite place"),
    "too many": (b"*NODE\n1, 0.\n*NSET, NSET=A, GENERATE\n1, 99999999999999\n", "line 4: the sets have more"),
    "many ranges": (b"*NODE\n1, 0.\n*NSET, NSET=A, GENERATE\n" + 30 * b"1, 99999\n", "line 24: the sets"),
    "sets of sets": (b"*NODE\n1, 0.\n*NSET, NSET=A0\n1,1,1,1,1,1,1,1,1,1\n" + b"".join(
        b"*NSET, NSET=A%d\n%s\n" % (n + 1, b",".join(10 * [b"A%d" % n])) for n in range(9)), "the sets have"),
    "another file": (b"*NODE\n1, 0.\n* include , input=/etc/passwd\n", "line 3 includes another file"),
    "a set elsewhere": (b"*NODE\n1, 0.\n* NSET , NSET=A, INPUT=a.inp\n", "line 3 includes another file"),
    "no file": (b"*NODE\n1, 0.\n*INCLUDE\n", "line 3 must say which file"),
    "a wide block": (NBLOCK + b"CMBLOCK,A,NODE,2\n(8i10)\n         1-999999999\n", "line 7: the sets have"),
    "a block of words": (NBLOCK + b"CMBLOCK,A,NODE,2\n(8i10)\n         1       two\n", "whole numbers"),
    "a block of nothing": (NBLOCK + b"CMBLOCK,A,NODE,2\n(8i0)\n         1       two\n", "format of CMBLOCK"),
    "no step": (b"*NODE\n1, 0.\n*NSET, NSET=A, GENERATE\n1, 9, 0\n", "line 4 must hold nodes"),
    "a range of nothing": (NBLOCK + b"CMBLOCK,A,NODE,1\n(8i10)\n        -5\n", "does not begin: -5"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD_DECKS)
def test_a_bad_deck_is_refused(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data, wanted = BAD_DECKS[case]
    monkeypatch.chdir(tmp_path)
    Path("deck.inp").write_bytes(data)
    assert wanted in inspection._answer("describe", ["deck.inp"])["error"]


BAD_SECTORS = {
    "no matrices": ({"diameters": [0]}, "is no reduced sector"),
    "not whole": ({"diameters": [0.5]}, "is no reduced sector"),
    "not finite": ({"M": np.full((1, 2, 2), np.nan), "K": np.ones((1, 2, 2))}, "must hold finite numbers"),
    "not Hermitian": ({"K": np.array([[[1.0, 2.0], [0.0, 1.0]]])}, "`K` must be Hermitian"),
    "frequencies not finite": ({"held_hz": np.array([[np.nan]])}, "`held_hz` must hold finite"),
    "frequencies of no shape": ({"held_hz": np.array(1.0)}, "is no reduced sector"),
    "objects": ({"K": np.array([{}], dtype=object)}, "is no reduced sector"),
}


@pytest.mark.parametrize("case", BAD_SECTORS)
def test_a_bad_reduced_sector_is_refused(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arrays, wanted = BAD_SECTORS[case]
    whole = {"diameters": [0], "M": np.eye(2)[None], "K": np.eye(2)[None]}
    monkeypatch.chdir(tmp_path)
    given = arrays if case == "no matrices" else {**whole, **arrays}
    Path("reduced.npz").write_bytes(npz(**given))
    Path("good.npz").write_bytes(npz(**whole))
    assert inspection._answer("describe", ["good.npz"])["found"][1][0]["rows"] == 2
    error = inspection._answer("describe", ["reduced.npz"])["error"]
    assert wanted in error
    Path("reduced.npz").write_bytes(npz(**given)[:-30])
    with pytest.raises(solver.SceneError, match="is no reduced sector"):
        from_files(tmp_path, {"diameters": "reduced.npz", "dofs": {"rim": 0, "hub": 1}})


ASKED: dict[str, Any] = {
    "name": "ring", "contacts": [{"name": "rub", "between": ["rim", "ground"]}],
    "excitation": {"dof": "hub", "engine_order": 2}, "observe": {"dof": "rim"},
}  # fmt: skip


def begun(client: httpx.Client, structure: dict[str, Any], **asked: Any) -> dict[str, Any]:
    answer = client.post("/v1/matrices", json={"structure": structure, **asked})
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


@pytest.mark.few(2)
@pytest.mark.parametrize("keep", [{}, {"keep_modes": 3}], ids=["whole", "reduced"])
def test_a_scene_of_a_sector_begins_as_import_begins_it(
    shipped: ServedClient, ids: dict[str, str], folder: Path, keep: dict[str, int],
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(folder)
    uploads = [name.removeprefix("upload:") for name in ids.values()]
    seen = shipped.post("/v1/matrices", json={"uploads": uploads}).json()
    assert seen["rows"] == 27
    assert {one["name"]: one["nodes"] for one in seen["sets"]} == {"ALL": 9, "HIGH": 3, "LOW": 3}
    assert seen["structure"] == {key: ids[name] for key, name in NAMES.items()} | {
        "cyclic": {"nodes": ids["ring.inp"]}
    }
    cyclic = {**seen["structure"]["cyclic"], "low": "LOW", "high": "HIGH", **keep}
    structure = {**seen["structure"], "sectors": SECTORS, "dofs": DOFS, "cyclic": cyclic}
    structure["damping_ratio"] = 0.01
    made = begun(shipped, structure, **ASKED)
    assert made["scene"]["structure"] == {"kind": "matrices", **structure}
    words = ["import", "ring.mas", "ring.sti", "--mapping", "ring.dof", "--nodes", "ring.inp", "--low", "LOW",
             "--high", "HIGH", "--sectors", str(SECTORS), "--engine-order", "2", "--excite", "hub",
             "--observe", "rim", "--json", "--out", "ring.toml"]  # fmt: skip
    words += [text for name, label in DOFS.items() for text in ("--dof", f"{name}={label}")]
    assert main([*words, *(["--reduce", "--modes", "3"] if keep else [])]) == 0
    here = solver.load_scene("ring.toml")
    assert made["scene"]["observe"]["band"] == pytest.approx(list(here.observe.band), rel=1e-5)
    raw: dict[str, Any] = here.to_dict() | {"contacts": made["scene"]["contacts"]}
    raw["structure"] = {**raw["structure"], "damping_ratio": 0.01}
    at = {"frequency_hz": made["frequencies_hz"][0], "harmonics": 3}
    wanted = solver.solve(Scene.from_dict(raw), **at)
    job = shipped.post("/v1/jobs", json={"kind": "solve", "scene": made["scene"], **at}, headers=WAIT).json()
    assert job["status"] == "successful", job
    assert job["result"]["max_abs"] == pytest.approx(wanted.max_abs, rel=1e-9)
    if keep:
        assert [row["diameter"] for row in made["reduction"]["diameters"]] == [0, 2]
        told = json.loads(capsys.readouterr().out)["reduction"]
        for key in ("modes", "highest_hz", "good_to_hz"):
            assert made["reduction"][key] == pytest.approx(told[key], rel=1e-9)
        reduced = sent(shipped, "ring-reduced.npz", Path("ring-reduced.npz").read_bytes())
        alone = {"uploads": [reduced.removeprefix("upload:")]}
        again = shipped.post("/v1/matrices", json=alone).json()
        assert again["structure"] == {"diameters": reduced}
        assert (again["diameters"], again["rows"]) == ([0, 2], 5)
        small = {"diameters": reduced, "sectors": SECTORS, "dofs": {"rim": 0, "hub": 1}}
        third = begun(shipped, {**small, "damping_ratio": 0.01}, **ASKED)
        assert third["frequencies_hz"] == pytest.approx(made["frequencies_hz"], rel=1e-9)
        assert third["scene"]["contacts"] == made["scene"]["contacts"]


def test_the_values_to_begin_with_are_those_of_the_wave(shipped: ServedClient, ids: dict[str, str]) -> None:
    """A contact with the next sector is as stiff as the disk is where it acts, at this nodal diameter."""
    for order in (1, 3):
        structure = {**uploaded(ids), "sectors": SECTORS}
        contact = {"name": "rub", "between": ["rim", "rim@next"]}
        asked = ASKED | {"contacts": [contact], "excitation": {"dof": "hub", "engine_order": order}}
        made = begun(shipped, structure, **asked)
        model = linear_model(Scene.from_dict(shipped.service.uploads.resolved(made["scene"])))
        K, _, M = (each[0] for each in model.plain(np.array([order])))
        omega2 = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)
        assert made["frequencies_hz"][0] == pytest.approx(np.sqrt(omega2[0]) / (2.0 * np.pi), rel=1e-6)
        row = model.shapes[model.dofs.index("rim")] * (1.0 - np.exp(2j * np.pi * order / SECTORS))
        compliance = (row @ np.linalg.solve(K, row.conj())).real
        assert made["scene"]["contacts"][0]["kt"] == pytest.approx(1.0 / compliance, rel=6e-3)


@pytest.mark.usefixtures("read_here")
def test_what_does_not_fit_a_sector_that_begins_is_named(shipped: ServedClient, ids: dict[str, str]) -> None:
    whole = {**uploaded(ids), "sectors": SECTORS}
    wrong: list[tuple[dict[str, Any], str, str]] = [
        ({"cyclic": {**whole["cyclic"], "low": "SIDE"}}, "/structure/cyclic/low", "there is no set 'SIDE'"),
        ({"keep_modes": 3}, "/structure/keep_modes", "stands in `cyclic`"),
        ({"sectors": 0}, "/structure/sectors", "must be a whole number from 1 to 10000, got 0"),
        ({"dofs": {"rim": "8.UZ", "hub": "4.UX"}}, "/structure", "high boundary"),
    ]
    for change, pointer, words in wrong:
        asked = {"structure": {**whole, **change}, **ASKED}
        issue = is_problem(shipped.post("/v1/matrices", json=asked), 422)["errors"][0]
        assert issue["pointer"].startswith(pointer), issue
        assert words in issue["detail"]
    asked = {"structure": whole, **ASKED, "excitation": {"dof": "hub"}}
    assert shipped.post("/v1/matrices", json=asked).json()["scene"]["excitation"]["engine_order"] == 1
    asked["structure"] = {key: item for key, item in whole.items() if key not in ("sectors", "cyclic")}
    asked["excitation"] = {"dof": "hub", "engine_order": 2}
    issue = is_problem(shipped.post("/v1/matrices", json=asked), 422)["errors"][0]
    assert issue["pointer"].startswith("/excitation")


@pytest.mark.long
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_the_disk_of_the_documentation(
    shipped: ServedClient, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`submit` uploads matrices, labels and deck of the scene that the command wrote."""
    monkeypatch.chdir(tmp_path)
    subprocess.run([sys.executable, str(ROOT / "docs/fe/disk.py")], check=True, capture_output=True)
    subprocess.run(["ccx", "matrices"], check=True, capture_output=True)
    command = ["import", "matrices.sti", "matrices.mas", "--sectors", "24", "--dof", "tip=383.UY", "--nodes",
               "sector.inp", "--low", "LOW", "--high", "HIGH", "--engine-order", "8", "--keep-modes", "6",
               "--contact", "rub=tip:ground,kt=1e7,mu=0.3,N0=100", "--force", "tip=20",
               "--out", "disk.toml"]  # fmt: skip
    assert main(command) == 0, capsys.readouterr().err
    branch = solver.sweep(solver.load_scene("disk.toml"), harmonics=1)
    assert branch.peak is not None
    capsys.readouterr()
    url = str(shipped.base_url)
    words = ["submit", "sweep", "disk.toml", "--harmonics", "1", "--wait", "--json", "--url", url]
    assert main(words) == 0
    told = json.loads(capsys.readouterr().out)
    peak = told["sweeps"][0]["peak"] if "sweeps" in told else told["result"]["peak"]
    assert peak["value"] == pytest.approx(branch.peak.value, rel=1e-9)
