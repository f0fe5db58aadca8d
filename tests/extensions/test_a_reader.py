"""A format of matrix files of this folder (`banded_text`): named once, it is read wherever files are."""

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest
from banded_text import BANDED
from docs_tables import formats_table

import solver
from service.cli import main
from service.client.client import Client
from solver import extensions
from solver.matrices.load_set import MatrixFileError, read_matrix
from solver.matrices.readers import reader_registry as registry
from solver.scene.scene import Scene

M = np.diag([0.02, 0.03, 0.04])
K = np.array([[5e5, -3e5, 0.0], [-3e5, 7e5, -2e5], [0.0, -2e5, 9e5]])


def text(matrix: np.ndarray) -> str:
    lines = [" ".join(map(repr, np.diag(matrix, offset).tolist())) for offset in range(3)]
    return "\n".join(["BANDED", *lines]) + "\n"


@pytest.fixture(autouse=True)
def named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(extensions.VARIABLE, json.dumps(["banded_text:BANDED"]))


@pytest.fixture
def files(tmp_path: Path) -> Path:
    (tmp_path / "disk.mband").write_text(text(M))
    (tmp_path / "disk.kband").write_text(text(K))
    return tmp_path


@pytest.fixture(scope="module")
def http(url: str) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=url, timeout=60.0) as client:
        yield client


def scene(**structure: object) -> dict[str, object]:
    return {
        "name": "banded",
        "structure": {
            "kind": "matrices", "dofs": {"tip": 0, "root": 2}, "stiffness_proportional_damping": 1e-6,
            **structure,
        },
        "contacts": [{"name": "damper", "between": ["tip", "ground"], "kt": 1e5, "mu": 0.3, "N0": 20.0}],
        "excitation": {"dof": "root", "amplitude": 5.0},
        "observe": {"dof": "tip", "band": [200.0, 900.0]},
    }  # fmt: skip


def toml(path: Path) -> None:
    path.write_text(
        'name = "banded"\n[structure]\nkind = "matrices"\nM = "disk.mband"\nK = "disk.kband"\n'
        "dofs = { tip = 0, root = 2 }\nstiffness_proportional_damping = 1e-6\n"
        '[[contacts]]\nname = "damper"\nbetween = ["tip", "ground"]\nkt = 1e5\nmu = 0.3\nN0 = 20.0\n'
        '[excitation]\ndof = "root"\namplitude = 5.0\n[observe]\ndof = "tip"\nband = [200.0, 900.0]\n'
    )


def test_a_scene_with_its_files_is_solved(files: Path) -> None:
    toml(files / "scene.toml")
    read = solver.load_scene(files / "scene.toml")
    inline = Scene.from_dict(scene(M=M.tolist(), K=K.tolist()))
    assert read == inline
    assert (
        solver.solve(read, frequency_hz=500.0).max_abs == solver.solve(inline, frequency_hz=500.0).max_abs > 0
    )


