"""The recipe of CONTRIBUTING.md for a kind of job."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import optim
import solver
from service.client.embedded import EmbeddedService
from service.db.models import JobState
from service.jobs.kinds.registry.loading import registry_of
from service.jobs.kinds.registry.table import kinds_table
from service.settings.settings import load_settings

ROOT = Path(__file__).parents[2]


def test_the_recipe_works_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file that CONTRIBUTING.md has for a kind, and the row of the table it promises."""
    recipe = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    [code] = re.findall(r"^```python\n(.*?)^```$", recipe, re.DOTALL | re.MULTILINE)
    (tmp_path / "a_recipe.py").write_text(code, "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    kinds = ("a_recipe:SENSITIVITIES",)
    [row] = re.findall(r"^\+(\| `sensitivities` .*)$", recipe, re.MULTILINE)
    assert row in kinds_table(registry_of(kinds)).splitlines()
    settings = load_settings(database=f"sqlite:///{tmp_path}/jobs.db", workers=1, kinds=kinds)
    with EmbeddedService(settings) as service:
        [example] = registry_of(kinds)["sensitivities"].request.model_json_schema()["examples"]
        job = service.wait(service.submit("sensitivities", example))
        answer = service.results(job.id)
    assert job.status is JobState.SUCCESSFUL, job.error
    wanted = optim.sensitivities(solver.load_scene("two-dof"), harmonics=5).to_json()
    assert answer.result["rows"] == wanted["rows"]
    assert [sweep.peak.value for sweep in answer.sweeps if sweep.peak] == [answer.result["peaks"][0]["value"]]
