"""What a list of runs shows of each, and that what happens to them is told without being asked for."""

from __future__ import annotations

import json
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from private_kinds import PRIVATE
from service_helpers import serving, until

import optim
import solver
from service.auth.authenticator import create
from service.auth.callers import Scope
from service.db.clock import utc_now
from service.http.routes import run_list
from service.queue.core import Service


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


def test_runs_are_read_once_for_all_who_listen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each hears of their own runs alone, however many listen; streams leave requests alone."""
    with serving(tmp_path, PRIVATE, require_keys=True, owner_requests=2, owner_streams=8) as client:
        keys, now = client.service.keys, utc_now()
        owners = {"ann": Scope.SUBMIT, "bob": Scope.SUBMIT, "chief": Scope.ADMIN}
        bearers = {
            owner: {"Authorization": f"Bearer {create(keys, owner, [scope], now).token}"}
            for owner, scope in owners.items()
        }
        read: list[set[str | None]] = []

        def events(service: Service, ids: set[str], heard: set[str | None]) -> Any:
            read.append(heard)
            return told(service, ids, heard)

        told, begun = run_list._events, time.monotonic()
        monkeypatch.setattr(run_list, "_events", events)
        with ExitStack() as stack:
            streams = {
                (owner, n): stack.enter_context(
                    client.stream("GET", "/v1/runs/events", headers=bearers[owner])
                )
                for owner in owners
                for n in range(4)
            }
            jobs = {}
            for owner in ("ann", "bob"):
                body = {"kind": "iteration", "fresh": True}
                answer = client.post("/v1/jobs", json=body, headers={**bearers[owner], "Prefer": "wait=60"})
                assert answer.status_code == 200, "open streams are no requests of the owner"
                jobs[owner] = answer.json()["id"]
            sees = {"ann": {jobs["ann"]}, "bob": {jobs["bob"]}, "chief": set(jobs.values())}
            for (owner, _), stream in streams.items():
                assert ended(stream, len(sees[owner])) == sees[owner]
            until(lambda: not client.application.state.news._heard)  # all of them are closed
            more = [
                stack.enter_context(client.stream("GET", path, headers=bearers["ann"])).status_code
                for path in 8 * ["/v1/runs/events"] + [f"/v1/jobs/{jobs['ann']}/events"]
            ]
            assert more == 8 * [200] + [429], "streams of every kind are one"
        assert {"ann", "bob", None} in read
        most = 2 + (time.monotonic() - begun) / run_list._LEAST_SECONDS
        assert len(read) <= most, "one reads for all"


def ended(stream: httpx.Response, most: int) -> set[str]:
    """The runs whose end a stream tells of, as soon as they are so many."""
    found: set[str] = set()
    for line in stream.iter_lines():
        if line.startswith("data:"):
            run = json.loads(line.removeprefix("data:"))
            found |= {run["id"]} if run["status"] == "successful" else set()
        if len(found) >= most:
            break
    return found
