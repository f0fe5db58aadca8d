"""The kinds that compute many responses: map, peaks, accuracy, campbell and mistuning, over REST."""

from typing import Any

import httpx
import pytest
from service_helpers import is_problem, job_ids, until

import optim
import solver

WAIT = {"Prefer": "wait=60"}
RANGE: dict[str, Any] = {"scene": "two-dof", "parameter": "damper.N0", "from": 60, "to": 160, "harmonics": 3}
MAP: dict[str, Any] = {**RANGE, "kind": "map", "steps": 5, "frequencies": 20}
PEAKS: dict[str, Any] = {**RANGE, "kind": "peaks"}
ACCURACY: dict[str, Any] = {"kind": "accuracy", "scene": "two-dof"}
CAMPBELL: dict[str, Any] = {"kind": "campbell", "scene": "two-dof", "speeds_rpm": [[60, 100]], "harmonics": 3}
DISK: dict[str, Any] = dict(solver.load_scene("bladed-disk").to_dict())
DISK["structure"] = {**DISK["structure"], "sectors": 3}
MISTUNING: dict[str, Any] = {
    "kind": "mistuning", "scene": DISK, "of": ["tip_middle", "tip"], "spread": 0.03, "samples": 4, "seed": 5,
    "from": 700, "to": 850, "harmonics": 1,
}  # fmt: skip


def finished(client: httpx.Client, body: dict[str, Any]) -> dict[str, Any]:
    answer = client.post("/v1/jobs", json=body, headers=WAIT)
    assert answer.status_code == 200, answer.text
    job = answer.json()
    assert job["status"] == "successful", job["error"]
    return job


def without_time(result: dict[str, Any]) -> dict[str, Any]:
    kept = {key: value for key, value in result.items() if key != "seconds"}
    return {key: without_time(value) if isinstance(value, dict) else value for key, value in kept.items()}


def test_a_map_is_the_solver_s_and_the_sweeps_of_its_ridge_are_stored(shipped: httpx.Client) -> None:
    job = finished(shipped, MAP)
    found = solver.response_map(
        solver.load_scene("two-dof"), "damper.N0", 60.0, 160.0, steps=5, frequencies=20, harmonics=3
    )
    assert found.ridge is not None
    assert without_time(job["result"]) == without_time(found.to_json())
    assert len(job["sweeps"]) == found.ridge.sweeps >= 4
    assert {sweep["parameter"] for sweep in job["sweeps"]} == {"frequency"}
    alone = finished(shipped, {**MAP, "ridge": False})
    assert alone["result"]["ridge"] is None
    assert alone["result"]["amplitude"] == job["result"]["amplitude"]
    assert alone["sweeps"] == []


def test_tracked_peaks_are_the_solver_s_and_their_sweeps_are_stored(shipped: httpx.Client) -> None:
    job = finished(shipped, {**PEAKS, "checks": 1, "set": {"damper.mu": 0.35}})
    scene = solver.load_scene("two-dof").with_values({"damper.mu": 0.35})
    track = solver.track_peak(scene, "damper.N0", 60.0, 160.0, checks=1, harmonics=3)
    assert without_time(job["result"]) == without_time(track.to_json())
    assert len(job["sweeps"]) == track.sweeps == len(track.branches)
    loads = [sweep["contacts"]["damper"]["N0"] for sweep in job["sweeps"]]
    assert loads[:3] == [60.0, 110.0, 160.0]
    assert track.optimum.at in loads, "the sweep that proves the optimum"
    for sweep, branch in zip(job["sweeps"], track.branches, strict=True):
        assert branch.peak is not None
        assert sweep["peak"]["value"] == pytest.approx(branch.peak.value, rel=1e-12)


def test_an_accuracy_study_has_the_values_of_the_solver(shipped: httpx.Client) -> None:
    ways: dict[str, Any] = {"harmonics": [1, 5], "samples": [64], "repeats": 1}
    job = finished(shipped, {**ACCURACY, **ways})
    study = solver.accuracy_study(solver.load_scene("two-dof"), **ways)
    result = job["result"]
    assert result["completed"]
    assert result["frequency_hz"] == study.frequency_hz
    assert [(row["harmonics"], row["samples"], row["max_abs"]) for row in result["rows"]] == [
        (row.harmonics, row.samples, row.max_abs) for row in study.rows
    ]
    assert all(row["milliseconds"] > 0.0 for row in result["rows"])
    [sweep] = job["sweeps"]
    assert sweep["peak"]["at"] == study.frequency_hz, "the sweep that found the peak"
    assert finished(shipped, {**ACCURACY, **ways, "frequency_hz": 1.2})["sweeps"] == []


