"""Previews: computed at once, nothing stored, the newest of each client first."""

import asyncio
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import numpy as np
import pytest
from service_helpers import is_problem, until

import solver
from service.errors import ConflictError, InvalidRequestError, JobFailedError, PreviewError, QueueFullError
from service.jobs.kind_registry import JobKind, JobRequest, Registry, Resolved, SceneSource
from service.jobs.kinds.previews import LIVE_UNKNOWNS, POINT_UNKNOWNS, harmonics_in_time
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.workers.warm_pool import MOST_WAITING, Previews
from solver.errors import SettingError, SolverError

TWO_DOF = {"scene": "two-dof"}
MOTION = {"dofs": ["m1", "m2"], "real": [1.0, 2.0], "imag": [0.0, -1.0], "frequency_hz": 1.1}


def post(http: httpx.Client, **body: object) -> httpx.Response:
    return http.post("/v1/previews", json={**TWO_DOF, **body})


def test_a_sweep_is_that_of_the_solver_and_nothing_is_stored(shipped: httpx.Client) -> None:
    before = shipped.get("/v1/jobs").json()["items"], shipped.get("/v1/sweeps").json()["items"]
    answer = post(shipped, kind="sweep", set={"damper.N0": 80}, client="a")
    assert answer.status_code == 200
    assert answer.headers["cache-control"] == "no-store"
    found = answer.json()
    branch = solver.sweep(solver.load_scene("two-dof").with_values({"damper.N0": 80.0}))
    assert np.allclose(found["amplitude"], branch.amplitude, rtol=1e-9)
    assert branch.peak is not None
    assert found["peak"] == pytest.approx({"value": branch.peak.value, "at": branch.peak.at})
    assert found["states"] == {"damper": "stick and slip"}
    after = shipped.get("/v1/jobs").json()["items"], shipped.get("/v1/sweeps").json()["items"]
    assert after == before


def test_sensitivities_are_differences_of_responses(shipped: httpx.Client) -> None:
    values = {"damper.N0": 80.0}
    found = post(shipped, kind="sensitivities", set=values, limit=1.5).json()
    assert found["reached"]
    units = {row["path"]: row["unit"] for row in found["rows"]}
    told = {"damper.N0": "N", "damper.kt": "N/m", "damper.mu": "", "structure.k1": "N/m"}
    assert {path: units[path] for path in told} == told
    shares = {row["path"]: row for row in found["rows"]}
    scene = solver.load_scene("two-dof").with_values(values)
    for path in ("damper.N0", "damper.kt", "excitation.amplitude"):
        up, down = (
            solver.sweep(scene.with_values({path: scene.value(path) * f}), limit=1.5) for f in (1.001, 0.999)
        )
        assert up.peak is not None
        assert down.peak is not None
        assert up.band is not None
        assert down.band is not None
        peak = 1e3 * (up.peak.value - down.peak.value) / (up.peak.value + down.peak.value)
        band = 1e3 * (up.band.width - down.band.width) / (up.band.width + down.band.width)
        assert shares[path]["peaks_percent"][0] == pytest.approx(peak, rel=1e-3, abs=1e-4)
        assert shares[path]["band_percent"] == pytest.approx(band, rel=1e-3, abs=1e-4)


def test_limits_are_the_linear_responses(shipped: httpx.Client) -> None:
    found = post(shipped, kind="limits", contact="damper").json()
    free, stuck = (found[name]["peaks"][0]["at"] for name in ("free", "stuck"))
    # Natural frequencies of the chain without and with the contact's stiffness.
    for stiffness, at in ((0.0, free), (30.0, stuck)):
        k1, k2 = (4 * np.pi) ** 2, (2 * np.pi) ** 2
        lowest = np.sqrt(np.linalg.eigvalsh([[k1 + k2, -k2], [-k2, k2 + stiffness]])[0]) / (2 * np.pi)
        assert at == pytest.approx(lowest, rel=2e-3)


def test_a_point_has_loops_and_what_the_contact_does_when(shipped: httpx.Client) -> None:
    found = post(shipped, kind="point", frequency_hz=1.05).json()
    period, (contact,) = found["period"], found["period"]["contacts"]
    assert max(map(abs, period["displacement"])) == pytest.approx(found["max_abs"], rel=1e-3)
    assert period["displacement"][0] == pytest.approx(period["displacement"][-1])
    force, load, motion = (np.array(contact[name]) for name in ("force", "load", "motion"))
    slipping = motion == 1
    assert slipping.any()
    assert (motion == 0).any()
    assert np.allclose(np.abs(force[:-1][slipping]), 0.3 * load[:-1][slipping], rtol=1e-6)
    assert sum(contact["shares"].values()) == pytest.approx(1.0)


