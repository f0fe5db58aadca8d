"""Wear over life against closed forms, small steps with the time march, and differences."""

import math
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from each import each
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

from solver import Scene, load_scene, march
from solver.errors import SettingError
from stickslip.lab.wear_life.life import wear_life
from stickslip.lab.wear_life.life_result import WearLife, WearLifeStatus
from stickslip.lab.wear_life.mission import Mission
from stickslip.lab.wear_life.wearing import WearLaw
from tests.cases.moving_scenes import moving_scene
from tests.cases.random_scenes import random_scene

M, K, C, KT, MU, F = 1.0, 40.0, 0.3, 25.0, 0.4, 12.0
COEFFICIENT, AREA, LOSS = 1e-12, 2e-4, 4e6
FADE = 3600.0 * COEFFICIENT / AREA * LOSS  # N an hour for a watt


def _oscillator(N0: float, **law: Any) -> Scene:
    """One mass on a spring, with a damper to the ground."""
    damper = law or {"kt": KT, "mu": MU, "N0": N0}
    return Scene.from_dict(
        {
            "name": "one",
            "structure": {
                "kind": "lumped", "masses": {"x": M},
                "springs": [{"between": ["x", "ground"], "k": K, "c": C}],
            },
            "contacts": [{"name": "damper", "between": ["x", "ground"], **damper}],
            "excitation": {"dof": "x", "amplitude": F}, "observe": {"dof": "x", "band": [0.4, 2.0]},
        }
    )  # fmt: skip


def _amplitude(omega: float, N: float) -> float:
    """First-harmonic amplitude by the describing function of a Jenkins element (Caughey, 1960)."""

    def off(X: float) -> float:
        cosine = 1.0 - 2.0 * MU * N / (KT * X)
        theta = math.acos(max(cosine, -1.0)) if cosine > -1.0 else math.pi
        k = KT / math.pi * (theta - 0.5 * math.sin(2.0 * theta))
        c = KT / math.pi * math.sin(theta) ** 2
        return X * math.hypot(K + k - M * omega**2, C * omega + c) - F

    return float(brentq(off, 1e-9, 1e3, xtol=1e-15, rtol=1e-14))


def _power(omega: float, N: float) -> float:
    """4 μN (X − μN/kt) in every period."""
    return 4.0 * MU * N * (_amplitude(omega, N) - MU * N / KT) * omega / (2.0 * math.pi)


def _peak(N: float) -> tuple[float, float]:
    found = minimize_scalar(
        lambda omega: -_amplitude(omega, N), bounds=(5.0, 10.0), method="bounded", options={"xatol": 1e-9}
    )
    return float(found.x), -float(found.fun)


def _run(scene: Scene, hours: float, **more: Any) -> WearLife:
    return _life(
        scene, **{"hours": hours, "coefficient": COEFFICIENT, "area": AREA, "load_loss_per_depth": LOSS,
                  "harmonics": 1, **more}
    )  # fmt: skip


def _life(scene: Scene, **given: Any) -> WearLife:
    """A life with the keys of a request."""
    mission, wear = (
        {field.name: given.pop(field.name) for field in fields(made) if field.name in given}
        for made in (Mission, WearLaw)
    )
    return wear_life(scene, Mission(**mission), WearLaw(**wear), **given)


@pytest.mark.parametrize("hertz", [0.9, 1.05, 1.3])
def test_loads_follow_the_closed_form_at_a_fixed_frequency(hertz: float) -> None:
    omega = 2.0 * math.pi * hertz
    found = _run(_oscillator(12.0), 0.6 / FADE, frequency_hz=hertz, tolerance=1e-9)
    exact = solve_ivp(
        lambda _, N: [-FADE * _power(omega, N[0])], (0.0, found.hours[-1]), [12.0], rtol=1e-12, atol=1e-13,
        t_eval=found.hours, method="DOP853",
    )  # fmt: skip
    assert found.reached
    np.testing.assert_allclose(found.loads[0], exact.y[0], rtol=1e-8)
    np.testing.assert_allclose(found.amplitude, [_amplitude(omega, N) for N in exact.y[0]], rtol=1e-8)


def test_loads_follow_the_closed_form_at_the_peak() -> None:
    found = _run(_oscillator(12.0), 0.15 / FADE, tolerance=1e-9)
    exact = solve_ivp(
        lambda _, N: [-FADE * _power(_peak(N[0])[0], N[0])], (0.0, found.hours[-1]), [12.0], rtol=1e-10,
        atol=1e-11, t_eval=found.hours,
    )  # fmt: skip
    assert found.reached
    assert found.loads[0, -1] < 9.0
    np.testing.assert_allclose(found.loads[0], exact.y[0], rtol=1e-6)
    np.testing.assert_allclose(found.amplitude, [_peak(N)[1] for N in exact.y[0]], rtol=1e-6)


