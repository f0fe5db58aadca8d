"""The kinds that come with the service, on the real solver."""

import pickle
from typing import Any

import httpx
import numpy as np
import pytest
from service_helpers import is_problem

import solver
from service.jobs.common.sweep_records import contact_values
from service.jobs.kind_registry import KIND, Registry, asked_of, request_in
from service.jobs.kinds import SHIPPED
from service.jobs.kinds.bodies import body_model
from service.jobs.kinds.previews import PREVIEWS

WAIT = {"Prefer": "wait=60"}


def finished(client: httpx.Client, body: dict[str, Any]) -> dict[str, Any]:
    answer = client.post("/v1/jobs", json=body, headers=WAIT)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_a_sweep_is_the_solver_s_and_is_stored(shipped: httpx.Client) -> None:
    body = {"kind": "sweep", "scene": "two-dof", "from": 0.5, "to": 1.5, "harmonics": 5}
    job = finished(shipped, {**body, "set": {"damper.N0": 50}})
    assert job["status"] == "successful", job["error"]
    scene = solver.load_scene("two-dof").with_values({"damper.N0": 50.0})
    branch = solver.sweep(scene, start=0.5, stop=1.5, harmonics=5)
    assert branch.peak is not None
    assert job["result"]["peak"]["value"] == pytest.approx(branch.peak.value, rel=1e-9)
    assert job["result"]["points"] == len(branch.values)
    [stored] = job["sweeps"]
    assert stored["scene"] == "two-dof"
    assert stored["parameter"] == "frequency"
    assert (stored["from"], stored["to"], stored["harmonics"]) == (0.5, 1.5, 5)
    assert stored["contacts"]["damper"] == {"kt": 30.0, "mu": 0.3, "N0": 50.0, "N1": 15.0, "N1_phase": 0.0}
    assert stored["excitation_amplitude"] == 100.0
    assert branch.band is not None
    assert stored["band_hz"] == pytest.approx(branch.band.width, rel=1e-9)
    detail = shipped.get(stored["links"]["self"]).json()
    np.testing.assert_allclose(detail["arrays"]["amplitude"], branch.amplitude, rtol=1e-9)
    np.testing.assert_allclose(detail["arrays"]["coefficients"], branch.coefficients, rtol=1e-6, atol=1e-9)
    assert set(detail["arrays"]) == {
        "parameter", "amplitude", "half_peak_to_peak", "mean", "residual", "coefficients", "observed",
        "states",
    }  # fmt: skip


DUFFING: dict[str, Any] = {
    "name": "duffing",
    "structure": {
        "kind": "lumped",
        "masses": {"x": 1.0},
        "springs": [{"between": ["x", "ground"], "k": 1.0, "c": 0.2}],
    },
    "contacts": [{"name": "cubic", "law": "polynomial", "between": ["x", "ground"], "a3": 1.0}],
    "excitation": {"dof": "x", "amplitude": 15.0},
    "observe": {"dof": "x", "band": [0.23, 0.3]},
}


def test_all_solutions_of_a_spring_that_bends_are_a_job(shipped: httpx.Client) -> None:
    """At 1.6 rad/s a march settles at 3.9161 and at its mirror image; 3.3130 between them is not stable."""
    body = {"kind": "solve", "scene": DUFFING, "frequency_hz": 1.6 / (2.0 * np.pi), "all": True, "starts": 6}
    job = finished(shipped, {**body, "harmonics": 9})
    assert job["status"] == "successful", job["error"]
    found = job["result"]
    assert not found["complete"]
    stable = [each["max_abs"] for each in found["solutions"] if each["stability"]["stable"]]
    assert any(value == pytest.approx(3.9161, rel=1e-3) for value in stable)
    lost = [each["max_abs"] for each in found["solutions"] if not each["stability"]["stable"]]
    assert any(value == pytest.approx(3.3130, rel=1e-3) for value in lost)


