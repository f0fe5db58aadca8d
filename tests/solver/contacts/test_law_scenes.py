"""Scenes with every contact law: reading, the balance against time marching, continuation through folds."""

import math
from typing import Any

import numpy as np
import pytest
from each import each
from law_scene_cases import CUBIC, GAP, PLANE, RUB, cyclic, scene

from solver import annulus, hysteresis_loop, march, plan, power_balance, solve, sweep
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.errors import SceneError, SettingError
from solver.jit import fourier
from solver.scene.scene import GapSpring, PolynomialSpring, Scene


def issues(**contact: Any) -> dict[str, str]:
    with pytest.raises(SceneError) as error:
        scene(contact)
    return {issue.pointer: issue.said() for issue in error.value.issues}


def test_scenes_are_written_and_read_again():
    whole = scene(
        RUB, PLANE, {**PLANE, "limit": "box", "samples": 64}, GAP, CUBIC, {"kt": 1.0, "mu": 0.2, "N0": 1.0}
    )
    assert Scene.from_dict(whole.to_dict()) == whole
    assert [len(contact.pairs) for contact in whole.contacts] == [2, 2, 2, 1, 1, 1]
    assert isinstance(whole.contacts[3], GapSpring)
    assert isinstance(whole.contacts[4], PolynomialSpring)
    assert whole.contacts[4].coefficients[:4] == (0.2, 0.1, 1.0, 0.0)
    assert "law" not in whole.to_dict()["contacts"][5]  # type: ignore[index]


def test_mistakes_are_named():
    assert "did you mean `gap`?" in issues(law="gapp")["/contacts/0/law"]
    assert "must be >= 0 N/m, got -1.0" in issues(**{**GAP, "k": -1.0})["/contacts/0/k"]
    assert "a contact with the law `gap` needs it" in issues(law="gap", k=1.0)["/contacts/0/gap"]
    assert (
        "`kt` = 1.0 is not a key of a contact with the law `gap`" in issues(**GAP, kt=1.0)["/contacts/0/kt"]
    )
    assert "at least one coefficient" in issues(law="polynomial")["/contacts/0"]
    wrong = issues(**{**RUB, "normal_between": ["w", "ground"]})["/contacts/0/normal_between/0"]
    assert wrong.startswith("`normal_between`: there is no DOF 'w'")
    same = issues(**{**PLANE, "between_second": ["v", "v"]})["/contacts/0/between_second"]
    assert "two different ends" in same
    assert "`limit`" in issues(**PLANE, limit="round")["/contacts/0/limit"]
    assert "exclude each other" in issues(**RUB, N1=1.0, N1_ratio=1.0)["/contacts/0"]


def test_parameter_paths_follow_the_law():
    whole = scene({**GAP, "group": "all"}, {**CUBIC, "group": "all"}, RUB)
    paths = whole.parameter_paths()
    assert {"c0.k", "c0.gap", "all.gap", "all.a9", "c2.kn", "c2.N0"} <= set(paths)
    assert not {"c0.kt", "c1.k", "c2.gap"} & set(paths)
    changed = whole.with_values({"all.gap": 0.5, "c1.a5": 2.0, "c2.N0": -3.0})
    assert changed.value("c0.gap") == 0.5
    assert changed.value("c1.a5") == 2.0
    assert changed.value("c1.a4") == 0.0
    assert changed.value("c2.N0") == -3.0
    with pytest.raises(SettingError, match=r"c0\.kt"):
        whole.with_values({"c0.kt": 1.0})
    with pytest.raises(SettingError, match="must be a number > 0"):
        whole.with_values({"c2.kn": 0.0})


EVERY = scene(RUB, PLANE, {**PLANE, "limit": "box", "N1": 0.5}, GAP, CUBIC)


