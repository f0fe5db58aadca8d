"""Files of matrices: stored after a look at them in a process of its own, referred to by scenes."""

import hashlib
import io
import signal
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from fe_files import coordinate
from matrix_cases import beam, hb_text, write_scene
from scipy.io import mmwrite, savemat
from scipy.sparse import coo_array, save_npz
from service_helpers import is_problem, stored_upload
from upload_cases import npz, saved, upload

import solver
from service.client import Client
from service.db.engine import Database
from service.db.repositories import UploadRepository
from service.errors import NotFoundError, UnreadableUploadError
from service.uploads import inspection

M, K = beam(4)
MARKET = b"%%%%MatrixMarket matrix %s real general\n%s"


FILES: dict[str, bytes] = {
    "M.npz": npz(M=M),
    "all.npz": npz(M=M, K=K),
    "sparse.npz": saved(lambda file: save_npz(file, coo_array(M).tocsr())),
    "M.npy": saved(lambda file: np.save(file, M)),
    "M.mat": saved(lambda file: savemat(file, {"M": M})),
    "M.mtx": saved(lambda file: mmwrite(file, coo_array(M))),
    "M.rsa": hb_text(M, "RSA").encode(),
    "M.sti": coordinate(M).encode(),
    "M.dof": "".join(f"{row + 1}.2\n" for row in range(len(M))).encode(),
    "modes.npz": npz(modes=np.eye(3), omega2=np.arange(1.0, 4.0)),
}