@pytest.mark.long
def test_a_sweep_follows_the_branches_that_leave_it(shipped: httpx.Client) -> None:
    body = {"kind": "sweep", "scene": DUFFING, "harmonics": 7, "stability": True, "branches": True}
    job = finished(shipped, body)
    assert job["status"] == "successful", job["error"]
    result = job["result"]
    assert result["stability_known_by"] == "multipliers"
    assert result["unstable"]
    others = [branch for each in result["branches"] for branch in each["branches"]]
    assert others
    assert len(job["sweeps"]) == 1 + len(others)


def test_what_is_swept_has_no_single_value(shipped: httpx.Client) -> None:
    body = {"kind": "sweep", "scene": "two-dof", "parameter": "damper.N0", "from": 20, "to": 200}
    job = finished(shipped, {**body, "frequency_hz": 1.0, "harmonics": 5})
    assert job["status"] == "successful", job["error"]
    [stored] = job["sweeps"]
    contact = stored["contacts"]["damper"]
    assert (contact["N0"], contact["N1"], contact["kt"]) == (None, None, 30.0)
    assert stored["frequency_hz"] == 1.0
    assert stored["band_hz"] is None
    matching = shipped.get("/v1/sweeps?N0_min=20&N0_max=200&parameter=damper.N0").json()["items"]
    assert matching == []


@pytest.mark.parametrize(
    ("parameter", "missing"),
    [
        ("shroud.N1", {"N1"}),
        ("shroud.N1_ratio", {"N1"}),
        ("shroud.kt", {"kt"}),
        ("shroud.mu", {"mu"}),
        ("shroud.N1_phase", {"N1_phase"}),
        ("shroud.N0", {"N0", "N1"}),
        ("frequency", set()),
    ],
)
def test_values_that_follow_the_parameter_are_left_out(parameter: str, missing: set[str]) -> None:
    values = {v.name: v for v in contact_values(solver.load_scene("bladed-disk"), parameter)}
    names = ("kt", "mu", "N0", "N1", "N1_phase")
    assert {name for name in names if getattr(values["shroud"], name) is None} == missing
    assert all(getattr(values["root"], name) is not None for name in names)


def test_solve_and_march_agree(shipped: httpx.Client) -> None:
    solved = finished(shipped, {"kind": "solve", "scene": "two-dof", "frequency_hz": 1.0, "harmonics": 25})
    marched = finished(shipped, {"kind": "march", "scene": "two-dof", "frequency_hz": 1.0})
    assert solved["status"] == marched["status"] == "successful", (solved["error"], marched["error"])
    assert solved["result"]["max_abs"] == pytest.approx(marched["result"]["max_abs"], rel=2e-3)


def test_a_march_that_does_not_settle_fails_and_says_so(shipped: httpx.Client) -> None:
    job = finished(shipped, {"kind": "march", "scene": "two-dof", "frequency_hz": 1.0, "max_periods": 1})
    assert job["status"] == "failed"
    assert job["error"]["type"] == "goal-not-reached"
    assert "max_periods" in job["error"]["detail"]
    assert job["result"]["periods"] >= 1


def test_a_stored_scene_and_an_inline_scene_are_as_good_as_a_shipped_one(shipped: httpx.Client) -> None:
    scene = shipped.get("/v1/scenes/two-dof").json()["scene"]
    shipped.post("/v1/scenes", json={**scene, "name": "stored"}).raise_for_status()
    body = {"kind": "solve", "frequency_hz": 0.9, "harmonics": 5}
    jobs = [finished(shipped, {**body, "scene": one}) for one in ("two-dof", "stored", scene)]
    assert len({job["result"]["max_abs"] for job in jobs}) == 1
    assert jobs[2]["result_of"] == jobs[0]["id"], "the same scene, whoever sends it"
    assert jobs[1]["result_of"] is None, "another name is another scene"
    plan = shipped.post("/v1/plan", json={"scene": "stored", "harmonics": 3}).json()
    assert plan["scene"] == "stored"
    assert all(effect["reason"] for effect in plan["effects"])
    assert plan["n_harmonics"] == 3