def test_of_a_disk_written_out_every_sector_has_its_states(shipped: httpx.Client) -> None:
    scene = solver.load_scene("bladed-disk").to_dict()
    scene["structure"]["sectors"] = 3
    scene["structure"]["mistuning"] = {"of": ["tip"], "spread": 0.01}
    found = post(shipped, kind="sweep", scene=scene, harmonics=3).json()
    assert found["n_harmonics"] == 3
    assert set(found["states"]) == {f"{name}@{j}" for name in ("shroud", "root") for j in range(3)}
    point = post(shipped, kind="point", scene=scene, harmonics=3, frequency_hz=750.0).json()
    assert [contact["name"] for contact in point["period"]["contacts"]] == list(found["states"])


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        ({"kind": "map"}, "/kind"),
        ({"kind": "sweep", "harmonics": 42}, "/harmonics"),
        ({"kind": "sweep", "set": {"damper.N9": 1}}, "/set/damper.N9"),
        ({"kind": "limits", "contact": "shroud"}, "/contact"),
        ({"kind": "limits", "scene": "platform-wedge"}, "/scene"),
        ({"kind": "point"}, "/frequency_hz"),
        ({"kind": "point", "frequency_hz": 5e-324}, "/frequency_hz"),
        ({"kind": "shape"}, "/frequency_hz"),
        ({"kind": "shape", "mode": 1, "frequency_hz": 1.0}, "/frequency_hz"),
        ({"kind": "shape", "frequency_hz": 1.0, "nodal_diameter": 1}, "/nodal_diameter"),
        ({"kind": "shape", "motion": MOTION | {"real": [1.0]}}, "/motion"),
        ({"kind": "shape", "mode": 9}, "/mode"),
        ({"kind": "shape", "mode": 1, "nodal_diameter": 1}, "/nodal_diameter"),
        ({"kind": "sweep", "client": 5}, "/client"),
        ({"kind": "sweep", "scene": {"name": "x"}}, "/scene/structure"),
    ],
)
def test_what_is_wrong_is_named(shipped: httpx.Client, body: dict, pointer: str) -> None:
    problem = is_problem(post(shipped, **body), 422)
    assert pointer in [issue["pointer"] for issue in problem["errors"]]


def test_large_structures_are_jobs(shipped: httpx.Client) -> None:
    masses = {f"m{i}": 1.0 for i in range(620)}
    scene = {
        "name": "long", "structure": {"kind": "lumped", "masses": masses},
        "excitation": {"dof": "m0", "amplitude": 1.0}, "observe": {"dof": "m0", "band": [0.1, 1.0]},
    }  # fmt: skip
    body = {"kind": "sweep", "scene": scene, "harmonics": 41}
    problem = is_problem(shipped.post("/v1/previews", json=body), 422)
    assert "must be at most 50000, got 51460: submit a job" in problem["detail"]


def test_a_whole_disk_is_followed_with_the_harmonics_there_is_time_for() -> None:
    tuned = solver.load_scene("bladed-disk")
    scene = solver.mistuned(tuned, of=["tip"], spread=0.02)
    for unknowns, kept in ((LIVE_UNKNOWNS, 3), (POINT_UNKNOWNS, 11), (10, 1)):
        assert harmonics_in_time(scene, 11, unknowns) == kept
    assert harmonics_in_time(tuned, 41, 10) == 41


def test_a_march_gives_its_last_period_on_request(shipped: httpx.Client) -> None:
    body = {"kind": "march", "scene": "two-dof", "frequency_hz": 1.05, "history": True}
    result = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()["result"]
    history = result["history"]
    assert max(map(abs, history["displacement"])) == pytest.approx(result["max_abs"], rel=1e-2)
    assert [contact["name"] for contact in history["contacts"]] == ["damper"]
    assert len(history["time"]) == len(history["contacts"][0]["slip"])


class WaitRequest(JobRequest):
    """Seconds to spend."""

    seconds: float = 0.0


def _resolve(request: WaitRequest, _source: SceneSource) -> Resolved:
    return Resolved(spec={"seconds": request.seconds})


def spend(spec: Mapping[str, Any], _progress: Progress, should_stop: ShouldStop) -> JobOutput:
    end = time.monotonic() + spec["seconds"]
    while time.monotonic() < end and not should_stop():
        time.sleep(0.005)
    return JobOutput(result={"spent": spec["seconds"]})


