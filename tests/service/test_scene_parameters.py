"""What the service says of the parameters of a scene is what the solver takes."""

from __future__ import annotations

import httpx
import pytest

import solver
from service.jobs.names import there


@pytest.mark.parametrize("name", ["two-dof", "bladed-disk", "platform-wedge", "shroud-3d"])
def test_every_parameter_can_be_set_within_its_slider(shipped: httpx.Client, name: str) -> None:
    scene = solver.load_scene(name)
    items = shipped.post("/v1/scenes/parameters", json={"scene": name}).json()["items"]
    assert items
    parts = {*(part.name for part in (*scene.contacts, *scene.dampers, *scene.bodies, *scene.loads)), "speed"}
    told = {item["path"]: item for item in items}
    of_parts = {path for path in scene.parameter_paths() if path.split(".")[0] in parts}
    assert set(told) == of_parts | {"excitation.amplitude"}
    for path, item in told.items():
        assert item["value"] == scene.value(path)
        assert item["part"] == path.split(".")[0]
        if item["slider"] is None:
            continue
        low, high = item["slider"]["low"], item["slider"]["high"]
        assert low < high
        assert item["value"] == 0.0 or low <= item["value"] <= high
        assert scene.with_values({path: high}).value(path) == pytest.approx(high)


def test_values_that_are_set_are_those_told(shipped: httpx.Client) -> None:
    asked = {"scene": "platform-wedge", "set": {"wedge.mass": 0.008}}
    items = {one["path"]: one for one in shipped.post("/v1/scenes/parameters", json=asked).json()["items"]}
    assert items["wedge.mass"]["value"] == 0.008
    assert items["wedge.mass"]["unit"] == "kg"
    assert items["wedge.mass"]["slider"]["logarithmic"]


@pytest.mark.parametrize(("name", "path"), [("platform-wedge", "wedge.mass"), ("shroud-3d", "shroud.N0")])
def test_what_presses_a_damper_is_offered_first_and_its_geometry_last(
    shipped: httpx.Client, name: str, path: str
) -> None:
    items = shipped.post("/v1/scenes/parameters", json={"scene": name}).json()["items"]
    offered = [item["path"] for item in items if item["bounds"] and item["part"] == path.split(".")[0]]
    assert offered[0] == path
    assert {one.split(".")[1] for one in offered[-2:]} <= {"angle", "width", "length"}


def test_a_scene_that_is_not_there_is_refused(shipped: httpx.Client) -> None:
    refused = shipped.post("/v1/scenes/parameters", json={"scene": "nowhere"})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/scene"


@pytest.mark.few(keep=("two-dof", "platform-wedge"))
@pytest.mark.parametrize("name", solver.shipped_scenes())
def test_a_study_is_taken_as_it_is_proposed(shipped: httpx.Client, name: str) -> None:
    """Every proposal goes through the checks of a job; what is refused is refused there too."""
    told = shipped.post("/v1/scenes/parameters", json={"scene": name}).json()
    scene = solver.load_scene(name)
    contacts = {contact.name for contact in scene.contacts}
    assert {one for joint in told["joints"] for one in joint["contacts"]} == contacts
    designed = {one["path"]: one["bounds"] for one in told["items"] if one["bounds"]}
    assert designed
    path, bounds = next(iter(designed.items()))
    assert 0.0 <= bounds[0] < bounds[1]
    measured = {"frequency": list(scene.observe.band), "amplitude": [1.0, 1.0]}
    further: dict[str, dict[str, object]] = {
        "identify": {"data": [measured]}, "posterior": {"data": [measured]},
    }  # fmt: skip
    assert {one["kind"] for one in told["studies"]} == set(there())
    for study in told["studies"]:
        assert study["title"].endswith("?")
        assert study["group"] in ("damper", "life", "engine", "rig", "checks")
        assert study["points"] is not None or study["kind"] in further
        assert set(study["assumed"]) <= set(study["body"])
        if study["refused"] is not None:
            assert study["body"] == {}
            continue
        shares = {key: 1e-3 * share for key, share in study["of_peak"].items()}
        body = {"kind": study["kind"], "scene": name, **study["body"], **shares}
        answer = shipped.post("/v1/jobs", json={**body, **further.get(study["kind"], {})})
        assert answer.is_success, (study, answer.text)
        shipped.delete(f"/v1/jobs/{answer.json()['id']}")
        if "variables" in study["body"]:
            # Of a damper that lifts off, a front is proposed of the heavy ones.
            least = (
                1.5 * scene.value(path) if path.endswith(".mass") and study["kind"] == "pareto" else bounds[0]
            )
            assert study["body"]["variables"] == {path: [least, bounds[1]]}


def test_a_map_follows_ridges_where_every_law_lets_it(shipped: httpx.Client) -> None:
    scene = solver.load_scene("two-dof").to_dict()
    gap = {"law": "gap", "k": 50.0, "gap": 0.5}
    smooth = {"law": "dahl", "sigma": 30.0, "limit": 30.0}
    for law, tracked in ((gap, True), (smooth, False)):
        further = {"name": "stop", "between": ["m1", "ground"], **law}
        contacts = [*scene["contacts"], further]
        told = shipped.post("/v1/scenes/parameters", json={"scene": {**scene, "contacts": contacts}}).json()
        [study] = [one for one in told["studies"] if one["kind"] == "map"]
        assert study["body"]["ridge"] is tracked
