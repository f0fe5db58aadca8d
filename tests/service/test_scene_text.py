"""Scenes from and to the text of a file."""

import json
import tomllib
from pathlib import Path

import httpx
import pytest
from service_helpers import is_problem

import solver
from service.jobs.common.scene_text import MOST_OF_TOML
from solver.scene.toml import toml_text

PATHS = {"two-dof": "damper.N0", "bladed-disk": "shroud.N0", "shroud-3d": "shroud.N0"}


@pytest.mark.parametrize("name", solver.shipped_scenes())
def test_a_scene_comes_back_from_its_toml(shipped: httpx.Client, name: str) -> None:
    path = PATHS.get(name, "excitation.amplitude")
    answer = shipped.post("/v1/scenes/text", json={"scene": name, "set": {path: 150}, "comments": ["a\nb"]})
    assert answer.headers["content-type"].startswith("application/toml")
    assert answer.text.startswith("# a\n# b\n")
    wanted = solver.load_scene(name).with_values({path: 150.0})
    assert solver.Scene.from_dict(tomllib.loads(answer.text)) == wanted
    answered = shipped.post("/v1/scenes/read", json={"text": answer.text})
    if len(answer.text) > MOST_OF_TOML:  # whole matrices: for files, not for a form
        assert f"got {len(answer.text)}" in is_problem(answered, 422)["errors"][0]["detail"]
        return
    read = answered.json()
    assert read["issues"] == []
    assert solver.Scene.from_dict(read["scene"]) == wanted


def test_every_value_of_a_table_can_be_written() -> None:
    raw = {
        "name": "a \"b\" \\ é", "list": [1, 2.5, True, "x"], "empty": {}, "none": [],
        "structure": {"odd key": {"deep": [{"a": 1e-300}]}, "long": [["m" * 40, "n" * 40, "o" * 40]]},
        "contacts": [{"name": "c", "pair": ["a", "b"]}, {"name": "d"}],
    }  # fmt: skip
    assert tomllib.loads(toml_text(raw, ("first", "second"))) == raw


def test_everything_wrong_is_listed_with_its_pointer(shipped: httpx.Client) -> None:
    raw = solver.load_scene("two-dof").to_dict()
    raw["contacts"][0]["mu"] = -1.0
    raw["observe"]["dof"] = "m9"
    read = shipped.post("/v1/scenes/read", json={"text": json.dumps(raw), "form": "json"}).json()
    assert {issue["pointer"] for issue in read["issues"]} == {"/contacts/0/mu", "/observe/dof"}
    assert read["scene"] == raw


@pytest.mark.parametrize(
    ("text", "form", "words"),
    [
        ('name = "x"\nmu = = 3\n', "toml", "line 2"),
        ('{"name": }', "json", "line 1"),
        ("[1]", "json", "must be a table"),
        ("[" * 100_000, "json", ""),
    ],
)
def test_a_text_that_cannot_be_read_says_where(
    shipped: httpx.Client, text: str, form: str, words: str
) -> None:
    answer = shipped.post("/v1/scenes/read", json={"text": text[:15_000], "form": form})
    assert words in is_problem(answer, 400)["detail"]


def test_a_number_that_is_none_is_named_and_stands_there_as_it_was_written(shipped: httpx.Client) -> None:
    read = shipped.post("/v1/scenes/read", json={"text": "x = nan\n[a]\ny = [1.0, -inf]\n"}).json()
    assert read["scene"] == {"x": "NaN", "a": {"y": [1.0, "-Infinity"]}}
    issues = {issue["pointer"]: issue["detail"] for issue in read["issues"]}
    assert issues["/x"] == "`/x` must be a finite number, got NaN"
    assert issues["/a/y/1"] == "`/a/y/1` must be a finite number, got -Infinity"


def test_dates_and_numbers_that_are_none(shipped: httpx.Client) -> None:
    read = shipped.post("/v1/scenes/read", json={"text": "name = 2020-01-01\nx = nan\n"}).json()
    assert {"/x", "/structure"} <= {issue["pointer"] for issue in read["issues"]}


def test_no_file_of_the_server_was_touched(shipped: httpx.Client, tmp_path: Path) -> None:
    """Names with paths name nothing: what they would point at stays as it was."""
    secret = tmp_path / "secret.toml"
    secret.write_text("name = 'secret'")
    for name in (str(secret), f"file://{secret}", f"..{secret}"):
        answer = shipped.post("/v1/plan", json={"scene": name})
        assert answer.status_code == 422
        assert "secret'" not in answer.json()["detail"].replace(str(secret), "")
    assert secret.read_text() == "name = 'secret'"