def refuse(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    raise SettingError("value", 3, "must be something else")


def fail(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    raise SolverError("there is no answer")


def die(_spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    import os

    os._exit(3)


KINDS = Registry(
    JobKind(name=name, summary=name, request=WaitRequest, resolve=_resolve, run=run)
    for name, run in (("spend", spend), ("refuse", refuse), ("fail", fail), ("die", die))
)


def together(previews: Previews, *asked: tuple[str, float, str]) -> list[bytes | BaseException]:
    """The answers to (kind, seconds, client), asked one after the other within moments."""

    async def ask() -> list[bytes | BaseException]:
        tasks = []
        for kind, seconds, client in asked:
            tasks.append(asyncio.ensure_future(previews.compute(kind, {"seconds": seconds}, client)))
            await asyncio.sleep(0.02)
        return await asyncio.gather(*tasks, return_exceptions=True)

    return asyncio.run(ask())


@pytest.fixture(scope="module")
def previews() -> Any:
    made = Previews(1.0, KINDS, workers=1)
    together(made, ("spend", 0.0, ""))
    yield made
    made.close()


def test_the_newest_of_a_client_takes_the_place_of_its_older_ones(previews: Previews) -> None:
    one, two, other, three = together(
        previews, ("spend", 0.9, "a"), ("spend", 0.9, "a"), ("spend", 0.01, "b"), ("spend", 0.02, "a")
    )
    assert isinstance(one, ConflictError)
    assert isinstance(two, ConflictError)
    assert other == b'{"spent":0.01}'
    assert three == b'{"spent":0.02}'


def test_one_that_takes_too_long_is_ended_and_the_next_goes_on(previews: Previews) -> None:
    slow, quick = together(previews, ("spend", 30.0, "a"), ("spend", 0.0, "b"))
    assert isinstance(slow, PreviewError)
    assert "longer than 1 s" in str(slow)
    assert quick == b'{"spent":0.0}'


def test_few_wait(previews: Previews) -> None:
    answers = together(previews, *[("spend", 0.02, "")] * (MOST_WAITING + 20))
    assert any(isinstance(answer, bytes) for answer in answers)
    waits: Callable[[object], bool] = lambda answer: isinstance(answer, QueueFullError)  # noqa: E731
    assert all(isinstance(answer, bytes) or waits(answer) for answer in answers)
    slow = [("spend", 0.9, "")] + [("spend", 0.0, "")] * (MOST_WAITING + 1)
    assert any(waits(answer) for answer in together(previews, *slow))


def test_what_cannot_be_computed_says_why(previews: Previews) -> None:
    refused, failed, died, after = together(
        previews, ("refuse", 0.0, ""), ("fail", 0.0, ""), ("die", 0.0, ""), ("spend", 0.0, "")
    )
    assert isinstance(refused, InvalidRequestError)
    assert isinstance(failed, JobFailedError)
    assert isinstance(died, PreviewError)
    assert after == b'{"spent":0.0}'


def test_two_are_computed_at_a_time() -> None:
    both = Previews(5.0, KINDS)
    together(both, ("spend", 0.0, ""))
    until(lambda: both._executor is not None and both._executor.status().ready == 2)
    with ThreadPoolExecutor(1) as pool:
        answers = pool.submit(together, both, ("spend", 1.0, "a"), ("spend", 1.0, "b"))
        until(lambda: len(both._running) == 2)
        assert answers.result() == [b'{"spent":1.0}'] * 2
    both.close()


@pytest.mark.long
def test_closing_tells_those_who_wait() -> None:
    closing = Previews(5.0, KINDS, workers=1)
    together(closing, ("spend", 0.0, ""))
    with ThreadPoolExecutor(1) as pool:
        answers = pool.submit(together, closing, ("spend", 4.0, "a"), ("spend", 4.0, "b"))
        until(lambda: closing._waiting)
        closing.close()
        assert all(isinstance(answer, PreviewError) for answer in answers.result())
    assert isinstance(together(closing, ("spend", 0.0, ""))[0], PreviewError)


def test_a_shape_is_told_as_arrays_with_what_is_drawn(shipped: httpx.Client) -> None:
    found = post(shipped, kind="shape", scene="bladed-disk", frequency_hz=740.0, harmonics=5).json()
    assert found["reached"]
    drawn = found["shape"]
    solution = solver.solve(solver.load_scene("bladed-disk"), frequency_hz=740.0, harmonics=5)
    _, tip = solver.time_history(solution, "tip", samples=32)
    own = np.array(drawn["real"])[0] + 1j * np.array(drawn["imag"])[0]
    waves = np.exp(2j * np.pi * np.outer(np.arange(32) / 32, drawn["harmonics"]))
    told = (waves @ own[:, drawn["names"].index("tip"), 2]).real
    assert told == pytest.approx(tip, abs=3e-3 * np.abs(tip).max())
    assert (drawn["sectors"], drawn["nodal_diameter"], drawn["unit"]) == (8, 1, "m")
    (shroud,) = [contact for contact in drawn["contacts"] if contact["name"] == "shroud"]
    assert shroud["states"] == ["stick and slip"]
    assert set(shroud["motions"][0]) == {0, 1}
    mode = post(shipped, kind="shape", scene="bladed-disk", mode=1, nodal_diameter=-2).json()["shape"]
    assert (mode["unit"], mode["nodal_diameter"]) == ("1/√kg", -2)
    given = post(shipped, kind="shape", motion=MOTION | {"states": {"damper": "stuck"}}).json()["shape"]
    assert [given["real"][0][0][given["names"].index(m)][0] for m in ("m1", "m2")] == MOTION["real"]
    assert [given["imag"][0][0][given["names"].index(m)][0] for m in ("m1", "m2")] == MOTION["imag"]
    assert [contact["states"] for contact in given["contacts"]] == [["stuck"]]
    problem = is_problem(post(shipped, kind="shape", motion=MOTION | {"dofs": ["m1", "m3"]}), 422)
    assert "m2" in problem["errors"][0]["detail"]