def test_small_steps_with_the_time_march_come_to_the_same() -> None:
    hertz, N = 1.1, 20.0
    found = _run(_oscillator(N), 0.15 / FADE, frequency_hz=hertz, harmonics=51, points=2)

    def power(load: float) -> float:
        period = march(_oscillator(load), frequency_hz=hertz, tolerance=1e-9)
        return _area(period.slip[0], period.contact_force[0]) * hertz

    steps = 24
    for _ in range(steps):  # midpoint steps
        step = found.hours[-1] / steps
        N -= step * FADE * power(N - 0.5 * step * FADE * power(N))
    assert found.loads[0, -1] == pytest.approx(N, rel=2e-5)
    assert N < 19.0


def _area(u: np.ndarray, f: np.ndarray) -> float:
    """Area of a loop."""
    return abs(0.5 * float(np.sum(u * np.roll(f, -1) - f * np.roll(u, -1))))


def test_a_larger_coefficient_is_a_faster_clock() -> None:
    scene = load_scene("two-dof")
    slow = _run(scene, 0.04, harmonics=5, coefficient=1e-11, points=2)
    fast = _run(scene, 0.01, harmonics=5, coefficient=4e-11, points=2)
    np.testing.assert_allclose(fast.depths, slow.depths, rtol=1e-7)
    assert fast.amplitude[-1] == pytest.approx(slow.amplitude[-1], rel=1e-8)


def _differences(value: Any, at: float, step: float) -> np.ndarray:
    """Central differences."""
    return np.asarray((value(at + step) - value(at - step)) / (2.0 * step))


def _seen(found: WearLife) -> np.ndarray:
    assert found.status in (WearLifeStatus.COMPLETED, WearLifeStatus.WORN_OUT), found.status
    return np.array([found.amplitude[-1], found.highest, *found.depths[:, -1]])


def _slopes(found: WearLife) -> np.ndarray:
    return np.concatenate([found.end_slopes[None], found.highest_slopes[None], found.depth_slopes])


@pytest.mark.parametrize(
    ("seed", "at_peak"),
    [(8, True),
     *(pytest.param(seed, True, marks=pytest.mark.long) for seed in range(8)),
     *(pytest.param(seed, False, marks=pytest.mark.long) for seed in (0, 1, 5))],
)  # fmt: skip
def test_derivatives_are_those_of_the_whole_life(seed: int, at_peak: bool) -> None:
    scene, hertz, _ = random_scene(seed)
    names = [contact.name for contact in scene.contacts]
    load = max(contact.N0 for contact in scene.contacts)
    given: dict[str, Any] = {
        "load_loss_per_depth": {name: 1e6 * load * (1.0 + 0.3 * i) for i, name in enumerate(names)},
        "stiffness_loss_per_depth": {names[0]: 2e5 * scene.contacts[0].kt}, "harmonics": 3,
        "frequency_hz": None if at_peak else hertz, "points": 2, "tolerance": 1e-9,
    }  # fmt: skip
    paths = (f"{names[0]}.N0", f"{names[-1]}.kt", "coefficient")

    def life(coefficient: float, changes: dict[str, float], hours: float, of: tuple[str, ...]) -> WearLife:
        of_contacts = {"coefficient": coefficient, "area": 1e-4, "paths": of}
        return _life(scene.with_values(changes), hours=hours, **of_contacts, **given)

    first = life(1e-15, {}, 1e-3, ())
    wears = np.abs(first.power).max()
    if wears == 0.0:
        pytest.skip("all stick")
    # A fifth of the load of what wears the fastest goes in all hours.
    sizes = np.array([given["load_loss_per_depth"][name] for name in names]) / [c.N0 for c in scene.contacts]
    coefficient, hours = 0.2 * 1e-4 / 3600.0 / (first.power[:, 0] * sizes).max(), 1.0
    found = life(coefficient, {}, hours, paths)
    slopes = _slopes(found)
    for i, path in enumerate(paths):

        def seen(value: float, path: str = path) -> np.ndarray:
            if path == "coefficient":
                return _seen(life(value, {}, hours, ()))
            return _seen(life(coefficient, {path: value}, hours, ()))

        at = coefficient if path == "coefficient" else scene.value(path)
        expected = _differences(seen, at, 1e-4 * at)
        size = np.abs(_seen(found)) / at
        np.testing.assert_allclose(slopes[:, i], expected, atol=2e-5 * size.max() + 1e-300, rtol=2e-4)


