"""Sweeps and lists in every form they come in, and how the form is chosen."""

import csv
import importlib.util
import io
from pathlib import Path

import httpx
import numpy as np
import pytest
from each import each
from hypothesis import given
from hypothesis import strategies as st
from service_helpers import is_problem

import solver
from service.cli import main
from service.rendering.representations import preferred
from solver.results.files import Dataset

OFFERED = ("application/json", "text/csv", "application/x-npz")
FORMS = {
    "application/json": "application/json",
    "text/csv": "text/csv; charset=utf-8",
    "application/x-npz": "application/x-npz",
    "application/zip": "application/zip",
    "application/vnd.apache.parquet": "application/vnd.apache.parquet",
}


@each(
    ("accept", "wanted"),
    [
        (None, "application/json"),
        ("", "application/json"),
        ("*/*", "application/json"),
        ("text/*", "text/csv"),
        ("text/csv;q=0.5, application/json;q=0.4", "text/csv"),
        ("TEXT/CSV", "text/csv"),
        ("application/*;q=0.2, application/x-npz", "application/x-npz"),
        ("*/*, application/json;q=0", "text/csv"),
        ("application/json;q=0.5,*/*;q=0.5", "application/json"),
        ("text/html, */*;q=0.1", "application/json"),
        ("image/png", None),
        ("application/json;q=0", None),
        ("text/csv;q=2", None),
        ("nonsense", None),
        (", ,;q=1,text/csv", "text/csv"),
        ("text/csv;header=present;q=0.5", "text/csv"),
    ],
)
def test_the_preferred_form(accept: str | None, wanted: str | None) -> None:
    assert preferred(accept, OFFERED) == wanted


@given(st.text(max_size=200))
def test_any_header_can_be_read(accept: str) -> None:
    assert preferred(accept, OFFERED) in (*OFFERED, None)


@pytest.fixture(scope="module")
def sweep(shipped: httpx.Client) -> dict:
    body = {"kind": "sweep", "scene": "two-dof", "from": 0.5, "to": 1.5, "limit": 1.0}
    job = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
    return shipped.get(job["sweeps"][0]["links"]["self"]).json()


def loaded(content: bytes, suffix: str, folder: Path) -> Dataset:
    file = folder / f"sweep{suffix}"
    file.write_bytes(content)
    return solver.load(file)


def same_table(one: Dataset, other: Dataset) -> None:
    mine, theirs = one.table().variables, other.table().variables
    assert list(mine) == list(theirs)
    for name, variable in mine.items():
        np.testing.assert_array_equal(theirs[name].values, variable.values, err_msg=name)


def test_every_form_holds_the_same_numbers(shipped: httpx.Client, sweep: dict, tmp_path: Path) -> None:
    path, arrays = sweep["links"]["self"], {k: np.array(v) for k, v in sweep["arrays"].items()}
    rows = list(csv.DictReader(shipped.get(path, headers={"Accept": "text/csv"}).text.splitlines()))
    for name in ("parameter", "amplitude", "half_peak_to_peak", "mean", "residual"):
        assert [float(row[name]) for row in rows] == arrays[name].tolist()
    packed = loaded(shipped.get(path, headers={"Accept": "application/x-npz"}).content, ".npz", tmp_path)
    table = loaded(shipped.get(path, params={"format": "parquet"}).content, ".parquet", tmp_path)
    for found in (packed, table):
        assert found.attributes["sweep"] == sweep["id"]
        assert found["amplitude"].tolist() == sweep["arrays"]["amplitude"]
        assert found.variables["amplitude"].unit == "m"
    same_table(packed, table)


@pytest.mark.parametrize(
    ("words", "scene"),
    [
        (["--from", "0.5", "--to", "1.5"], "two-dof"),
        (["--from", "0.5", "--to", "1.5", "--set", "damper.N1=0"], "two-dof"),
        (["--parameter", "shroud.N0", "--from", "150", "--to", "160", "--frequency", "755"], "bladed-disk"),
        (["--parameter", "structure.k1", "--from", "150", "--to", "160", "--frequency", "1"], "two-dof"),
    ],
)
def test_python_the_command_and_the_service_write_the_same_table(
    shipped: httpx.Client, words: list[str], scene: str, tmp_path: Path
) -> None:
    """Odd harmonics alone and all of them, another parameter than the frequency, several contacts."""
    given = dict(zip(words[::2], words[1::2], strict=True))
    parameter, harmonics = given.get("--parameter", "frequency"), 5
    values = {k: float(v) for k, v in [one.split("=") for one in given.get("--set", "").split()]}
    at = float(given["--frequency"]) if "--frequency" in given else None
    ends = float(given["--from"]), float(given["--to"])
    here = solver.load_scene(scene).with_values(values)
    branch = solver.sweep(here, parameter, *ends, frequency_hz=at, harmonics=harmonics)
    body = {
        "kind": "sweep", "scene": scene, "parameter": parameter, "from": ends[0], "to": ends[1],
        "set": values, "harmonics": harmonics, **({} if at is None else {"frequency_hz": at}),
    }  # fmt: skip
    job = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
    path = job["sweeps"][0]["links"]["self"]
    for suffix in (".csv", ".npz", ".parquet"):
        file = tmp_path / f"mine{suffix}"
        assert main(["sweep", scene, *words, "--harmonics", "5", "--out", str(file), "--json"]) == 0
        stored = loaded(shipped.get(path, params={"format": suffix[1:]}).content, suffix, tmp_path)
        same_table(solver.load(file), stored)
    mine = branch.to_dataset()
    theirs = loaded(shipped.get(path, params={"format": "npz"}).content, ".npz", tmp_path)
    same_table(mine, theirs)
    assert {n: v.unit for n, v in mine.variables.items()} == {n: v.unit for n, v in theirs.variables.items()}
    assert theirs.attributes["scene"] == mine.attributes["scene"]