def test_the_command_imports_its_files(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # In the wrong order: the endings tell which is which.
    paths = [str(files / name) for name in ("disk.kband", "disk.mband")]
    assert main(["import", *paths, "--out", str(files / "made.toml"), "--dof", "tip=0"]) == 0
    made = tomllib.loads((files / "made.toml").read_text())
    assert (made["structure"]["M"], made["structure"]["K"]) == ("disk.mband", "disk.kband")
    capsys.readouterr()
    assert main(["import", "--formats"]) == 0
    assert ".mband, .kband" in capsys.readouterr().out


def test_messages_name_it(files: Path) -> None:
    (files / "disk.txt").write_text(text(K))
    (files / "broken.kband").write_text("BANNED\n1\n")
    with pytest.raises(MatrixFileError, match=r"\.mband, \.kband, .*begins as banded text.* end in \.mband"):
        read_matrix(files / "disk.txt", "K")
    with pytest.raises(MatrixFileError, match=r"broken\.kband.*line 1 must be BANDED, got 'BANNED'"):
        read_matrix(files / "broken.kband", "K")


@pytest.mark.long
def test_the_service_reads_uploads_of_it(http: httpx.Client) -> None:
    sent = {
        key: http.post("/v1/uploads", params={"name": f"disk.{key.lower()}band"}, content=text(matrix))
        for key, matrix in (("M", M), ("K", K))
    }
    assert {answer.status_code for answer in sent.values()} == {201}, sent["K"].text
    assert sent["K"].json()["contents"] == [{"name": None, "rows": 3, "columns": 3, "entries": 7}]
    ids = {key: f"upload:{answer.json()['id']}" for key, answer in sent.items()}
    looked = http.post("/v1/matrices", json={"uploads": [i.removeprefix("upload:") for i in ids.values()]})
    assert looked.json()["structure"] == ids
    plans = [
        http.post("/v1/plan", json={"scene": scene(**structure)})
        for structure in (ids, {"M": M.tolist(), "K": K.tolist()})
    ]
    assert plans[0].status_code == 200, plans[0].text
    assert plans[0].json()["unknowns"] == plans[1].json()["unknowns"]


@pytest.mark.parametrize(
    "how", [{"params": {"format": "kband"}}, {"headers": {"Content-Type": "text/x-banded"}}]
)
def test_the_service_is_told_the_format(http: httpx.Client, how: dict[str, dict[str, str]]) -> None:
    # A file that was sent before would be found with the format it had then.
    factor = 2.0 if "params" in how else 3.0
    answer = http.post("/v1/uploads", content=text(factor * K), **how)  # type: ignore[arg-type]
    assert (answer.status_code, answer.json()["format"]) == (201, "kband")


def test_a_damaged_upload_is_refused_by_its_reader(http: httpx.Client) -> None:
    answer = http.post("/v1/uploads", params={"name": "k.kband"}, content="BANDED\nx\n")
    assert answer.status_code == 422
    assert "'x'" in answer.json()["detail"]


def test_the_client_lists_it(http: httpx.Client) -> None:
    with Client(str(http.base_url)) as client:
        assert [one.suffixes for one in client.formats() if one.name == BANDED.name] == [[".mband", ".kband"]]


def test_the_service_describes_it(http: httpx.Client) -> None:
    (found,) = (one for one in http.get("/v1/matrices/formats").json()["items"] if one["word"] == "kband")
    assert found == {
        "name": "banded text", "suffixes": [".mband", ".kband"], "word": "kband", "gives": ["matrix"],
        "help": BANDED.help,
    }  # fmt: skip
    described = http.get("/openapi.json").json()["paths"]["/v1/uploads"]["post"]
    (asked,) = (one for one in described["parameters"] if one["name"] == "format")
    assert "kband" in str(asked["schema"])
    assert "text/x-banded" in described["requestBody"]["content"]


def test_the_table_of_formats_has_it() -> None:
    assert "| `.mband`, `.kband` | A program of one's own: diagonals, a line each. |" in formats_table()


def test_registered_for_one_process(monkeypatch: pytest.MonkeyPatch, files: Path) -> None:
    with pytest.raises(ValueError, match="banded text"):
        registry.register(BANDED)
    monkeypatch.delenv(extensions.VARIABLE)
    with pytest.raises(MatrixFileError, match="must end in"):
        read_matrix(files / "disk.kband", "K")
    registry.register(BANDED)
    try:
        assert np.array_equal(read_matrix(files / "disk.kband", "K").toarray(), K)
    finally:
        registry.unregister(BANDED)


@pytest.mark.parametrize("text", ["a:b", '["nowhere_at_all:B"]', '["json:NOTHING"]', "[1]"])
def test_what_cannot_be_imported_is_told(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setenv(extensions.VARIABLE, text)
    with pytest.raises(extensions.ExtensionError, match=extensions.VARIABLE):
        registry.readers()