@pytest.mark.parametrize(
    ("kind", "at_peak"),
    [
        pytest.param("elastic-normal", True, marks=pytest.mark.long),
        pytest.param("circle", False, marks=pytest.mark.long),
        ("box", False),
    ],
)
def test_what_a_normal_stiffness_takes_is_differentiated_by_it(kind: str, *, at_peak: bool) -> None:
    scene, hertz = moving_scene(4, kind)
    scene = scene.with_values({"c0.N0": 1.0})
    paths = ("c0.N0", "c0.kn")

    def life(changes: dict[str, float], of: tuple[str, ...] = ()) -> WearLife:
        mission = Mission(1.0, frequency_hz=None if at_peak else hertz)
        return wear_life(
            scene.with_values(changes), mission, WearLaw({"c0": 2e-4}, {"c0": 1.0}), harmonics=3, points=2,
            tolerance=1e-9, paths=of,
        )  # fmt: skip

    found = life({}, paths)
    assert found.reached
    assert found.depths[0, -1] > 1e-3
    assert found.loads[0, -1] == pytest.approx(1.0 - scene.value("c0.kn") * found.depths[0, -1])
    slopes = _slopes(found)
    for i, path in enumerate(paths):
        at = scene.value(path)
        expected = _differences(lambda value, path=path: _seen(life({path: value})), at, 1e-4 * at)
        np.testing.assert_allclose(slopes[:, i], expected, rtol=2e-4, atol=1e-6)


def test_a_limit_exceeded_from_the_beginning_has_no_slope() -> None:
    """A little more load does not make it later: it is exceeded at 0 h still."""
    found = _run(_oscillator(12.0), 0.1 / FADE, frequency_hz=0.95, harmonics=1)
    limit = 0.9 * float(found.amplitude[0])
    run = _run(
        _oscillator(12.0), 0.1 / FADE, frequency_hz=0.95, harmonics=1, limit=limit, paths=("damper.N0",)
    )
    assert run.hours_to_limit == 0.0
    assert np.all(np.isnan(run.limit_slopes))
    assert "exceeded from the beginning" in [value for block in run.blocks() for _, value in block.pairs]


def test_the_limit_is_reached_when_the_response_says_so() -> None:
    scene = _oscillator(12.0)
    found = _run(scene, 0.6 / FADE, frequency_hz=0.95, harmonics=5, tolerance=1e-9, points=9)
    limit = float(0.5 * (found.amplitude[0] + found.amplitude[-1]))
    run = _run(
        scene, 0.6 / FADE, frequency_hz=0.95, harmonics=5, tolerance=1e-9, limit=limit, paths=("damper.N0",)
    )
    shorter = _run(scene, run.hours_to_limit, frequency_hz=0.95, harmonics=5, tolerance=1e-9)
    assert shorter.amplitude[-1] == pytest.approx(limit, rel=1e-8)

    def reached(load: float) -> float:
        there = _oscillator(load)
        return _run(
            there, 0.6 / FADE, frequency_hz=0.95, harmonics=5, tolerance=1e-9, limit=limit
        ).hours_to_limit

    assert run.limit_slopes[0] == pytest.approx((reached(12.001) - reached(11.999)) / 0.002, rel=1e-5)


def test_a_mission_of_blocks_wears_by_the_shares_of_time() -> None:
    scene = _oscillator(12.0)
    rates = [_run(scene, 1e-6 / FADE, frequency_hz=hertz).power[0, 0] for hertz in (0.9, 1.2)]
    both = _run(scene, 1e-6 / FADE, blocks=[(0.9, 3.0), (1.2, 1.0)])
    assert both.power[0, 0] == pytest.approx(0.75 * rates[0] + 0.25 * rates[1], rel=1e-12)


def test_an_open_contact_wears_no_more_and_a_given_load_that_is_gone_ends_it() -> None:
    scene = _oscillator(5.0).with_values({"damper.N1": 4.0})
    found = _run(scene, 3.0 / FADE, frequency_hz=1.05, harmonics=5)
    assert found.status is WearLifeStatus.WORN_OUT
    assert found.ended_by == "damper.N0"
    assert found.loads[0, -1] == pytest.approx(0.0, abs=1e-9)