@each(
    "path",
    ["frequency", "excitation.amplitude", "c0.kn", "c0.kt", "c0.mu", "c0.N0", "c0.N1", "c0.N1_ratio", "c1.kt",
     "c1.mu", "c1.N0", "c1.N1", "c2.kt", "c2.N1_phase", "c3.k", "c3.gap", "c4.a1", "c4.a2", "c4.a3", "c4.a7"],
)  # fmt: skip
def test_balance_derivatives_by_every_parameter(path: str):
    balance = build(EVERY, path, harmonics=4, frequency_hz=0.2 if path != "frequency" else None)
    workspace = Workspace.of(balance)
    start = Workspace.of(build(EVERY, harmonics=4)).solve(0.2 * 2.0 * math.pi)
    assert start.converged
    p = balance.parameter.inside(0.2 if path == "frequency" else EVERY.value(path))
    step = 1e-6 * max(abs(p), 1.0)

    def residual(x: float) -> np.ndarray:
        return workspace.evaluate(start.u, x)[1].residual.copy()

    exact = workspace.evaluate(start.u, p)[1].dr_dp.copy()
    difference = (residual(p + step) - residual(p - step)) / (2.0 * step)
    np.testing.assert_allclose(exact, difference, atol=2e-6 * np.abs(difference).max())


def test_balance_jacobian_with_every_law():
    workspace = Workspace.of(build(EVERY, harmonics=4))
    omega = 0.2 * 2.0 * math.pi
    found = workspace.solve(omega)
    assert found.converged
    exact = workspace.evaluate(found.u, omega)[1].jacobian.copy()
    for i in range(found.u.size):
        step = np.zeros(found.u.size)
        step[i] = 1e-6
        both = [workspace.evaluate(found.u + sign * step, omega)[1].residual.copy() for sign in (1.0, -1.0)]
        np.testing.assert_allclose(exact[:, i], (both[0] - both[1]) / 2e-6, atol=2e-5)


@each(
    ("contact", "harmonics", "frequency", "accuracy"),
    [
        (GAP, 31, 0.13, 2e-6),
        ({**GAP, "gap": -0.3}, 31, 0.2, 2e-6),
        (CUBIC, 15, 0.2, 1e-8),
        ({"law": "polynomial", "a3": 2.0, "a5": -0.1}, 21, 0.13, 1e-7),
        (RUB, 41, 0.2, 1e-5),
        ({**RUB, "N0": -0.1, "N1": 0.3, "N1_phase": 0.5}, 41, 0.2, 1e-5),
        ({**RUB, "prestressed": True, "N0": 0.6}, 41, 0.15, 1e-5),
        ({**RUB, "mu": 0.0}, 41, 0.2, 1e-5),
        ({**PLANE, "limit": "box", "N1_ratio": 0.4}, 41, 0.2, 1e-5),
    ],
)
def test_balance_against_time_marching(
    contact: dict[str, Any], harmonics: int, frequency: float, accuracy: float
):
    law = scene(contact)
    balance, referee = (
        solve(law, frequency_hz=frequency, harmonics=harmonics),
        march(law, frequency_hz=frequency),
    )
    assert balance.converged
    assert referee.converged
    assert balance.max_abs == pytest.approx(referee.max_abs, rel=accuracy)
    assert balance.mean == pytest.approx(referee.mean, abs=accuracy * referee.max_abs)


def test_a_preload_in_equilibrium_moves_nothing_at_rest():
    """Without excitation a prestressed contact stays at rest; the whole reaction pushes the parts apart."""
    at_rest = solve(scene({**RUB, "prestressed": True}, amplitude=0.0), frequency_hz=0.2, harmonics=3)
    assert at_rest.max_abs == pytest.approx(0.0, abs=1e-14)
    pushed = solve(scene(RUB, amplitude=0.0), frequency_hz=0.2, harmonics=3).contacts[0]
    assert pushed.second_motion is not None
    # v is held by 1.6 and, through u with 1 + kt, by 0.4; N = N0 + kn v opens the pair by N.
    held = 1.6 + 0.4 * 3.0 / 3.4
    assert pushed.second_motion[0] == pytest.approx(-0.2 / (held + 1.5), rel=1e-9)


