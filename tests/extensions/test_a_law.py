"""A contact law of this folder (`sliders`): named once, it is solved, swept, marched, designed and described.

Time marching of its sliders, each by itself, is the referee: it shares nothing with the kernel.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contact_cases import central_difference
from docs_tables import TABLES
from joined_scene import JOINED as SCENE
from law_cases import Element, evaluate, jacobian
from sliders import LIMIT, SLIDERS, K, SlidersContact

import optim
import solver
from service.client.client import Client
from service.errors import ServiceProblem
from solver.contacts.kernels import columns
from solver.contacts.laws.law_registry import laws, register, unregister
from solver.scene.json_schema import scene_schema

HZ, HARMONICS = 0.19, 21


@pytest.fixture
def registered() -> Iterator[None]:
    """In this process."""
    register(SlidersContact)
    yield
    unregister(SlidersContact)


def scene(**values: float) -> solver.Scene:
    found = solver.Scene.from_dict(SCENE)
    return found.with_values({f"joint.{key}": value for key, value in values.items()})


def test_the_kernel_has_the_derivatives_of_its_force() -> None:
    row = np.zeros(columns.COLUMNS)
    row[K], row[LIMIT] = 2.0, 0.9
    element = Element(law=SlidersContact.KERNEL, U=np.random.default_rng(4).normal(size=(1, 7)), row=row)
    here = evaluate(element)

    def moved(U: np.ndarray, row: np.ndarray) -> np.ndarray:
        found = evaluate(Element(law=SlidersContact.KERNEL, U=U, row=row))
        assert found.piece == here.piece
        return found.F[0]

    for i, unit in enumerate(np.eye(7)):
        slope = central_difference(lambda x, d=unit: moved(element.U + x * d, row), 1e-6)
        assert jacobian(here)[:, i] == pytest.approx(slope, abs=1e-8)
    for column in (K, LIMIT):
        unit = np.eye(columns.COLUMNS)[column]
        slope = central_difference(lambda x, d=unit: moved(element.U, row + x * d), 1e-6)
        assert evaluate(element, slope=unit).dF_dp[0] == pytest.approx(slope, abs=1e-8)


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("limit", [0.1, 0.8, 3.0])
def test_the_balance_is_what_marching_its_sliders_gives(limit: float) -> None:
    found = solver.solve(scene(limit=limit), frequency_hz=HZ, harmonics=HARMONICS)
    referee = solver.march(scene(limit=limit), frequency_hz=HZ)
    assert found.converged
    assert referee.converged
    assert len(referee.contacts) == SLIDERS
    assert found.half_peak_to_peak == pytest.approx(referee.half_peak_to_peak, rel=2e-4)


def test_its_numbers_may_have_a_unit_behind_them() -> None:
    """Also where units of keys were asked for before the law was there."""
    plain = solver.load_scene("two-dof").to_dict()
    plain["contacts"][0]["kt"] = "25 N/m"
    assert solver.Scene.from_dict(plain).contacts[0].kt == 25.0
    register(SlidersContact)
    try:
        (joint,) = SCENE["contacts"]
        read = solver.Scene.from_dict({**SCENE, "contacts": [{**joint, "limit": "0.8e-3 kN"}]})
        assert read.contacts[0].limit == pytest.approx(0.8)
    finally:
        unregister(SlidersContact)


@pytest.mark.usefixtures("registered")
def test_its_friction_work_is_the_area_of_its_loop() -> None:
    branch = solver.sweep(scene(), harmonics=HARMONICS)
    worst = solver.worst_friction_work(branch, "joint")
    found = solver.solve(scene(), frequency_hz=worst.at, harmonics=HARMONICS)
    u, force = solver.hysteresis_loop(found, "joint", samples=20_000)
    area = float(0.5 * (force + np.roll(force, -1)) @ (np.roll(u, -1) - u))
    assert worst.value == pytest.approx(area, rel=1e-3)
    assert worst.value > 0.0


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize(("path", "step"), [("joint.limit", 1e-5), ("joint.k", 1e-5)])
def test_its_parameters_are_paths_with_gradients(path: str, step: float) -> None:
    def amplitude(value: float) -> float:
        changed = scene().with_values({path: value})
        return solver.solve(changed, frequency_hz=HZ, harmonics=HARMONICS).max_abs

    branch = solver.sweep(scene(), start=HZ, stop=0.2, harmonics=HARMONICS)
    found = solver.solve(scene(), frequency_hz=HZ, harmonics=HARMONICS)
    slopes = solver.Sensitivities(branch.balance, [path])
    gradient = slopes.gradient(branch.solutions[0], HZ).by_parameters[0]
    value = scene().value(path)
    assert gradient == pytest.approx(
        (amplitude(value + step) - amplitude(value - step)) / (2.0 * step), rel=1e-4
    )
    assert found.max_abs == pytest.approx(branch.amplitude[0], rel=1e-8)
    along = solver.sweep(scene(), path, frequency_hz=HZ, start=value, stop=1.5 * value, harmonics=HARMONICS)
    assert along.amplitude[-1] == pytest.approx(amplitude(1.5 * value), rel=1e-6)


@pytest.mark.usefixtures("registered")
def test_its_limit_is_designed() -> None:
    found = optim.design(scene(), variables={"joint.limit": (0.05, 4.0)}, harmonics=5)
    assert found.reached, found.status
    best = found.optimum["joint.limit"]

    def peak(limit: float) -> float:
        return solver.sweep(scene(limit=limit), harmonics=5).peak.value

    assert found.peak.value == pytest.approx(peak(best), rel=1e-6)
    assert found.peak.value <= min(
        peak(limit) for limit in (0.8 * best, 0.98 * best, 1.02 * best, 1.3 * best)
    )


@pytest.mark.usefixtures("registered")
def test_the_plan_speaks_of_it() -> None:
    effects = {effect.name: effect for effect in solver.plan(scene()).effects}
    assert effects["law of joint"].reason == f"{SLIDERS} sliders side by side: closed form"
    assert not effects["separation of joint"].used
    assert not effects["even harmonics and mean"].used


@pytest.mark.usefixtures("registered")
def test_what_is_wrong_is_told() -> None:
    wrong = {**SCENE, "contacts": [{**SCENE["contacts"][0], "limit": -1.0, "mu": 0.3}]}
    with pytest.raises(solver.SceneError) as refused:
        solver.Scene.from_dict(wrong)
    said = {issue.pointer: issue.said() for issue in refused.value.issues}
    assert said["/contacts/0/limit"] == "`limit` must be > 0 N, got -1.0"
    assert "is not a key of a contact with the law `sliders`; known keys:" in said["/contacts/0/mu"]
    with pytest.raises(solver.SettingError, match=r"joint.limit.*must be a number > 0 and <= 1e15 \[N\]"):
        scene(limit=0.0)
    stable = solver.solve(scene(), frequency_hz=HZ, harmonics=3)
    with pytest.raises(solver.SettingError, match="joint"):
        solver.stability(stable)


def test_a_scene_knows_it_while_it_is_registered() -> None:
    with pytest.raises(
        solver.SceneError, match=r"`law` must be one of coulomb, .*hunt-crossley, got 'sliders'"
    ):
        scene()
    register(SlidersContact)
    try:
        assert scene().contacts[0].kernel == "sliders:sliders"
        with pytest.raises(ValueError, match="sliders"):
            register(SlidersContact)
    finally:
        unregister(SlidersContact)
    assert "sliders" not in laws()
    with pytest.raises(solver.SceneError):
        scene()


@pytest.mark.usefixtures("registered")
def test_the_schema_of_scenes_describes_it() -> None:
    found = scene_schema()["$defs"]["SlidersContact"]["properties"]
    assert found["limit"]["description"] == "Force at which all of it slips [N]."
    assert found["law"]["description"].endswith("dahl, coulomb-tanh, hunt-crossley or sliders.")


@pytest.mark.usefixtures("registered")
def test_the_table_of_laws_has_it() -> None:
    (line,) = (line for line in TABLES["laws.md"]["laws"]().splitlines() if "`sliders`" in line)
    assert line == f"| `sliders` | {SlidersContact.FORCE} | `k`, `limit` |"


@pytest.mark.long
@pytest.mark.usefixtures("registered")
def test_the_command_solves_it(tmp_path: Path, command: Callable[..., Any]) -> None:
    (tmp_path / "joined.json").write_text(json.dumps(SCENE))
    solved = command("solve", "joined.json", "--frequency", str(HZ), "--harmonics", "5", "--json")
    expected = solver.solve(scene(), frequency_hz=HZ, harmonics=5).max_abs
    assert solved["max_abs"] == pytest.approx(expected, rel=1e-9)


def test_the_service_computes_and_plans_it(client: Client) -> None:
    body = {"kind": "solve", "scene": SCENE, "frequency_hz": HZ, "harmonics": 5}
    job = client.wait(client.submit(body).id)
    assert job.status == "successful", job
    found = client.results(job.id).result
    assert found["contacts"] == {"joint": "stick and slip"}
    planned = client.plan({"scene": SCENE, "harmonics": 5})
    assert "law of joint" in [effect["name"] for effect in planned["effects"]]


def test_the_service_tells_its_parameters(client: Client) -> None:
    (law,) = (law for law in client.laws() if law.name == "sliders")
    assert [(one.name, one.unit) for one in law.parameters] == [("k", "N/m"), ("limit", "N")]
    limit = law.parameters[1]
    assert limit.words == "Force at which all of it slips [N]."
    assert limit.slider is not None
    assert (limit.slider.of, limit.slider.low, limit.slider.high) == ("limit", 0.05, 20.0)


def test_the_page_reads_and_previews_it(client: Client) -> None:
    assert client.read_scene(json.dumps(SCENE), "json") == {"scene": SCENE, "issues": []}
    shown = client.preview(
        {"kind": "point", "scene": SCENE, "frequency_hz": HZ, "harmonics": 5, "set": {"joint.limit": 0.4}}
    )
    register(SlidersContact)
    try:
        expected = solver.solve(scene(limit=0.4), frequency_hz=HZ, harmonics=5).max_abs
    finally:
        unregister(SlidersContact)
    assert shown["max_abs"] == pytest.approx(expected, rel=1e-9)


def test_the_service_refuses_a_bad_value(client: Client) -> None:
    wrong = {**SCENE, "contacts": [{**SCENE["contacts"][0], "k": 0.0}]}
    with pytest.raises(ServiceProblem) as refused:
        client.submit({"kind": "solve", "scene": wrong, "frequency_hz": HZ})
    assert [one["pointer"] for one in refused.value.problem["errors"]] == ["/scene/contacts/0/k"]
