"""The description of a design problem: every key, what is wrong with it, and where that is told."""

import inspect
import json
import math
from pathlib import Path
from typing import Any

import httpx
import pytest
from service_helpers import Shipped, is_problem, job_ids

import optim
import solver
from optim.problem.design_problem import Method, pose
from service.cli import main
from service.errors import InvalidRequestError
from service.jobs.common.problem_requests import arguments
from service.jobs.kind_registry import ABOUT_THE_RUN
from service.jobs.strict_json import validated
from service.jobs.studies.design_study import Design
from service.jobs.studies.pareto_study import Pareto
from service.jobs.study import resolve
from solver.errors import Issue
from solver.scene.validation import cross_issues

VARIABLES = {"damper.N0": [20, 1000]}
STRESSED = solver.load_scene("bladed-disk").to_dict() | {
    "recovery": [{"name": "fillet", "unit": "MPa", "terms": {"tip": 1e6}, "material": "steel"}],
    "materials": [{"name": "steel", "fatigue_strength": 3e8, "ultimate_strength": 9e8}],
}
OF_BODIES = {"max_mass"}  # a key that this scene cannot take
EVERY_KEY: dict[str, Any] = {
    "scene": STRESSED,
    "set": {"shroud.mu": 0.25},
    "variables": {"shroud.N0,root.N0": [20, 3000], "shroud.kt": [1e6, 1e7]},
    "scaling": {"shroud.kt": "linear"},
    "cases": [
        {"name": "first"},
        {"name": "twice", "set": {"excitation.amplitude": 100}, "band": [600, 800], "weight": 0.5},
        {"observe": ["tip", "middle"], "engine_order": 2, "order": 3},
    ],
    "limit": 8e-5,
    "weights": {"peak": 1, "band": 1e-6},
    "max_peak": 2e-4,
    "max_band_hz": 60,
    "max_stress": {"fillet": 2e8},
    "min_margin": 1.5,
    "running_rpm": [[36000, 37000], 40000],
    "max_running_amplitude": 1e-4,
    "max_wear_rate": 1e-12,
    "wear_coefficient": {"shroud": 1e-13, "root": 1e-13},
    "worn": {
        "hours": 20,
        "coefficient": {"shroud": 1e-14},
        "area": {"shroud": 1e-4},
        "most": 1e-3,
        "load_loss_per_depth": {"shroud": 1e6},
    },
    "min_damping": {"ratio": 0.001, "amplitude": 1e-6},
    "quality_factor": {"most": 500, "amplitude": 1e-6},
    "forbidden_hz": [[520, 560], [880, 890]],
    "speeds_rpm": [[36000, 37000]],
    "max_friction_work": {"shroud": 0.02},
    "contact_states": {"shroud": "never-separates"},
    "harmonics": 5,
    "start": {"shroud.N0,root.N0": 200, "shroud.kt": 5e6},
    "method": "minimax",
    "basins": 3,
}
NO_KEYS = {"limits", "on_best", "scene", "on_progress", "should_stop"}


def pointers(change: dict[str, Any]) -> list[str]:
    body = {"scene": "two-dof", "variables": VARIABLES, **change}
    with pytest.raises(InvalidRequestError) as caught:
        resolve(validated(Design, body), Shipped())
    assert all(len(issue.said()) > 20 for issue in caught.value.issues)
    return [issue.pointer for issue in caught.value.issues]


def test_every_key_of_the_design_layer_is_one_of_the_body_and_arrives() -> None:
    keys = set(inspect.signature(optim.design).parameters) - NO_KEYS - {"tolerance"} - OF_BODIES
    assert keys == set(EVERY_KEY) - {"scene", "set"}, "a key of the design layer that the service lacks"
    assert keys <= set(Design.model_fields)
    assert Design.model_json_schema()["examples"]
    spec = resolve(validated(Design, EVERY_KEY), Shipped()).spec
    assert {key: spec[key] for key in keys} == {key: EVERY_KEY[key] for key in keys}
    scene = solver.Scene.from_dict(spec["scene"])
    assert scene.value("shroud.mu") == 0.25
    problem = pose(scene, **Design.asked(spec)[1])
    assert [case.name for case in problem.cases] == ["first", "twice", "case 3, tip", "case 3, middle"]


def test_the_key_of_a_performance_curve_arrives() -> None:
    body = {"scene": "two-dof", "method": "performance-curve", "tolerance": 0.02}
    spec = resolve(validated(Design, body), Shipped()).spec
    problem = pose(solver.Scene.from_dict(spec["scene"]), **Design.asked(spec)[1])
    assert (problem.method.value, problem.tolerance) == ("performance-curve", 0.02)
    assert pointers({"tolerance": 0.02}) == ["/tolerance"]


