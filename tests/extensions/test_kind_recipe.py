"""The recipe of CONTRIBUTING.md for a study."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest
from docs_tables import kinds_table

import solver
from service.cli import main
from service.client.embedded import EmbeddedService
from service.db.models import JobState
from service.errors import InvalidRequestError
from service.settings.kinds import registry_of
from service.settings.settings import load_settings
from solver.linear.natural_frequencies import natural_frequencies

ROOT = Path(__file__).parents[2]
KINDS = ("a_recipe:Frequencies",)


@pytest.fixture
def recipe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The text of the recipe; its file can be imported."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    [code] = re.findall(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    (tmp_path / "a_recipe.py").write_text(code, "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "a_recipe", raising=False)  # that of another test
    assert len(code.splitlines()) <= 120
    return text


def wanted(*, stuck: bool) -> list[float]:
    return [f for f in natural_frequencies(solver.load_scene("two-dof"), stuck=stuck).tolist() if f <= 2.0]


def test_the_service_takes_it_as_it_stands(recipe: str, tmp_path: Path) -> None:
    [row] = re.findall(r"^\+(\| `frequencies` .*)$", recipe, re.MULTILINE)
    assert row in kinds_table(registry_of(KINDS)).splitlines()
    settings = load_settings(database=f"sqlite:///{tmp_path}/jobs.db", workers=1, kinds=KINDS)
    with EmbeddedService(settings) as service:
        [example] = registry_of(KINDS)["frequencies"].request.model_json_schema()["examples"]
        job = service.wait(service.submit("frequencies", example))
        answer = service.results(job.id)
        with pytest.raises(InvalidRequestError, match="up_to_hz"):
            service.submit("frequencies", {**example, "up_to_hz": -1})
    assert job.status is JobState.SUCCESSFUL, job.error
    assert answer.result == {"stuck_hz": wanted(stuck=True), "open_hz": wanted(stuck=False)}


def test_a_number_of_its_result_is_a_filter(recipe: str, tmp_path: Path) -> None:
    study = tmp_path / "a_recipe.py"
    lines = recipe.partition("## Add a filter")[2].split("```")[1].splitlines()[3:]
    changes = re.findall(r"^-(.*)\n((?:\+.*(?:\n|$))+)", "\n".join(lines), re.MULTILINE)
    assert len(changes) == 2
    for old, new in changes:
        text = study.read_text("utf-8")
        assert text.count(f"{old}\n") == 1
        study.write_text(text.replace(old, re.sub(r"^\+", "", new, flags=re.MULTILINE).rstrip("\n")), "utf-8")
    settings = load_settings(database=f"sqlite:///{tmp_path}/jobs.db", workers=1, kinds=KINDS)
    lowest = natural_frequencies(solver.load_scene("two-dof"), stuck=False)[0]
    with EmbeddedService(settings) as service:
        job = service.wait(service.submit("frequencies", {"scene": "two-dof"}))
        assert job.status is JobState.SUCCESSFUL, job.error
        found = service.stored("frequencies", lowest_hz_max=1.01 * lowest, sort="lowest_hz")
        assert [one.id for one in found] == [job.id]
        assert list(service.stored("frequencies", lowest_hz_max=0.99 * lowest)) == []


@pytest.mark.usefixtures("recipe")
def test_the_command_has_it(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("STICKSLIP_KINDS", json.dumps(KINDS))
    assert main(["frequencies", "two-dof", "--up-to", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "stuck_hz": wanted(stuck=True), "open_hz": wanted(stuck=False)
    }  # fmt: skip
    assert main(["frequencies", "two-dof", "--up-to", "2"]) == 0
    assert "stuck_hz" in capsys.readouterr().out
    assert main(["frequencies", "--help"]) == 0
    assert "--up-to HZ" in capsys.readouterr().out
    assert main(["--help"]) == 0
    assert "List natural frequencies" in capsys.readouterr().out
