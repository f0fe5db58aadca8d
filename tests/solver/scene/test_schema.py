"""The schemas editors use: what is right passes, what people get wrong does not."""

from __future__ import annotations

import copy
import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from each import each
from jsonschema import Draft202012Validator

import solver
from service.cli import main
from service.cli.commands.scene_commands import Described, schema_of
from solver.scene.toml import load_raw

ROOT = Path(__file__).resolve().parent.parent.parent.parent
SCHEMAS = {what: Draft202012Validator(schema_of(what)) for what in Described}
SCENE = SCHEMAS[Described.SCENE]
BLOCKS = [
    tomllib.loads(block)
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    for block in re.findall(r"^```toml\n(.*?)^```$", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
]


@pytest.mark.parametrize("what", Described)
def test_it_is_a_schema_of_the_dialect_it_names(what: Described, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", what.value]) == 0
    printed = json.loads(capsys.readouterr().out)
    Draft202012Validator.check_schema(printed)
    assert printed == schema_of(what)
    assert printed["$schema"] == Draft202012Validator.META_SCHEMA["$id"]
    assert "null" not in json.dumps(printed)


@pytest.mark.parametrize("name", solver.shipped_scenes())
def test_shipped_scenes_pass(name: str) -> None:
    assert list(SCENE.iter_errors(load_raw(name))) == []


def test_numbers_may_have_a_unit() -> None:
    raw = copy.deepcopy(load_raw("platform-wedge"))
    wedge = raw["dampers"][0]  # type: ignore[index]
    wedge.update(angle="20.05 deg", kt="20 N/µm", mass="4 g")
    raw["observe"].update(band=["0.3 kHz", 420.0])  # type: ignore[attr-defined]
    assert [error.message for error in SCENE.iter_errors(raw)] == []
    assert solver.Scene.from_dict(raw).dampers[0].mass == pytest.approx(0.004)
    wedge.update(mass="4 mm")
    assert [error.json_path for error in SCENE.iter_errors(raw)]


@pytest.mark.parametrize("block", [b for b in BLOCKS if {"structure", "excitation"} <= set(b)])
def test_the_scenes_of_the_pages_pass(block: dict[str, Any]) -> None:
    assert [error.message for error in SCENE.iter_errors(block)] == []


def test_parts_of_scenes_on_the_pages_pass() -> None:
    """A page that shows one table of a scene shows one that fits."""
    shown = [
        (key, b[key])
        for b in BLOCKS
        for key in ("contacts", "observe", "dampers")
        if key in b and "name" not in b
    ]
    assert shown
    for key, value in shown:
        part = {**SCENE.schema["properties"][key], "$defs": SCENE.schema["$defs"]}
        assert [error.message for error in Draft202012Validator(part).iter_errors(value)] == []


def test_the_shipped_problem_passes() -> None:
    problem = tomllib.loads((ROOT / "docs" / "problem.toml").read_text("utf-8"))
    assert [error.message for error in SCHEMAS[Described.PROBLEM].iter_errors(problem)] == []
    job = {"kind": "design", **problem}
    assert [error.message for error in SCHEMAS[Described.JOB].iter_errors(job)] == []
    assert not SCHEMAS[Described.JOB].is_valid({**job, "kind": "desing"})
    assert not SCHEMAS[Described.PROBLEM].is_valid({**problem, "max_band": 60})


Change = Callable[[dict[str, Any]], object]
MISTAKES: dict[str, Change] = {
    "unknown key": lambda s: s.update(excitations=s["excitation"]),
    "unknown key of a contact": lambda s: s["contacts"][0].update(n0=3.0),
    "no structure": lambda s: s.pop("structure"),
    "kind": lambda s: s["structure"].update(kind="lumpy"),
    "sectors of a lumped structure": lambda s: s["structure"].update(kind="lumped"),
    "negative mass": lambda s: s["structure"]["masses"].update(tip=-0.02),
    "text for a number": lambda s: s["contacts"][0].update(kt="5.53e6 N/s"),
    "negative friction": lambda s: s["contacts"][0].update(mu=-0.3),
    "no friction coefficient": lambda s: s["contacts"][0].pop("mu"),
    "one end": lambda s: s["contacts"][0].update(between=["tip"]),
    "three ends": lambda s: s["contacts"][0].update(between=["tip", "tip", "tip"]),
    "N1 twice": lambda s: s["contacts"][0].update(N1=3.0, N1_ratio=0.3),
    "law": lambda s: s["contacts"][0].update(law="Coulomb"),
    "key of another law": lambda s: s["contacts"][0].update(gap=0.1),
    "band": lambda s: s["observe"].update(band=900.0),
    "band of one": lambda s: s["observe"].update(band=[500.0]),
    "no force": lambda s: s.update(excitation=[]),
    "pattern": lambda s: s["excitation"].update(pattern="traveling"),
    "engine order": lambda s: s["excitation"].update(engine_order=1.5),
    "name": lambda s: s.update(name="my scene"),
}


@each("mistake", MISTAKES)
def test_what_people_get_wrong_does_not_pass(mistake: str) -> None:
    raw = copy.deepcopy(load_raw("bladed-disk"))
    raw["contacts"][0].pop("N1_ratio", None)  # type: ignore[index]
    assert SCENE.is_valid(raw)
    MISTAKES[mistake](raw)
    assert not SCENE.is_valid(raw)
    with pytest.raises(solver.SceneError):
        solver.Scene.from_dict(raw)


def test_every_key_is_described() -> None:
    schema = schema_of(Described.SCENE)
    tables = {"scene": schema, **schema["$defs"]}
    bare = [
        f"{name}.{key}"
        for name, table in tables.items()
        for key, given in table["properties"].items()
        if not given.get("description")
    ]
    assert bare == []
    assert "[N/m]" in schema["$defs"]["Contact"]["properties"]["kt"]["description"]
    assert schema["$defs"]["Contact"]["properties"]["N1_phase"]["default"] == 0.0


def test_another_word_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "contact"]) == 2
    assert "scene, problem, job, got 'contact'" in capsys.readouterr().err