def test_circular_limit_with_motion_in_one_direction_is_coulomb():
    line = scene(PLANE, second=0.0).to_dict()
    line["structure"]["springs"] = line["structure"]["springs"][:2]  # type: ignore[index]
    alone = {key: PLANE[key] for key in ("kt", "mu", "N0")}
    plain = {**line, "contacts": [{"name": "c0", "between": ["u", "ground"], **alone}]}
    circle = solve(Scene.from_dict(line), frequency_hz=0.17, harmonics=9)
    exact = solve(Scene.from_dict(plain), frequency_hz=0.17, harmonics=9)
    assert circle.max_abs == pytest.approx(exact.max_abs, rel=2e-5)


def test_circle_holds_less_than_the_box():
    """In both directions at once the circle's limit is reached earlier, so it dissipates at a lower force."""
    circle = solve(scene(PLANE), frequency_hz=0.2, harmonics=7)
    box = solve(scene({**PLANE, "limit": "box"}), frequency_hz=0.2, harmonics=7)
    assert circle.converged
    sizes = [
        max(np.abs(c.force).max(), np.abs(c.second_force).max())
        for c in (circle.contacts[0], box.contacts[0])
    ]
    assert sizes[0] < sizes[1]


@pytest.mark.parametrize("contact", [GAP, CUBIC, RUB, PLANE, {**PLANE, "limit": "box"}])
def test_power_and_loops(contact: dict[str, Any]):
    """What is put in is taken out, to rounding; the loop has the Fourier coefficients of the force."""
    solution = solve(scene(contact), frequency_hz=0.2, harmonics=9)
    assert solution.converged
    powers = power_balance(solution)
    assert powers.imbalance < 1e-9
    if contact in (GAP, CUBIC):
        assert abs(powers.friction_w) < 1e-12 * powers.input_w
    else:
        assert powers.friction_w > 0.01 * powers.input_w
    slip, force = hysteresis_loop(solution, "c0", samples=4096)
    spectrum = np.fft.rfft(force)[:10] * 2.0 / force.size
    spectrum[0] *= 0.5
    kept = solution.contacts[0].force
    np.testing.assert_allclose(fourier.to_real(spectrum), kept, atol=2e-4 * np.abs(kept).max())
    assert np.abs(slip).max() == pytest.approx(solution.max_abs, rel=1e-4)


def duffing(c: float = 0.05, a3: float = 0.5, force: float = 0.3) -> Scene:
    return Scene.from_dict(
        {
            "name": "duffing",
            "structure": {
                "kind": "lumped",
                "masses": {"x": 1.0},
                "springs": [{"between": ["x", "ground"], "k": 1.0, "c": c}],
            },
            "contacts": [{"name": "cubic", "law": "polynomial", "between": ["x", "ground"], "a3": a3}],
            "excitation": {"dof": "x", "amplitude": force},
            "observe": {"dof": "x", "band": [0.05, 0.5]},
        }
    )


@pytest.mark.parametrize("way", [1, -1])
def test_duffing_with_one_harmonic_is_its_formula(way: int):
    """((1 - ω² + ¾ a3 A²)² + (c ω)²) A² = F² on every point, over both folds, from either side."""
    ends = (0.08, 0.5)[::way]
    branch = sweep(duffing(), parameter="frequency", start=ends[0], stop=ends[1], harmonics=1)
    assert branch.reached
    assert branch.folds == 2
    A, omega = branch.amplitude, 2.0 * np.pi * branch.values
    left = np.hypot(1.0 - omega**2 + 0.375 * A**2, 0.05 * omega) * A
    np.testing.assert_allclose(left, 0.3, rtol=1e-9)


