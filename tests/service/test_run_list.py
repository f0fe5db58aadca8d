"""What a list of runs shows of each, and that what happens to them is told without being asked for."""

from __future__ import annotations

import json
import threading
from typing import Any

import httpx
import numpy as np
import pytest

import optim
import solver


def computed(shipped: httpx.Client, **body: Any) -> str:
    answer = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}, timeout=90.0)
    assert answer.json()["status"] == "successful", answer.text
    job: str = answer.json()["id"]
    return job


def test_a_design_is_summed_up_with_the_response_of_its_optimum(shipped: httpx.Client) -> None:
    given = {"variables": {"damper.N0": [20, 1000]}, "harmonics": 3}
    job = computed(shipped, kind="design", scene="two-dof", **given)
    told = shipped.get(f"/v1/runs/{job}/summary", params={"points": 40}).json()
    direct = optim.design(solver.load_scene("two-dof"), **given)  # type: ignore[arg-type]
    assert direct.peak is not None
    assert told["values"] == pytest.approx(dict(direct.optimum))
    assert told["peak"]["value"] == pytest.approx(direct.peak.value)
    assert told["band_hz"] == pytest.approx(direct.band_hz)
    assert told["harmonics"] == 3
    assert told["request"]["variables"] == {"damper.N0": [20, 1000]}
    curve = told["curve"]
    assert len(curve["amplitude"]) <= 40
    # The highest point of the branch is within a step of the polished peak.
    assert max(curve["amplitude"]) == pytest.approx(direct.peak.value, rel=0.01)
    assert np.all(np.diff(curve["frequency_hz"]) > 0.0)


def test_runs_of_every_form_have_a_summary(shipped: httpx.Client) -> None:
    sweep = computed(shipped, kind="sweep", scene="two-dof", set={"damper.N0": 81.0}, harmonics=3)
    told = shipped.get(f"/v1/runs/{sweep}/summary").json()
    assert told["values"] == {"damper.N0": 81.0}
    assert told["peak"]["value"] == pytest.approx(max(told["curve"]["amplitude"]), rel=0.01)
    robust = {"uncertain": {"damper.mu": [0.2, 0.4]}, "samples": 4, "variables": {"damper.N0": [20, 500]}}
    job = computed(shipped, kind="design", scene="two-dof", harmonics=1, **robust)
    result = shipped.get(f"/v1/jobs/{job}/results").json()["result"]
    told = shipped.get(f"/v1/runs/{job}/summary").json()
    assert told["worst"]
    assert told["peak"]["value"] == result["robust"]["worst"]["peak"]
    plain = computed(shipped, kind="interference", scene="bladed-disk", speed_rpm=11000)
    told = shipped.get(f"/v1/runs/{plain}/summary").json()
    assert (told["peak"], told["curve"], told["values"]) == (None, None, {})
    assert shipped.get("/v1/runs/nosuch/summary").status_code == 404


def test_runs_are_told_as_they_begin_and_end(shipped: httpx.Client) -> None:
    seen: list[dict[str, Any]] = []
    ready = threading.Event()

    def listen() -> None:
        with shipped.stream("GET", "/v1/runs/events", timeout=60.0) as stream:
            name = ""
            for line in stream.iter_lines():
                ready.set()
                if line.startswith("event:"):
                    name = line.removeprefix("event:").strip()
                if line.startswith("data:") and name == "run":
                    seen.append(json.loads(line.removeprefix("data:")))
                    if seen[-1]["kind"] == "sweep" and seen[-1]["status"] == "successful":
                        return

    listener = threading.Thread(target=listen)
    listener.start()
    assert ready.wait(30.0)
    job = computed(shipped, kind="sweep", scene="two-dof", set={"damper.N0": 82.0}, fresh=True)
    listener.join(30.0)
    assert not listener.is_alive()
    assert {one["id"] for one in seen} >= {job}
    assert next(one["status"] for one in reversed(seen) if one["id"] == job) == "successful"
