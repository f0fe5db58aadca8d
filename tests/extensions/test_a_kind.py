"""A kind of job that lives in this file: registered by a setting, it works everywhere.

Nothing of the package knows it. `stickslip serve` runs in a process of its own, its workers in others; they
find the kind by the setting `kinds`.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import httpx
import numpy as np
import pytest
from jsonschema import Draft202012Validator
from pydantic import BaseModel, ConfigDict, Field

import solver
from service.cli import main
from service.client.client import Client
from service.client.embedded import EmbeddedService
from service.db.models import JobState
from service.errors import ConfigurationError, InvalidRequestError, ServiceProblem
from service.http.app import create_app
from service.jobs.common.scene_requests import FrequencyHz, HarmonicRequest, require, resolve_scene, resolved
from service.jobs.common.sizes import balance_issues
from service.jobs.common.sweep_records import sweep_record
from service.jobs.job_parts import Division, JobPart, PartOutput
from service.jobs.kind_registry import JobKind, KindView, PrintedResult, Resolved, SceneSource
from service.jobs.kinds import SHIPPED
from service.jobs.outputs import JobOutput, OnProgress, ShouldStop
from service.jobs.stored_figures import SweepRecord
from service.queue.core import Service
from service.settings.kinds import registry_of
from service.settings.settings import load_settings
from solver.scene.scene import Scene

ROOT = Path(__file__).parents[2]
ENTRY = "test_a_kind:DISTORTION"
BODY: dict[str, Any] = {"scene": "two-dof", "frequencies_hz": [0.9, 1.2], "harmonics": 5}
MOST = 50

# The kind ------------------------------------------------------------------------------------------------


class DistortionRequest(HarmonicRequest):
    """How much of a response is not in its first harmonic."""

    model_config = ConfigDict(json_schema_extra={"examples": [BODY]})

    frequencies_hz: Annotated[list[FrequencyHz], Field(min_length=1, max_length=MOST)] = Field(
        description="Excitation frequencies [Hz]."
    )
    sweep: bool = Field(default=True, strict=True, description="Store the response between them too.")


class DistortionResult(BaseModel):
    """The distortion at each frequency."""

    frequency_hz: list[float]
    distortion: list[float]
    worst: float


def resolve(request: DistortionRequest, source: SceneSource) -> Resolved:
    scene = resolve_scene(request, source)
    require(balance_issues("/frequencies_hz", scene, request.harmonics, len(request.frequencies_hz)))
    return resolved(
        scene, frequencies_hz=request.frequencies_hz, sweep=request.sweep, harmonics=request.harmonics
    )


def split(spec: Mapping[str, Any]) -> list[JobPart]:
    return [JobPart(spec={"frequency_hz": frequency}) for frequency in spec["frequencies_hz"]]


def run_part(
    spec: Mapping[str, Any], part: Mapping[str, Any], progress: OnProgress, _should_stop: ShouldStop
) -> PartOutput:
    found = distortion(Scene.from_dict(spec["scene"]), part["frequency_hz"], spec["harmonics"])
    progress(1.0, 1)
    return PartOutput(result={"value": found, "process": os.getpid()}, points=1)


def distortion(scene: Scene, frequency_hz: float, harmonics: int) -> float:
    heights = solver.solve(scene, frequency_hz=frequency_hz, harmonics=harmonics).to_json()["harmonics"]
    return float(np.linalg.norm(heights[2:]) / np.linalg.norm(heights[1:]))


def join(spec: Mapping[str, Any], outputs: Mapping[int, PartOutput]) -> JobOutput:
    values = [output.result["value"] for output in outputs.values()]
    ends = (min(spec["frequencies_hz"]), max(spec["frequencies_hz"]))
    sweeps: tuple[SweepRecord, ...] = ()
    if spec["sweep"] and ends[0] < ends[1]:
        scene = Scene.from_dict(spec["scene"])
        sweeps = (
            sweep_record(solver.sweep(scene, start=ends[0], stop=ends[1], harmonics=spec["harmonics"])),
        )
    result = {"frequency_hz": spec["frequencies_hz"], "distortion": values, "worst": max(values)}
    return JobOutput(result=result, sweeps=sweeps)


def tell(result: Mapping[str, Any]) -> PrintedResult:
    found = zip(result["frequency_hz"], result["distortion"], strict=True)
    pairs = [(f"{frequency:g} Hz", f"{100.0 * value:.3f} %") for frequency, value in found]
    return PrintedResult(title="Distortion", pairs=pairs)


def draw(result: Mapping[str, Any], _sweeps: object, _read: object) -> Any:
    from matplotlib.figure import Figure

    page = Figure()
    page.subplots().plot(result["frequency_hz"], result["distortion"])
    return page


PARTS = Division(split=split, run_part=run_part, join=join)
DISTORTION = JobKind(
    name="distortion",
    summary="How much of a response is not in its first harmonic.",
    request=DistortionRequest,
    resolve=resolve,
    run=PARTS.run,
    parts=PARTS,
    result=DistortionResult,
    view=KindView(
        result="the share of the higher harmonics",
        sweeps="the one between the frequencies",
        flags={"frequencies_hz": "--frequency"},
        tell=tell,
        draw=draw,
    ),
)

# The tests -----------------------------------------------------------------------------------------------


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """The command and the tests of this process know the kind as the service does."""
    monkeypatch.setenv("STICKSLIP_KINDS", json.dumps([ENTRY]))


def wanted(*frequencies: float) -> list[float]:
    scene = solver.load_scene("two-dof")
    return [distortion(scene, frequency, 5) for frequency in frequencies]


def test_rest_computes_stores_and_lists_it(url: str) -> None:
    with httpx.Client(base_url=url, timeout=60.0) as http:
        answer = http.post("/v1/jobs", json={"kind": "distortion", **BODY}, headers={"Prefer": "wait=60"})
        assert answer.status_code == 200, answer.text
        job = answer.json()
        assert job["result"]["distortion"] == pytest.approx(wanted(0.9, 1.2), rel=1e-9)
        assert [one["id"] for one in http.get("/v1/jobs?kind=distortion").json()["items"]] == [job["id"]]
        [stored] = http.get(f"/v1/sweeps?job={job['id']}").json()["items"]
        assert (stored["from"], stored["to"], stored["harmonics"]) == (0.9, 1.2, 5)
        again = http.post("/v1/jobs", json={"kind": "distortion", **BODY}).json()
        assert again["result_of"] == job["id"]


@pytest.mark.parametrize(
    ("change", "pointer", "words"),
    [
        ({"frequencies_hz": [1.0, -2.0]}, "/frequencies_hz/1", ["at least 1e-09", "-2.0"]),
        ({"frequencies_hz": []}, "/frequencies_hz", ["at least 1"]),
        ({"frequencies_hz": None}, "/frequencies_hz", ["list", "None"]),
        ({"sweep": "yes"}, "/sweep", ["true or false", "'yes'"]),
        ({"colour": 1}, "/colour", ["known key"]),
        ({"scene": "none"}, "/scene", ["'none'"]),
        ({"kind": "distorsion"}, "/kind", ["distortion", "'distorsion'"]),
    ],
)
def test_a_refusal_names_field_value_and_what_is_right(
    url: str, change: dict[str, Any], pointer: str, words: list[str]
) -> None:
    answer = httpx.post(f"{url}/v1/jobs", json={"kind": "distortion", **BODY, **change}, timeout=60.0)
    assert answer.status_code == 422
    [error] = answer.json()["errors"]
    assert error["pointer"] == pointer
    assert [word for word in words if word not in error["detail"]] == []


def test_the_client_submits_follows_and_reads_it(url: str) -> None:
    with Client(url) as client:
        assert "distortion" in [kind.name for kind in client.kinds()]
        job = client.submit({"kind": "distortion", **BODY, "frequencies_hz": [1.1], "fresh": True})
        assert client.wait(job.id).status is JobState.SUCCESSFUL
        assert client.results(job.id).result["worst"] == pytest.approx(wanted(1.1)[0], rel=1e-9)
        with pytest.raises(ServiceProblem, match="frequencies_hz"):
            client.submit({"kind": "distortion", "scene": "two-dof"})


@pytest.mark.usefixtures("registered")
def test_the_command_submits_prints_and_draws_it(
    url: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STICKSLIP_URL", url)
    words = "submit distortion two-dof --frequency 0.9 --frequency 1.2 --set damper.N0=80 --harmonics 5"
    words += " --no-sweep"
    assert main([*words.split(), "--wait"]) == 0
    scene = solver.load_scene("two-dof").with_values({"damper.N0": 80.0})
    shown = capsys.readouterr().out
    assert "Distortion" in shown
    assert f"{100.0 * distortion(scene, 1.2, 5):.3f} %" in shown
    assert main([*words.split(), "--fresh", "--json"]) == 0
    job = json.loads(capsys.readouterr().out)
    assert job["request"]["fresh"] is True
    assert job["request"]["sweep"] is False
    assert job["result_of"] is None
    assert main(["watch", job["id"]]) == 0
    assert main(["results", job["id"], "--plot", str(tmp_path / "one.png")]) == 0
    assert (tmp_path / "one.png").read_bytes().startswith(b"\x89PNG")
    assert main(["submit", "distortion", "two-dof", "--frequency", "inf"]) == 2
    assert "--frequency" in capsys.readouterr().err


@pytest.mark.usefixtures("registered")
def test_the_command_says_what_it_takes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["submit", "--help"]) == 0
    assert f"distortion {DISTORTION.summary}" in " ".join(capsys.readouterr().out.split())
    assert main(["submit", "distortion", "--help"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    for words in (
        "--frequency X Excitation frequencies [Hz]. Repeatable. [required]",
        "--no-sweep",
        "--wait",
    ):
        assert words in shown
    assert main(["schema", "job"]) == 0
    kinds = json.loads(capsys.readouterr().out)["oneOf"]
    assert "distortion" in [kind["properties"]["kind"]["const"] for kind in kinds]


def test_the_command_prints_what_it_does_not_know(
    url: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A client of a service with kinds that its own machine has not."""
    with Client(url) as client:
        job = client.wait(client.submit({"kind": "distortion", **BODY}).id)
    monkeypatch.setenv("STICKSLIP_URL", url)
    assert main(["results", job.id]) == 0
    shown = capsys.readouterr().out
    assert re.search(rf"worst\s+{max(wanted(0.9, 1.2)):.4g}", shown)