def test_the_peak_of_duffing_with_one_harmonic():
    """∂/∂ω = 0 at a fixed A: the highest amplitude is where 1 - ω² + ¾ a3 A² = c²/2."""
    branch = sweep(duffing(), parameter="frequency", start=0.5, stop=0.08, harmonics=1)
    assert branch.peak is not None
    A, omega = branch.peak.value, 2.0 * np.pi * branch.peak.at
    assert 1.0 - omega**2 + 0.375 * A**2 == pytest.approx(0.05**2 / 2.0, abs=1e-6)


@pytest.mark.parametrize(
    ("contact", "path", "start", "stop"),
    [
        (GAP, "c0.gap", -0.5, 1.5),
        (GAP, "c0.k", 0.0, 20.0),
        (CUBIC, "c0.a3", 0.1, 3.0),
        (RUB, "c0.kn", 0.5, 5.0),
        (RUB, "c0.N0", -1.0, 2.0),
        (PLANE, "c0.mu", 0.2, 1.0),
    ],
)
def test_continuation_in_a_law_s_own_parameter(contact: dict[str, Any], path: str, start: float, stop: float):
    law = scene(contact)
    branch = sweep(law, parameter=path, start=start, stop=stop, frequency_hz=0.16, harmonics=7)
    assert branch.reached
    assert branch.residuals.max() < 1e-9
    for i in (len(branch.values) // 3, -1):
        value = float(branch.values[i])
        alone = solve(law.with_values({path: value}), frequency_hz=0.16, harmonics=7)
        assert alone.max_abs == pytest.approx(branch.amplitude[i], rel=1e-7)


def test_a_gap_bends_the_peak_over():
    """A stiff stop near a resonance: the branch turns back and forth, and both ways give the same peak."""
    stop = scene({**GAP, "k": 30.0, "gap": 1.0}, amplitude=0.4)
    both = [
        sweep(stop, parameter="frequency", start=a, stop=b, harmonics=9) for a, b in ((0.1, 0.5), (0.5, 0.1))
    ]
    assert all(branch.reached for branch in both)
    assert all(branch.folds >= 2 for branch in both)
    assert both[0].peak is not None
    assert both[1].peak is not None
    assert both[0].peak.value == pytest.approx(both[1].peak.value, rel=1e-8)


@pytest.mark.parametrize(
    "contact",
    [
        {**RUB, "normal_between": ["v@next", "v"], "N1": 0.2},
        {**PLANE, "between_second": ["v", "v@next"]},
        {**PLANE, "between_second": ["v", "v@next"], "limit": "box"},
        GAP,
        CUBIC,
    ],
)
def test_one_sector_stands_for_the_annulus(contact: dict[str, Any]):
    ring = cyclic(contact)
    one = solve(ring, frequency_hz=0.2, harmonics=5)
    whole = solve(annulus(ring), frequency_hz=0.2, harmonics=5)
    assert one.converged
    assert one.max_abs == pytest.approx(whole.max_abs, rel=1e-7)


def test_plan_names_the_law():
    reasons = " ".join(effect.reason for effect in plan(EVERY).effects)
    for words in ("moves with the parts", "circular limit", "two contacts", "one side", "polynomial"):
        assert words in reasons
    assert build(duffing(), harmonics=4).system.ks.tolist() == [0, 1, 2, 3, 4]
    assert build(scene(CUBIC), harmonics=3).system.ks.tolist() == [0, 1, 2, 3]
    assert build(duffing(), "cubic.a2", harmonics=3, frequency_hz=0.2).system.ks.tolist() == [0, 1, 2, 3]


def test_a_circular_limit_is_marched_and_its_samples_of_old_are_left_aside():
    exact = solve(scene(PLANE), frequency_hz=0.2, harmonics=31)
    old = scene({**PLANE, "samples": 2048})
    assert march(old, frequency_hz=0.2).max_abs == pytest.approx(exact.max_abs, rel=1e-5)
    assert solve(old, frequency_hz=0.2, harmonics=31).max_abs == exact.max_abs