@each(
    ("changes", "field"),
    [
        ({"hours": 0.0}, "hours"), ({"coefficient": {"no": 1e-12}}, "coefficient.no"),
        ({"coefficient": -1.0}, "coefficient"), ({"area": {"damper": 0.0}}, "area.damper"),
        ({"load_loss_per_depth": None}, "load_loss_per_depth"), ({"tolerance": 1.0}, "tolerance"),
        ({"frequency_hz": 1.0, "blocks": [(1.0, 1.0)]}, "frequency_hz"), ({"blocks": []}, "blocks"),
        ({"blocks": [(1.0, 0.0)]}, "blocks[0]"), ({"limit": 0.0}, "limit"), ({"points": 1}, "points"),
        ({"paths": ("damper.x",)}, "paths"), ({"harmonics": -1}, "harmonics"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(changes: dict[str, Any], field: str) -> None:
    given: dict[str, Any] = {
        "hours": 1.0, "coefficient": COEFFICIENT, "area": AREA, "load_loss_per_depth": LOSS, **changes
    }  # fmt: skip
    with pytest.raises(SettingError) as error:
        _life(_oscillator(5.0), **given)
    assert error.value.name == field


def test_rigid_contacts_and_structures_without_friction_are_refused() -> None:
    with pytest.raises(SettingError, match="contacts with friction"):
        _run(_oscillator(5.0).model_copy(update={"contacts": ()}), 1.0)
    with pytest.raises(SettingError, match="load_loss_per_depth"):
        _run(_oscillator(5.0, law="dahl", sigma=25.0, limit=2.0), 1.0, load_loss_per_depth=None)


@pytest.mark.few(keep=("shroud-3d",))
@pytest.mark.parametrize("name", ["platform-wedge", "shroud-3d"])
def test_faces_of_a_shape_wear_by_their_normal_stiffness(name: str) -> None:
    scene = load_scene(name)
    group = scene.contacts[0].group
    given: dict[str, Any] = {
        "harmonics": 3, "frequency_hz": 0.5 * sum(scene.observe.band), "points": 3,
        "coefficient": {group: 1e-14}, "area": {group: 1e-5},
    }  # fmt: skip
    rate = _life(scene, hours=1e-9, **given).depths[:, -1].max() / 1e-9
    found = _life(scene, hours=1e-7 / rate, **given)
    kn = np.array([contact.value_of("kn") for contact in scene.contacts])
    loads = np.array([contact.value_of("N0") for contact in scene.contacts])
    assert found.reached
    assert 1e-8 < found.depths[:, -1].max() < 1e-6
    np.testing.assert_allclose(found.loads[:, -1], loads - kn * found.depths[:, -1], rtol=1e-12)


def test_a_life_that_is_stopped_has_what_was_followed() -> None:
    scene, asked = _oscillator(12.0), iter([False] * 3 + [True] * 100)
    at_once = _run(scene, 0.1 / FADE, should_stop=lambda: True)
    assert at_once.status is WearLifeStatus.STOPPED
    assert at_once.hours.size == 0
    later = _run(scene, 0.1 / FADE, frequency_hz=1.0, should_stop=lambda: next(asked))
    assert later.status is WearLifeStatus.STOPPED
    assert 0.0 < later.hours[-1] < 0.1 / FADE
    assert math.isnan(at_once.highest)


@pytest.mark.parametrize(
    "running", [pytest.param({}, marks=pytest.mark.long), {"frequency_hz": 1.05}], ids=["peak", "frequency"]
)
def test_margin_1_is_reached_when_the_stress_of_the_amplitude_is(running: dict[str, float]) -> None:
    """Of a motion without a mean the stress is a factor times the amplitude, and its limit an amplitude."""
    plain = _oscillator(30.0)
    wear, mission = (
        WearLaw({"damper": COEFFICIENT}, {"damper": AREA}, {"damper": LOSS}),
        Mission(6.0, **running),
    )
    life = wear_life(plain, mission, wear, harmonics=3, points=5, paths=("damper.N0",))
    assert life.amplitude[-1] > 1.02 * life.amplitude[0]
    limit = 0.5 * float(life.amplitude[0] + life.amplitude[-1])
    goodman, static = 500.0, 100.0  # MPa: a fifth of the fatigue strength goes to the static stress
    strength = 2e8 * limit / (1.0 - static / goodman) * 1e-6
    judged = Scene.from_dict(
        plain.to_dict()
        | {
            "recovery": [
                {"name": "root", "unit": "MPa", "terms": {"x": 200.0}, "static": static, "material": "steel"}
            ],
            "materials": [
                {"name": "steel", "fatigue_strength": strength * 1e6, "ultimate_strength": goodman * 1e6}
            ],
        }
    )
    found = wear_life(judged, mission, wear, limit=limit, harmonics=3, points=5, paths=("damper.N0",))
    assert found.used == pytest.approx(found.amplitude / limit, rel=1e-8)
    assert found.hours_to_margin == pytest.approx(found.hours_to_limit, rel=1e-7)
    assert found.margin_slopes[0] == pytest.approx(found.limit_slopes[0], rel=1e-6)
    assert np.isnan(life.used).all()
    assert math.isnan(life.hours_to_margin)