def test_the_description_of_the_api_has_body_and_result(url: str) -> None:
    with httpx.Client(base_url=url, timeout=60.0) as http:
        described = http.get("/openapi.json").json()
        content = described["paths"]["/v1/jobs"]["post"]["requestBody"]["content"]["application/json"]
        [mine] = [
            one for one in content["schema"]["oneOf"] if one["properties"]["kind"]["const"] == "distortion"
        ]
        assert mine["properties"]["frequencies_hz"]["maxItems"] == MOST
        assert mine["required"] == ["kind", "scene", "frequencies_hz"]
        assert content["examples"]["distortion"]["value"] == {"kind": "distortion", **BODY}
        result = described["components"]["schemas"]["DistortionResult"]
        assert set(result["properties"]) == {"frequency_hz", "distortion", "worst"}
        choices = described["components"]["schemas"]["ResultsAnswer"]["properties"]["result"]["anyOf"]
        assert {"$ref": "#/components/schemas/DistortionResult"} in choices
        assert http.get("/docs").text.count("distortion") > 1


def test_every_kind_is_listed_with_its_schemas(url: str) -> None:
    kinds = {one["name"]: one for one in httpx.get(f"{url}/v1/kinds", timeout=60.0).json()["items"]}
    assert list(kinds) == [*(kind.name for kind in SHIPPED), "distortion"]
    mine = kinds["distortion"]
    assert mine["summary"] == DISTORTION.summary
    assert mine["body"]["properties"]["kind"]["const"] == "distortion"
    assert set(mine["result"]["properties"]) == {"frequency_hz", "distortion", "worst"}
    for kind in kinds.values():
        for example in kind["body"]["examples"]:
            Draft202012Validator(kind["body"]).validate(example)