@pytest.mark.parametrize("name", FILES)
def test_every_format_is_described(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(FILES[name])
    found = inspection._answer("describe", [name])["found"][1]
    sizes = {(one["rows"], one["columns"]) for one in found}
    others = {"modes.npz": (3, 3), "M.dof": (len(M), 1)}
    assert sizes == {others.get(name, M.shape)}


def test_a_file_comes_in_once(http: httpx.Client) -> None:
    name = "all.npz"
    data = FILES[name]
    answer = upload(http, name, data)
    assert answer.status_code in (200, 201), answer.text
    made = answer.json()
    assert (made["name"], made["size"]) == (name, len(data))
    assert [one["name"] for one in made["contents"]] == ["M", "K"]
    again = upload(http, "other-" + name, data)
    assert (again.status_code, again.json()["id"]) == (200, made["id"]), "the same file once"
    assert again.json()["created"] > made["created"], "and as new"
    made = again.json()
    link = answer.headers["location"]
    shown = http.get(link).json()
    assert shown == {key: value for key, value in made.items() if key != "contents"}
    assert shown in http.get("/v1/uploads").json()["items"]
    assert http.delete(link).status_code == 204
    is_problem(http.get(link), 404)
    is_problem(http.delete(link), 404)


def test_the_format_is_told_by_query_name_or_content_type(http: httpx.Client) -> None:
    assert upload(http, "x", FILES["M.rsa"], format="hb").json()["format"] == "hb"
    typed = http.post("/v1/uploads", content=FILES["M.npy"], headers={"Content-Type": "application/x-npy"})
    assert typed.json()["format"] == "npy"
    untold = is_problem(upload(http, "x", b"?"), 422)
    assert untold["errors"][0]["pointer"] == "/format"
    is_problem(upload(http, "x", b"?", format="exe"), 422)
    for name in ("../x.npz", "/etc/passwd", ".npz", "a\x00.npz", "x" * 201, "ü.npz", "a/b.npz", "-rf"):
        is_problem(upload(http, name, FILES["M.npz"]), 422)


def scene_of(folder: Path, **structure: str) -> dict[str, Any]:
    scene = solver.load_scene(write_scene(folder)).to_dict()
    tables = {key: item for key, item in scene["structure"].items() if key not in ("M", "K", "modes")}
    return {**scene, "structure": {**tables, **structure}}


def test_a_scene_refers_to_uploads_and_is_hashed_by_what_they_hold(
    shipped: httpx.Client, tmp_path: Path
) -> None:
    ids = {key: upload(shipped, f"{key}.npz", npz(**{key: array})).json()["id"] for key, array in
           (("M", M), ("K", K))}  # fmt: skip
    scene = scene_of(tmp_path, **{key: f"upload:{one}" for key, one in ids.items()})
    inline = solver.load_scene(tmp_path / "scene.toml").to_dict()
    body = {"kind": "solve", "frequency_hz": 1.0, "harmonics": 3}
    first = shipped.post("/v1/jobs", json={**body, "scene": scene}, headers={"Prefer": "wait=60"}).json()
    assert first["status"] == "successful"
    second = shipped.post("/v1/jobs", json={**body, "scene": inline}).json()
    assert second["result_of"] == first["id"], "the same scene, however it came"
    plan = shipped.post("/v1/plan", json={"scene": scene})
    assert plan.status_code == 200
    stored = shipped.post("/v1/scenes", json={**scene, "name": "kept"})
    assert stored.status_code == 201
    for one in ids.values():
        assert shipped.delete(f"/v1/uploads/{one}").status_code == 204
    kept = shipped.post(
        "/v1/jobs", json={**body, "scene": "kept", "harmonics": 4}, headers={"Prefer": "wait=60"}
    )
    assert kept.json()["status"] == "successful"
    problem = is_problem(shipped.post("/v1/jobs", json={**body, "scene": scene, "fresh": True}), 422)
    assert [one["pointer"] for one in problem["errors"]] == ["/scene/structure/M", "/scene/structure/K"]


def test_a_large_file_comes_in_parts(shipped: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    data = npz(K=np.arange(1.0, 10.0).reshape(3, 3) + np.eye(3))
    cut = len(data) // 3
    ids = [
        upload(shipped, "K.npz", piece, format="part").json()["id"]
        for piece in (data[:cut], data[cut : 2 * cut], data[2 * cut :])
    ]
    put = {"name": "K.npz", "part": ids}
    problem = is_problem(shipped.post("/v1/uploads", params=put, content=b"x"), 422)
    assert problem["errors"][0]["pointer"] == "/part"
    backwards = is_problem(shipped.post("/v1/uploads", params={**put, "part": [ids[0], "none"]}), 422)
    assert backwards["errors"][0]["pointer"] == "/part/1"
    found = shipped.post("/v1/uploads", params=put)
    assert found.status_code == 201, found.text
    assert found.json()["sha256"] == hashlib.sha256(data).hexdigest()
    assert [one["rows"] for one in found.json()["contents"]] == [3]
    assert all(shipped.get(f"/v1/uploads/{one}").status_code == 404 for one in ids)
    whole = {**put, "part": [found.json()["id"]]}
    assert is_problem(shipped.post("/v1/uploads", params=whole), 422)["errors"][0]["pointer"] == "/part/0"
    many = is_problem(shipped.post("/v1/uploads", params={**put, "part": ["1"] * 9}), 413)
    assert "STICKSLIP_MAX_UPLOAD_PARTS" in many["detail"]
    assert "--reduce" in many["detail"]
    monkeypatch.setattr("service.client.client._PART_BYTES", 100)
    with Client(str(shipped.base_url)) as client:
        assert client.upload(data, "K.npz").sha256 == hashlib.sha256(data).hexdigest()


def test_files_that_share_a_part_do_not_share_its_fate(shipped: httpx.Client) -> None:
    data = npz(K=np.arange(1.0, 10.0).reshape(3, 3) + 2.0 * np.eye(3))
    cut = len(data) // 2
    both = [
        [upload(shipped, "K.npz", piece, format="part").json()["id"] for piece in (data[:cut], data[cut:])]
        for _ in range(2)
    ]
    for ids, status in zip(both, (201, 200), strict=True):
        found = shipped.post("/v1/uploads", params={"name": "K.npz", "part": ids})
        assert found.status_code == status, found.text
        assert found.json()["sha256"] == hashlib.sha256(data).hexdigest()


def test_the_time_to_read_files_grows_with_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "K.npz"
    file.write_bytes(npz(K=np.eye(12)))
    with pytest.raises(UnreadableUploadError, match=r"raise STICKSLIP_INSPECTION_SECONDS .* --reduce"):
        inspection.contents(file, 0.001)
    monkeypatch.setattr("service.uploads.inspection._USUAL_BYTES", 1)
    assert [one["rows"] for one in inspection.contents(file, 0.1)[0]] == [12]


def test_what_does_not_fit_is_refused_with_pointers(shipped: httpx.Client, tmp_path: Path) -> None:
    small = upload(shipped, "K.npz", npz(K=np.eye(3))).json()["id"]
    mass = upload(shipped, "M.npz", npz(M=M)).json()["id"]
    body = {"kind": "solve", "frequency_hz": 1.0}

    def pointers(**structure: Any) -> list[str]:
        answer = shipped.post("/v1/jobs", json={**body, "scene": scene_of(tmp_path, **structure)})
        problem = is_problem(answer, 422)
        assert str(tmp_path) not in str(problem)
        assert "/tmp" not in str(problem)
        return [one["pointer"] for one in problem["errors"]]

    assert pointers(M=f"upload:{mass}", K=f"upload:{small}")[0].startswith("/scene/structure")
    assert pointers(M=f"upload:{mass}", modes=f"upload:{mass}") == ["/scene/structure/modes"]
    for path in ("M.npz", str(tmp_path / "M.npz"), "upload:../../M.npz", "upload:", "upload:none", "file:x"):
        assert "/scene/structure/M" in pointers(M=path, K=f"upload:{small}")
    files = {"M": f"upload:{mass}", "K": f"upload:{mass}"}
    for path in ("/etc/passwd", "rows.dof", "upload:none", f"upload:{mass}"):
        assert pointers(**files, mapping=path) == ["/scene/structure/mapping"]
    many = {"M": f"upload:{mass}", "K": f"upload:{mass}", "keep_modes": 10**9}
    assert pointers(**many) == ["/scene/structure/keep_modes"]


def test_a_large_model_is_reduced_where_it_is_read(shipped: httpx.Client, tmp_path: Path) -> None:
    large_M, large_K = (coo_array(one) for one in beam(40))
    ids = {}
    for key, matrix in (("M", large_M), ("K", large_K)):
        data = saved(lambda file, matrix=matrix: save_npz(file, matrix.tocsr()))
        ids[key] = f"upload:{upload(shipped, f'{key}.npz', data).json()['id']}"
    scene = scene_of(tmp_path, **ids)
    scene["structure"] |= {"keep_modes": 5, "dofs": {"tip": 78, "mid": 38}}
    body = {"kind": "solve", "scene": scene, "frequency_hz": 1.0, "harmonics": 3}
    job = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
    assert job["status"] == "successful", job


def zip_bomb() -> bytes:
    """A .npz of a few kilobytes whose array inflates to four gigabytes; its header says so."""
    header = saved(lambda f: np.lib.format.write_array_header_1_0(
        f, {"descr": "<f8", "fortran_order": False, "shape": (23170, 23170)}))  # fmt: skip
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as file:
        file.writestr("M.npy", header + bytes(64 * 1024**2))
    return buffer.getvalue()


def matlab_bomb() -> bytes:
    """A MATLAB 5 file with a compressed element that inflates to a gigabyte of nothing."""
    packer = zlib.compressobj(9)
    body = b"".join(packer.compress(bytes(16 * 1024**2)) for _ in range(16)) + packer.flush()
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return head + np.array([15, len(body)], "<u4").tobytes() + body


def pickled(f: Any) -> None:
    np.save(f, np.array([print]), allow_pickle=True)


def huge_header(f: Any) -> None:
    shape = {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**6)}
    np.lib.format.write_array_header_1_0(f, shape)


HOSTILE: dict[str, tuple[str, Callable[[], bytes]]] = {
    "nothing": ("M.npz", lambda: b""),
    "no zip": ("M.npz", lambda: b"\x00" * 1000),
    "cut off": ("M.npz", lambda: FILES["M.npz"][:-40]),
    "objects": ("M.npz", lambda: npz(M=np.array([{}, []], dtype=object))),
    "pickle": ("M.npy", lambda: saved(pickled)),
    "NaN": ("M.npy", lambda: saved(lambda f: np.save(f, np.full((3, 3), np.nan)))),
    "infinity": ("M.npz", lambda: npz(M=np.diag([1.0, np.inf]))),
    "text": ("M.npz", lambda: npz(M=np.array([["a"]]))),
    "complex": ("M.npy", lambda: saved(lambda f: np.save(f, np.eye(2) * 1j))),
    "not square": ("M.npy", lambda: saved(lambda f: np.save(f, np.ones((2, 3))))),
    "other names": ("M.npz", lambda: npz(a=M, b=K)),
    "path names": ("M.npz", lambda: npz(**{"../../M": M, "/etc/M": M})),
    "MATLAB 7.3": ("M.mat", lambda: b"MATLAB 7.3 MAT-file".ljust(512, b" ") + b"\x89HDF\r\n"),
    "Harwell-Boeing in UTF-16": ("M.hb", lambda: hb_text(M, "RSA").encode("utf-16")),
    "an HTML page": ("M.mtx", lambda: b"<!doctype html><title>404</title>"),
}
BOMBS: dict[str, tuple[str, Callable[[], bytes]]] = {
    "zip bomb": ("M.npz", zip_bomb),
    "header larger than the file": ("M.npy", lambda: saved(huge_header)),
    "MATLAB bomb": ("M.mat", matlab_bomb),
    "8 terabytes": ("M.mtx", lambda: MARKET % (b"array", b"1000000 1000000\n1\n")),
    "too many rows": ("M.mtx", lambda: MARKET % (b"coordinate", b"2000000000 2000000000 1\n1 1 1.0\n")),
    "a false header": (
        "M.hb",
        lambda: hb_text(M, "RSA").replace(f"{len(M):14d}", f"{2**31 - 1:14d}").encode(),
    ),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_a_hostile_file_is_refused(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name, make = HOSTILE[case]
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(make())
    answer = inspection._answer("describe", [name])
    assert list(answer) == ["error"]
    assert "/tmp" not in answer["error"]


# A process each: the default suite has one that inflates and one that promises too much.
QUICK = ("zip bomb", "8 terabytes")


@pytest.mark.parametrize(
    "case", [case if case in QUICK else pytest.param(case, marks=pytest.mark.long) for case in BOMBS]
)
def test_a_bomb_is_refused_and_the_service_lives(http: httpx.Client, case: str) -> None:
    """In a process of its own, which may need all the memory it is allowed."""
    name, make = BOMBS[case]
    problem = is_problem(upload(http, name, make()), 422)
    assert problem["type"] == "urn:stickslip:problem:unreadable-upload"
    assert http.get("/health/live").status_code == 200


def test_compressed_bodies_are_refused(http: httpx.Client) -> None:
    for encoding in ("gzip", "br", "deflate, gzip"):
        headers = {"Content-Encoding": encoding}
        is_problem(http.post("/v1/uploads?name=x.npz", content=b"x", headers=headers), 415)


def test_a_reader_that_takes_too_long_or_dies_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "M.npz").write_bytes(FILES["M.npz"])
    with pytest.raises(UnreadableUploadError, match=r"longer than 0\.01 s"):
        inspection.contents(tmp_path / "M.npz", 0.01)
    monkeypatch.setattr(inspection, "_budget", inspection._Budget(inspection._LEAST_BYTES + 10**6))
    assert inspection.contents(tmp_path / "M.npz", 30.0)[0][0]["rows"] == len(M), "its place is free again"
    assert "damaged" in inspection._end(-signal.SIGSEGV, 1.0)
    assert "memory or time" in inspection._end(-signal.SIGKILL, 1.0)
    assert "longer than 1 s" in inspection._end(-signal.SIGXCPU, 1.0)
    with pytest.raises(UnreadableUploadError, match="more than 10 bytes"):
        inspection.resolved_structure({"kind": "matrices", "M": "M.npz"}, tmp_path, 30.0, 10)


def test_uploads_are_kept_by_owner(database: Database) -> None:
    uploads = UploadRepository(database)
    given = {"name": "M.npz", "format": "npz", "sha256": "0" * 64}
    mine, new = stored_upload(uploads, b"abc", owner="me", **given)
    same, again = stored_upload(uploads, b"abc", owner="me", **given)
    other, other_new = stored_upload(uploads, b"abc", owner="you", **given)
    assert (new, again, other_new) == (True, False, True)
    named = ("owner", "size", *given)
    assert [getattr(same, one) for one in named] == ["me", 3, *given.values()]
    assert same.id == mine.id != other.id
    assert same.created > mine.created
    mine = same
    assert list(uploads.files.pieces(mine.id)) == [b"abc"]
    with uploads.files.work() as folder:
        uploads.files.place(mine, folder / "M.npz")
        assert (folder / "M.npz").read_bytes() == b"abc"
    assert [row.id for row in uploads.page(10)] == [other.id, mine.id]
    for found in (uploads.page(10, owner="me"), uploads.page(10, before=other.id)):
        assert [(row.id, row.created) for row in found] == [(mine.id, mine.created)]
    uploads.delete(mine.id)
    assert uploads.get(mine.id) is None
    with uploads.files.work() as folder, pytest.raises(NotFoundError):
        uploads.files.place(mine, folder / "M.npz")
    assert list(uploads.files.pieces(mine.id)) == []