def test_the_example_of_the_reference_is_one() -> None:
    [example] = Design.model_json_schema()["examples"]
    assert resolve(validated(Design, example), Shipped()).scene_name == "bladed-disk"


def test_the_methods_are_those_of_the_design_layer() -> None:
    for method in Method:
        assert arguments(validated(Design, {"scene": "two-dof", "method": method.value}))["method"]


def test_a_spec_of_the_first_version_is_still_a_problem() -> None:
    spec = {
        "scene": solver.load_scene("two-dof").to_dict(),
        "variables": VARIABLES,
        "limit": None,
        "max_band_hz": None,
        "harmonics": 5,
        "start": None,
    }
    assert Design.asked(spec)[1] == {"variables": VARIABLES, "harmonics": 5}


def test_a_problem_is_checked_once_by_one_version(monkeypatch: pytest.MonkeyPatch) -> None:
    checks: list[object] = []

    def counted(raw: dict[str, Any]) -> list[Issue]:
        checks.append(raw)
        return cross_issues(raw)

    monkeypatch.setattr("solver.scene.scene.cross_issues", counted)
    tables = solver.load_scene("two-dof").to_dict()
    checks.clear()
    spec = resolve(validated(Design, {"scene": tables, "variables": VARIABLES}), Shipped()).spec
    assert len(checks) == 1
    scene, asked = Design.asked(spec)
    assert (len(checks), scene, asked["variables"]) == (1, solver.Scene.from_dict(tables), VARIABLES)


def test_what_another_version_checked_is_checked_again() -> None:
    spec = resolve(validated(Design, {"scene": "two-dof", "variables": VARIABLES}), Shipped()).spec
    spec["checked_by"] = "0.0.1"
    assert Design.asked(spec)[0] == solver.load_scene("two-dof")
    spec["scene"]["observe"]["dof"] = "nowhere"
    with pytest.raises(solver.SceneError, match="submit the job again") as caught:
        Design.asked(spec)
    assert [issue.pointer for issue in caught.value.issues] == ["/scene", "/scene/observe/dof"]


@pytest.mark.parametrize("version", [None, "0.0.1"])
def test_what_does_not_fit_this_version_is_refused(version: str | None) -> None:
    spec = resolve(validated(Design, {"scene": "two-dof", "variables": VARIABLES}), Shipped()).spec
    spec |= {} if version is None else {"checked_by": version}
    with pytest.raises(solver.SettingError, match="`colour` is no key of this version: submit the job again"):
        Design.asked({**spec, "colour": "red"})
    spec["scene"]["structure"]["colour"] = "red"
    with pytest.raises(solver.SceneError, match="`colour` = 'red' is not a key"):
        Design.asked(spec)


def test_a_number_that_is_none_is_told_where_it_is() -> None:
    assert pointers({"variables": {"damper.N0": [1, math.nan]}}) == ["/variables/damper.N0/1"]


def test_a_scene_without_friction_has_nothing_to_choose_by_itself() -> None:
    raw = solver.load_scene("two-dof").to_dict()
    raw["contacts"] = []
    assert pointers({"scene": raw, "variables": None}) == ["/variables"]


def test_a_front_has_the_keys_of_a_design_but_its_own() -> None:
    theirs = set(inspect.signature(optim.pareto_front).parameters) - NO_KEYS
    keys = set(Pareto.model_fields)
    assert theirs == keys - {"scene", "set", "fresh", "priority", "max_seconds", *ABOUT_THE_RUN}
    body = {**EVERY_KEY, "points": 5}
    for key in ("weights", "max_band_hz", "basins"):
        with pytest.raises(InvalidRequestError, match="is not a known key") as caught:
            validated(Pareto, body)
        assert f"/{key}" in [issue.pointer for issue in caught.value.issues]
        del body[key]
    spec = resolve(validated(Pareto, body), Shipped()).spec
    assert theirs - OF_BODIES == spec.keys() - {"scene", "checked_by"}


@pytest.mark.long
def test_a_front_over_rest_is_that_of_python(shipped: httpx.Client) -> None:
    keys = {"variables": {"damper.N0": [20, 1000]}, "limit": 1.5, "points": 4, "harmonics": 3}
    body = {"kind": "pareto", "scene": "two-dof", **keys}
    job = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
    found = optim.pareto_front(solver.load_scene("two-dof"), **keys)
    assert (job["status"] == "successful") == found.reached, job["error"]
    assert len(job["result"]["points"]) == len(found.points) >= 2
    for there, here in zip(job["result"]["points"], found.points, strict=True):
        assert (there["peak"], there["band_hz"]) == pytest.approx((here.peak, here.band_hz), rel=1e-9)
    assert len(job["sweeps"]) == len(found.points)
    problem = is_problem(shipped.post("/v1/jobs", json={**body, "points": 2, "max_band_hz": 1}), 422)
    assert {entry["pointer"] for entry in problem["errors"]} == {"/points", "/max_band_hz"}