def test_the_check_of_the_documentation_sees_it() -> None:
    from docs_tables import tables_of_kinds, with_tables  # a service that takes this kind has no docs

    registry = registry_of([ENTRY])
    page = (ROOT / "docs" / "service.md").read_text("utf-8")
    assert with_tables(page, tables_of_kinds(SHIPPED)) == page
    longer = with_tables(page, tables_of_kinds(registry))
    row = (
        "| `distortion` | **`frequencies_hz`**, `sweep` | the share of the higher harmonics | the one between"
    )
    assert row in longer
    assert "| `map`, `mistuning`, `distortion` | computes the parts that are missing" in longer


@pytest.mark.long
def test_an_embedded_service_has_it_and_one_without_it_keeps_what_was_stored(tmp_path: Path) -> None:
    database = {"database": f"sqlite:///{tmp_path}/jobs.db", "workers": 1}
    with EmbeddedService(load_settings(**database, kinds=(ENTRY,))) as service:
        job = service.submit("distortion", BODY)
        assert service.wait(job).status is JobState.SUCCESSFUL
        known = service.results(job).result
    with EmbeddedService(load_settings(**database)) as service:
        assert service.results(job).result == known
        assert service.job(job).kind == "distortion"
        with pytest.raises(InvalidRequestError, match="`kind` must be one of sweep"):
            service.submit("distortion", BODY)