def test_the_plan_refuses_what_the_jobs_refuse(shipped: httpx.Client) -> None:
    assert (
        is_problem(shipped.post("/v1/plan", json={"scene": "none"}), 422)["errors"][0]["pointer"] == "/scene"
    )
    assert is_problem(shipped.post("/v1/plan", json={"scene": "two-dof", "x": 1}), 422)


def test_a_design_keeps_every_response_it_computed(shipped: httpx.Client) -> None:
    body = {"scene": "two-dof", "variables": {"damper.N0": [20, 1000]}, "harmonics": 5, "method": "minimax"}
    accepted = shipped.post("/v1/designs", json={**body, "limit": None, "max_band_hz": None}, headers=WAIT)
    assert accepted.status_code == 200, accepted.text
    job = accepted.json()
    assert (job["kind"], job["status"]) == ("design", "successful"), job["error"]
    result, sweeps = job["result"], job["sweeps"]
    assert result["reached"]
    best = result["optimum"]["damper.N0"]
    assert 20.0 < best < 1000.0
    assert len(sweeps) == result["evaluations"]
    assert sweeps[-1]["contacts"]["damper"]["N0"] == best, "the response of the optimum comes last"
    assert sweeps[-1]["peak"]["value"] == pytest.approx(result["peak"]["value"], rel=1e-6)
    lowest = shipped.get(f"/v1/sweeps?job={job['id']}&sort=peak&limit=1").json()["items"][0]
    assert lowest["peak"]["value"] == pytest.approx(result["peak"]["value"], rel=1e-6)
    near = shipped.get(
        f"/v1/sweeps?job={job['id']}&contact=damper&N0_min={best - 1e-9}&N0_max={best + 1e-9}"
    ).json()["items"]
    assert sweeps[-1]["id"] in [sweep["id"] for sweep in near]
    again = shipped.post("/v1/designs", json=body).json()
    assert again["result_of"] == job["id"]


def test_a_design_without_variables_takes_the_damper_s_load(shipped: httpx.Client) -> None:
    job = finished(shipped, {"kind": "design", "scene": "two-dof", "harmonics": 3})
    assert list(job["result"]["optimum"]) == ["damper.N0"]


def test_a_design_that_misses_its_goal_fails_and_keeps_the_best(shipped: httpx.Client) -> None:
    body = {"kind": "design", "scene": "two-dof", "variables": {"damper.N0": [20, 1000]}, "harmonics": 3}
    job = finished(shipped, {**body, "limit": 1.0, "max_band_hz": 1e-6})
    assert job["status"] == "failed"
    assert job["error"]["type"] == "goal-not-reached"
    assert "relax" in job["error"]["detail"]
    [band] = [row for row in job["result"]["broken"] if row["quantity"] == "band"]
    assert band["by"] == pytest.approx(band["value"] - 1e-6)
    assert job["result"]["optimum"]["damper.N0"] > 0.0
    assert job["sweeps"]


@pytest.mark.parametrize("registry", [SHIPPED, PREVIEWS])
def test_what_a_checked_body_asks_is_what_its_kind_reads_in_it(registry: Registry) -> None:
    found = 0
    for kind in registry:
        for example in kind.request.model_json_schema().get("examples", ()):
            body = {KIND: kind.name, "name": " a run ", **example}
            checked = asked_of(body_model(kind.name, kind.request).model_validate(body), kind.request)
            wanted = request_in(body, kind.request)
            assert (checked, checked.model_fields_set) == (wanted, wanted.model_fields_set)
            assert pickle.loads(pickle.dumps(checked)) == wanted
            found += 1
    assert found >= len(registry) - 1