def test_a_campbell_diagram_is_that_of_python_and_each_response_is_stored_once(shipped: httpx.Client) -> None:
    plain = finished(shipped, {**CAMPBELL, "orders": [2, 1], "limit": 1.5, "band_hz": [0.5, 2.5]})
    keys: dict[str, Any] = {"orders": [2, 1], "limit": 1.5, "band_hz": [0.5, 2.5], "harmonics": 3}
    diagram = optim.campbell_diagram(solver.load_scene("two-dof"), speeds_rpm=[[60, 100]], **keys)
    assert without_time(plain["result"]) == without_time(diagram.to_json())
    [sweep] = plain["sweeps"]
    assert (sweep["from"], sweep["to"], sweep["limit"]) == (0.5, 2.5, 1.5)
    speeds = [[9000, 12000], [13000, 14000]]
    disk = finished(shipped, {**CAMPBELL, "scene": "bladed-disk", "speeds_rpm": speeds, "orders": [3, 4]})
    assert [one["order"] for one in disk["result"]["orders"]] == [3, 4]
    assert len(disk["sweeps"]) == 2, "in a disk each order is a response of its own"


def test_a_mistuning_study_is_that_of_python_and_the_worst_responses_are_stored(
    shipped: httpx.Client,
) -> None:
    job = finished(shipped, MISTUNING)
    keys = {key: MISTUNING[key] for key in ("of", "spread", "samples", "seed", "harmonics")}
    study = solver.mistuning_study(solver.Scene.from_dict(DISK), **keys, start=700.0, stop=850.0)
    result = job["result"]
    assert without_time(result) == without_time(study.to_json())
    assert [disk["seed"] for disk in result["samples"]] == [5, 6, 7, 8]
    tuned, worst = job["sweeps"]
    assert tuned["peak"]["value"] == result["tuned"]["peak"]
    assert worst["peak"]["value"] == pytest.approx(result["worst"]["largest"], rel=1e-13)
    assert result["worst"]["magnification"] > 1.0
    again = finished(shipped, {**MISTUNING, "fresh": True})
    assert without_time(again["result"]) == without_time(result), "the same seed, the same disks"
    other = finished(shipped, {**MISTUNING, "seed": 8, "samples": 1, "of": "tip_middle", "dof": "middle"})
    assert other["result"]["samples"][0]["factors"] == result["samples"][3]["factors"]
    assert other["result"]["dof"] == "middle"


@pytest.mark.parametrize(
    "body",
    [
        {**MAP, "scene": "bladed-disk", "parameter": "shroud.N0", "harmonics": 25, "steps": 1000,
         "frequencies": 500},
        {**PEAKS, "scene": "bladed-disk", "parameter": "shroud.N0", "harmonics": 50, "checks": 150},
        {**ACCURACY, "repeats": 500},
        {**CAMPBELL, "scene": "bladed-disk", "speeds_rpm": [[9000, 12000]], "harmonics": 50,
         "orders": list(range(1, 101))},
        {**MISTUNING, "samples": 1000},
    ],
    ids=["map", "peaks", "accuracy", "campbell", "mistuning"],
)  # fmt: skip
def test_a_long_one_tells_how_far_it_is_and_stops_when_it_is_dismissed(
    shipped: httpx.Client, body: dict[str, Any]
) -> None:
    job = shipped.post("/v1/jobs", json=body).json()
    until(lambda: (shipped.get(job["links"]["self"]).json()["progress"] or 0.0) > 0.0)
    seen = shipped.get(job["links"]["self"]).json()
    assert seen["status"] == "running"
    assert shipped.delete(job["links"]["self"]).json()["status"] == "dismissed"
    assert shipped.get(job["links"]["self"] + "/results").status_code == 409


@pytest.mark.parametrize("body", [{**PEAKS, "to": 60}, {**MAP, "steps": 1000, "frequencies": 501}])
def test_of_what_is_refused_nothing_is_written(shipped: httpx.Client, body: dict[str, Any]) -> None:
    """What is refused, where and with which words: tests/golden/refused.py."""
    before = job_ids(shipped)
    assert is_problem(shipped.post("/v1/jobs", json=body), 422)["errors"]
    assert job_ids(shipped) == before
