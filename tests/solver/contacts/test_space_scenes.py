"""Scenes with the law coulomb-3d beside the reference values, time marching and their own limits."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import solver
from solver.contacts.laws.coulomb_3d import SpaceContact
from solver.contacts.pieces.circle import force_in_space, path_in_space
from solver.errors import SceneError
from solver.jit import fourier

CASES: dict[str, Any] = json.loads(
    (Path(__file__).parents[2] / "data" / "three_d.json").read_text(encoding="utf-8")
)["cases"]


def table(name: str = "circle-1.1", **contact: object) -> dict[str, Any]:
    """A scene of the reference with other keys in its contact; None leaves a key out."""
    scene = copy.deepcopy(CASES[name]["scene"])
    given = {**scene["contacts"][0], **contact}
    scene["contacts"] = [{key: value for key, value in given.items() if value is not None}]
    return scene


def observed(scene: dict[str, Any], dof: str) -> solver.Scene:
    return solver.Scene.from_dict({**scene, "observe": {**scene["observe"], "dof": dof}})


def random_scene(seed: int, *, limit: str, moves: bool) -> tuple[solver.Scene, float]:
    """A scene in space near a resonance, often with separation or little slip."""
    rng = np.random.default_rng(seed)
    scene = table(limit=limit)
    contact = scene["contacts"][0]
    contact |= {
        "kt": 10.0 ** rng.uniform(1.0, 2.5), "kt_second": 10.0 ** rng.uniform(1.0, 2.5),
        "mu": rng.uniform(0.1, 0.8), "N0": 10.0 ** rng.uniform(0.5, 2.3), "N1": rng.uniform(0.0, 60.0),
        "N1_phase": rng.uniform(-3.0, 3.0), "kn": 10.0 ** rng.uniform(1.0, 2.5),
        "prestressed": bool(rng.integers(2)),
    }  # fmt: skip
    if not moves:
        for key in ("kn", "normal_between", "prestressed"):
            del contact[key]
    scene["excitation"] = [
        {"dof": dof, "amplitude": rng.uniform(10.0, 100.0), "phase": rng.uniform(-3.0, 3.0)} for dof in "xyz"
    ]
    return solver.Scene.from_dict(scene), float(rng.uniform(0.9, 1.6))


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("dof", ["x", "y", "z"])
def test_reference_is_reached(name: str, dof: str) -> None:
    case = CASES[name]
    found = solver.solve(observed(case["scene"], dof), frequency_hz=case["frequency_hz"], harmonics=61)
    at = case["dofs"].index(dof)
    assert found.converged
    assert found.half_peak_to_peak == pytest.approx(case["half_pp"][at], rel=1e-5)
    assert found.mean == pytest.approx(case["mean"][at], abs=1e-5 * case["half_pp"][at])
    (wear,) = solver.contact_wear(found).values()
    assert wear.work.value == pytest.approx(case["work"], rel=1e-4)
    shares = found.scene.contacts[0].shares(np.array(found.contacts[0].motions), found.contacts[0].load)
    assert shares is not None
    # The shares of the reference are counted at steps of its integration: one case adds up to 1.005.
    assert shares.slip == pytest.approx(case["share"]["slip"], abs=6e-3)


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("limit", ["circle", "box"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_random_scenes_beside_time_marching(seed: int, limit: str, moves: bool) -> None:
    scene, at = random_scene(seed, limit=limit, moves=moves)
    found = solver.solve(scene, frequency_hz=at, harmonics=21)
    marched = solver.march(scene, frequency_hz=at)
    assert found.converged
    assert found.error_estimate is not None
    allowed = max(10.0 * found.error_estimate, 1e-7) * found.max_abs
    assert marched.max_abs == pytest.approx(found.max_abs, abs=allowed)


@pytest.mark.parametrize("moves", [False, True])
def test_force_over_time_has_the_coefficients_of_the_balance(moves: bool) -> None:
    scene, at = random_scene(5, limit="circle", moves=moves)
    found = solver.solve(scene, frequency_hz=at, harmonics=9)
    contact, response = scene.contacts[0], found.contacts[0]
    assert isinstance(contact, SpaceContact)
    motions = np.array(response.motions)
    path = path_in_space(contact.friction, motions, response.load)
    n = 40_000
    force = force_in_space(path, np.linspace(0.0, 2.0 * np.pi, n, endpoint=False))
    for here, kept in zip(force, response.forces, strict=False):
        lines = np.fft.rfft(here)[: found.n_harmonics + 1] / n * np.r_[1.0, np.full(found.n_harmonics, 2.0)]
        assert fourier.to_real(lines) == pytest.approx(kept, abs=1e-7 * np.abs(kept).max())


def test_second_stiffness_follows_the_first_where_it_is_left_out() -> None:
    scene = solver.Scene.from_dict(table())
    stiffer = scene.with_values({"rub.kt": 45.0})
    written = scene.with_values({"rub.kt": 45.0, "rub.kt_second": 45.0})
    answers = [solver.solve(each, frequency_hz=1.1, harmonics=5).half_peak_to_peak
               for each in (stiffer, written)]  # fmt: skip
    assert answers[0] == answers[1]
    branch = solver.sweep(scene, parameter="rub.kt", start=30.0, stop=45.0, frequency_hz=1.1, harmonics=5)
    assert branch.half_peak_to_peak[-1] == pytest.approx(answers[0], rel=1e-9)


def test_one_direction_in_the_box_is_the_rubbing_contact() -> None:
    """Nothing moves along y, which is pressed on a spring of its own."""
    scene = table(limit="box")
    scene["excitation"] = scene["excitation"][:1]
    scene["structure"]["springs"] = [
        spring for spring in scene["structure"]["springs"]
        if "y" not in spring["between"] or "ground" in spring["between"]
    ]  # fmt: skip
    line = copy.deepcopy(scene)
    line["contacts"][0] = {
        key: value for key, value in scene["contacts"][0].items() if key not in ("between_second", "limit")
    } | {"law": "elastic-normal"}
    both = [solver.solve(solver.Scene.from_dict(each), frequency_hz=1.1) for each in (scene, line)]
    assert both[0].half_peak_to_peak == pytest.approx(both[1].half_peak_to_peak, rel=1e-10)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"kn": None}, "`kn` of contact `rub` is missing"),
        ({"normal_between": None}, "`normal_between` of contact `rub` is missing"),
        ({"normal_between": None, "kn": None, "N0": -1.0, "prestressed": None}, "`N0` of contact `rub`"),
        ({"normal_between": None, "kn": None, "prestressed": True}, "`prestressed` of contact `rub`"),
        ({"limit": "square"}, "limit"),
        ({"kt_second": 0.0}, "kt_second"),
    ],
)
def test_what_does_not_fit_is_named(changed: dict[str, object], said: str) -> None:
    with pytest.raises(SceneError, match=said):
        solver.Scene.from_dict(table(**changed))