@pytest.mark.long
def test_a_service_without_the_kind_fails_its_jobs_and_says_why(tmp_path: Path) -> None:
    database = {"database": f"sqlite:///{tmp_path}/jobs.db", "workers": 1}
    waiting = Service(load_settings(**database, kinds=(ENTRY,)))
    waiting.open()
    row, _ = waiting.submit({"kind": "distortion", **BODY})
    waiting.database.close()
    with EmbeddedService(load_settings(**database)) as service:
        ended = service.wait(row.id, timeout=60.0)
    assert ended.status is JobState.FAILED
    assert ended.error is not None
    assert "STICKSLIP_KINDS" in ended.error["detail"]


NOT_A_KIND = {"name": "none"}
TAKEN = [JobKind(name="sweep", summary="", request=DistortionRequest, resolve=resolve, run=PARTS.run)]


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("no_such_module:KIND", ["no_such_module", "cannot be imported"]),
        ("test_a_kind:MISSING", ["MISSING"]),
        ("test_a_kind:NOT_A_KIND", ["JobKind", "dict"]),
        ("test_a_kind:TAKEN", ["'sweep'", "the service itself"]),
        ("test_a_kind", ["module:NAME", "'test_a_kind'"]),
        ("os.system('true'):x", ["module:NAME"]),
    ],
)
def test_a_wrong_entry_is_refused_when_the_service_starts(
    entry: str, words: list[str], tmp_path: Path
) -> None:
    settings = load_settings(database=f"sqlite:///{tmp_path}/jobs.db", kinds=(entry,))
    with pytest.raises(ConfigurationError) as refused:
        create_app(settings)
    assert [word for word in words if word not in str(refused.value)] == []


@pytest.mark.parametrize("name", ["", "Sweep", "a b", "1st", "x" * 33])
def test_a_kind_has_a_name_that_fits(name: str) -> None:
    with pytest.raises(ValueError, match="small letters"):
        JobKind(name=name, summary="", request=DistortionRequest, resolve=resolve, run=PARTS.run)