@pytest.mark.parametrize("form", FORMS)
def test_each_form_has_its_own_strong_tag(shipped: httpx.Client, sweep: dict, form: str) -> None:
    path = sweep["links"]["self"]
    first, second = (shipped.get(path, headers={"Accept": form}) for _ in range(2))
    assert first.headers["content-type"] == FORMS[form]
    assert first.headers["vary"] == "Accept"
    assert first.content == second.content
    tag = first.headers["etag"]
    assert not tag.startswith("W/")
    tags = {shipped.head(path, headers={"Accept": other}).headers["etag"] for other in FORMS}
    assert len(tags) == len(FORMS) - 1, "zip is npz under another name"
    unchanged = shipped.get(path, headers={"Accept": form, "If-None-Match": f'"x", {tag}'})
    assert (unchanged.status_code, unchanged.content) == (304, b"")
    assert (unchanged.headers["etag"], unchanged.headers["vary"]) == (tag, "Accept")
    head = shipped.head(path, headers={"Accept": form})
    assert (head.status_code, head.content) == (200, b"")
    assert int(head.headers["content-length"]) == len(first.content)


def test_pictures(shipped: httpx.Client, sweep: dict) -> None:
    svg = shipped.get(f"{sweep['links']['self']}/plot.svg")
    assert svg.headers["content-type"].startswith("image/svg+xml")
    assert "two-dof" in svg.text
    assert "<script" not in svg.text
    png = shipped.get(f"{sweep['links']['self']}/plot.png")
    assert png.headers["content-type"] == "image/png"
    assert png.content.startswith(b"\x89PNG")
    tag = {"If-None-Match": png.headers["etag"]}
    assert shipped.get(f"{sweep['links']['self']}/plot.png", headers=tag).status_code == 304
    is_problem(shipped.get("/v1/sweeps/none/plot.svg"), 404)


def test_a_form_that_is_not_there_is_refused_with_those_that_are(
    shipped: httpx.Client, sweep: dict, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = shipped.get(sweep["links"]["self"], headers={"Accept": "text/html"})
    problem = is_problem(answer, 406)
    assert problem["type"] == "urn:stickslip:problem:not-acceptable"
    assert all(form in problem["detail"] for form in FORMS)
    assert answer.headers["vary"] == "Accept"
    is_problem(shipped.get("/v1/sweeps", headers={"Accept": "image/png"}), 406)
    is_problem(shipped.get(sweep["links"]["self"], params={"format": "xml"}), 422)
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    problem = is_problem(shipped.get(sweep["links"]["self"], params={"format": "parquet"}), 406)
    assert "pip install 'stickslip[parquet]'" in problem["detail"]


@pytest.mark.usefixtures("sweep")
@pytest.mark.parametrize("path", ["/v1/sweeps", "/v1/designs", "/v1/jobs"])
def test_lists_are_tables_too(shipped: httpx.Client, path: str) -> None:
    for seed in range(2):
        body = {"kind": "design", "scene": "two-dof", "variables": {"damper.N0": [20, 1000 + seed]}}
        answer = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"})
        assert answer.json()["status"] == "successful"
    listed = shipped.get(path, params={"limit": 1}).json()
    table = shipped.get(path, params={"limit": 1}, headers={"Accept": "text/csv"})
    rows = list(csv.DictReader(io.StringIO(table.text)))
    assert [row["id"] for row in rows] == [item["id"] for item in listed["items"]]
    assert table.headers["link"] == f'<{listed["next"]}>; rel="next"'
    if path == "/v1/sweeps":
        assert float(rows[0]["contacts.damper.N0"]) == listed["items"][0]["contacts"]["damper"]["N0"]
        assert float(rows[0]["peak.value"]) == listed["items"][0]["peak"]["value"]


def test_head_is_get_without_a_body(shipped: httpx.Client) -> None:
    job = shipped.post("/v1/jobs", json={"kind": "sweep", "scene": "two-dof"}, headers={"Prefer": "wait=60"})
    links = [*job.json()["links"].values(), f"/v1/jobs/{job.json()['id']}/events"]
    for path in ["/v1/jobs", "/v1/scenes", "/health/live", "/metrics", "/openapi.json", *links]:
        answer = shipped.head(path)
        assert (answer.status_code, answer.content) == (200, b""), path
    assert shipped.head("/v1/jobs/none").status_code == 404
    assert shipped.head("/v1/plan").status_code == 405
