"""Text and tables of a scene side by side, templates and the schema, over REST."""

import tomllib

import httpx
import pytest
from service_helpers import is_problem

import solver
from solver.scene.json_schema import scene_schema
from solver.scene.toml import toml_text

MINE = toml_text(solver.load_scene("two-dof").to_dict()).replace("N0 = 100.0", "N0 = 100.0 # mine")


def edit(http: httpx.Client, **body: object) -> dict[str, object]:
    answer = http.post("/v1/scenes/edit", json=body)
    assert answer.status_code == 200, answer.text
    found: dict[str, object] = answer.json()
    return found


def test_a_text_becomes_tables_and_tables_change_the_text(shipped: httpx.Client) -> None:
    read = edit(shipped, text=MINE)
    assert read == {"text": MINE, "scene": tomllib.loads(MINE), "issues": []}
    scene = tomllib.loads(MINE)
    scene["contacts"][0]["mu"] = 0.4
    changed = edit(shipped, text=MINE, scene=scene)
    assert changed["text"] == MINE.replace("mu = 0.3", "mu = 0.4")
    assert changed["scene"] == scene
    anew = edit(shipped, text="", scene={**scene, "speed": None})
    assert tomllib.loads(str(anew["text"])) == scene


def test_what_is_wrong_is_told_with_its_line(shipped: httpx.Client) -> None:
    lines = MINE.replace("mu = 0.3", "mu = -1").replace('dof = "m1"', 'dof = "m9"').splitlines()
    lines.remove(next(line for line in lines if line.startswith("kt")))
    found = edit(shipped, text="\n".join(lines))["issues"]
    assert isinstance(found, list)
    told = {issue["pointer"]: lines[issue["line"] - 1][issue["column"] - 1 :] for issue in found}
    assert told == {
        "/contacts/0/kt": "[[contacts]]",
        "/contacts/0/mu": "mu = -1",
        "/excitation/dof": 'dof = "m9"',
    }


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [
        ('name = "x"\nmu = = 3\n', 2, 6),
        ('a = "x', 1, None),
        (f"a = 1\n{'.'.join('x' * 70)} = 1", 2, None),
        ("", 1, 1),
    ],
)
def test_a_text_that_is_no_toml_tells_its_line(
    shipped: httpx.Client, text: str, line: int, column: int | None
) -> None:
    found = edit(shipped, text=text)
    assert isinstance(found["issues"], list)
    assert (found["issues"][0]["line"], found["issues"][0]["column"]) == (line, column)
    assert (found["scene"] is None) == bool(text)
    assert edit(shipped, text=text, scene={"name": "x"})["text"] == 'name = "x"\n', (
        "tables win over such a text"
    )


def test_templates_ask_and_make_scenes(shipped: httpx.Client) -> None:
    items = shipped.get("/v1/templates").json()["items"]
    names = [one["name"] for one in items]
    assert names == ["ground-damper", "platform-damper", "shroud", "split-ring"]
    for one in items:
        for key, question in one["questions"]["properties"].items():
            assert question["description"], f"{one['name']} asks for {key} without a word"
        made = shipped.post("/v1/templates", json={"template": one["name"]}).json()
        assert edit(shipped, text="", scene=made["scene"])["issues"] == []
        assert made["text"].count("#") > 10
        assert (
            edit(shipped, text=made["text"])["scene"] == edit(shipped, text="", scene=made["scene"])["scene"]
        )
    refused = shipped.post("/v1/templates", json={"template": "shroud", "answers": {"mu": -1, "muu": 2}})
    assert {one["pointer"] for one in is_problem(refused, 422)["errors"]} == {"/answers/muu"}
    refused = shipped.post("/v1/templates", json={"template": "shroud", "answers": {"mu": -1}})
    assert is_problem(refused, 422)["errors"] == [
        {"pointer": "/answers/mu", "detail": "`mu` must be > 0, got -1"}
    ]
    assert is_problem(shipped.post("/v1/templates", json={"template": "x"}), 422)["errors"][0]["pointer"]


def test_the_schema_of_scenes_is_served_and_kept(shipped: httpx.Client) -> None:
    answer = shipped.get("/v1/scenes-schema")
    assert answer.json() == scene_schema()
    tag = {"If-None-Match": answer.headers["etag"]}
    assert shipped.get("/v1/scenes-schema", headers=tag).status_code == 304