def test_too_many_uncertain_disks_are_told() -> None:
    assert pointers({"uncertain": [{"damper.mu": 0.1}] * 3000}) == ["/uncertain"]


def test_every_argument_of_a_robust_design_is_a_key() -> None:
    keys = set(inspect.signature(optim.robust_design).parameters) - NO_KEYS
    assert keys <= set(Design.model_fields)


@pytest.mark.long
def test_a_robust_design_over_rest_is_that_of_python_and_is_stored(shipped: httpx.Client) -> None:
    keys = {
        "variables": {"damper.N0": [60, 200]}, "uncertain": {"damper.mu": [0.25, 0.35]}, "samples": 4,
        "harmonics": 3,
    }  # fmt: skip
    answer = shipped.post("/v1/designs", json={"scene": "two-dof", **keys}, headers={"Prefer": "wait=60"})
    job = answer.json()
    assert (answer.status_code, job["status"]) == (200, "successful"), job
    found = optim.robust_design(solver.load_scene("two-dof"), **keys)
    assert job["result"]["optimum"]["damper.N0"] == pytest.approx(found.optimum["damper.N0"], rel=1e-12)
    stored = shipped.get(job["links"]["design"]).json()
    assert stored["robust"]
    assert stored["feasible"]
    assert stored["peak"]["value"] == pytest.approx(found.robust.worst_peak, rel=1e-12)
    assert stored["variables"]["damper.N0"]["value"] == job["result"]["optimum"]["damper.N0"]
    assert stored["id"] in [one["id"] for one in shipped.get("/v1/designs?robust=true").json()["items"]]


def test_over_http_nothing_is_written_of_what_is_refused(shipped: httpx.Client) -> None:
    before = job_ids(shipped)
    body = {"scene": "two-dof", "cases": [{"band": [5, 1]}], "max_friction_work": {"bumper": 1}}
    problem = is_problem(shipped.post("/v1/designs", json=body), 422)
    assert [entry["pointer"] for entry in problem["errors"]] == ["/cases/0/band", "/max_friction_work/bumper"]
    assert "low < high" in problem["errors"][0]["detail"]
    assert job_ids(shipped) == before


OPTIONS: dict[str, Any] = {"soft": {"damper.kt": 15}, "stiff": {"damper.kt": 45}}


def test_a_catalogue_is_a_key_and_what_is_wrong_with_it_is_told_where_it_is() -> None:
    assert pointers({"options": {"soft": {"damper.kt": 15}, "odd": {"damper.k": 1}}}) == ["/options/odd"]
    assert pointers({"options": {"x": {"damper.N0": 100}}}) == ["/options/x/damper.N0"]
    assert pointers({"options": {}}) == ["/options"]
    assert pointers({"options": OPTIONS, "uncertain": {"damper.mu": [0.2, 0.4]}}) == ["/options"]
    assert pointers({"variables": {}}) == ["/variables"]
    body = {"scene": "two-dof", "variables": {}, "options": OPTIONS, "harmonics": 3}
    spec = resolve(validated(Design, body), Shipped()).spec
    assert (spec["variables"], spec["options"]) == ({}, OPTIONS)


def test_a_catalogue_of_a_problem_file_is_that_of_python(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    problem = {"scene": "two-dof", "variables": {}, "options": OPTIONS, "harmonics": 3}
    (tmp_path / "catalogue.json").write_text(json.dumps(problem))
    assert main(["design", "--problem", str(tmp_path / "catalogue.json"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    found = optim.catalogue(solver.load_scene("two-dof"), OPTIONS, variables={}, harmonics=3)
    assert found.best is not None
    assert told["optimum"] == OPTIONS[found.best.name]
    assert [one["name"] for one in told["options"]] == [one.name for one in found.options]
    assert told["options"][0]["objective"] == pytest.approx(told["peak"]["value"], rel=1e-12)
    assert told["objective"] == pytest.approx(found.best.objective, rel=1e-12)
    assert main(["design", "--problem", str(tmp_path / "catalogue.json")]) == 0
    words = capsys.readouterr().out
    assert "It keeps all limits." in words
    assert "stiff" in words
