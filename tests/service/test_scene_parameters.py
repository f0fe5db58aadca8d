"""What the service says of the parameters of a scene is what the solver takes."""

from __future__ import annotations

import httpx
import pytest

import solver


@pytest.mark.parametrize("name", ["two-dof", "bladed-disk", "platform-wedge", "shroud-3d"])
def test_every_parameter_can_be_set_within_its_slider(shipped: httpx.Client, name: str) -> None:
    scene = solver.load_scene(name)
    items = shipped.post("/v1/scenes/parameters", json={"scene": name}).json()["items"]
    assert items
    parts = {*(part.name for part in (*scene.contacts, *scene.dampers, *scene.bodies, *scene.loads)), "speed"}
    told = {item["path"]: item for item in items}
    assert set(told) == {path for path in scene.parameter_paths() if path.split(".")[0] in parts}
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


def test_a_scene_that_is_not_there_is_refused(shipped: httpx.Client) -> None:
    refused = shipped.post("/v1/scenes/parameters", json={"scene": "nowhere"})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/scene"
