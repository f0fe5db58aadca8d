"""Mistuned disks and standing waves: the whole annulus against one sector, time marching and symmetries."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each import each
from mistuned_cases import VALUES, disk, with_mistuning
from scene_cases import bladed_disk, two_dof

from solver import (
    BranchStatus,
    ContinuationSettings,
    Scene,
    SceneError,
    SettingError,
    annulus,
    blade_amplitudes,
    blade_peaks,
    load_scene,
    march,
    mistuned,
    motion,
    plan,
    sectors_needed,
    solve,
    sweep,
)
from solver.jit.fourier import to_complex
from solver.linear.assembly import linear_model
from solver.response.contact_response import ContactState
from solver.scene.cyclic.annulus import written_out


@each("order", [0, 1, 3, 4, 5, 7, 8, 11])
def test_without_spread_it_is_one_sector(order: int):
    """Also for orders beyond half the number of sectors, which run backward, and beyond the number itself."""
    raw = bladed_disk().to_dict()
    raw["excitation"]["engine_order"] = order  # type: ignore[index]
    scene = Scene.from_dict(raw)
    one = solve(scene, frequency_hz=755.0, harmonics=5)
    whole = solve(mistuned(scene, of=["tip_middle", "tip"], spread=0.0), frequency_hz=755.0, harmonics=5)
    assert one.converged
    assert whole.converged
    assert whole.max_abs == pytest.approx(one.max_abs, rel=1e-9)
    every = blade_amplitudes(whole)
    np.testing.assert_allclose(every.max_abs, one.max_abs, rtol=1e-9)
    np.testing.assert_allclose(every.half_peak_to_peak, one.half_peak_to_peak, rtol=1e-9)
    np.testing.assert_allclose(blade_amplitudes(one).max_abs, one.max_abs, rtol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_a_backward_wave_is_the_order_that_is_left(order: int):
    """The forces of order -i and of sectors - i are the same on every blade."""
    forward, backward = annulus(disk(order)), annulus(disk(6 - order))
    turns = [np.array([f.phase - 0.4 for f in scene.excitation]) for scene in (forward, backward)]
    np.testing.assert_allclose(np.exp(1j * turns[0]), np.exp(-1j * turns[1]), atol=1e-14)


LIGHT = {"shroud.N0": 6.0, "shroud.N1": 2.0, "platform.N0": 5.0}


@pytest.mark.parametrize(
    ("scene", "frequency_hz", "all_slip"),
    [
        (mistuned(disk().with_values(LIGHT), of="root", values=VALUES), 3.3, True),
        (mistuned(disk(), of="root", values=VALUES), 3.4, False),
        (mistuned(disk(5, N1=40.0), of=["blade", "shaft"], values=VALUES), 3.3, False),
        (disk(2, "standing"), 3.5, False),
        (with_mistuning(disk(1, "standing").with_values(LIGHT), of=["root"], spread=0.05), 3.2, False),
    ],
    ids=["all slip", "springs", "masses and separation", "standing", "standing and mistuned"],
)
def test_against_time_marching(scene: Scene, frequency_hz: float, all_slip: bool):
    """Contacts that stick all the time keep a mean that depends on the way there."""
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=31)
    marched = march(scene, frequency_hz=frequency_hz)
    assert solution.converged
    assert marched.converged
    states = {contact.state for contact in solution.contacts}
    assert states - {ContactState.STUCK}
    assert solution.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=2e-6)
    assert all_slip == (ContactState.STUCK not in states)
    if all_slip:
        assert solution.max_abs == pytest.approx(marched.max_abs, rel=2e-6)


@pytest.mark.parametrize("turn", [1, 4])
def test_a_turned_pattern_turns_the_answer(turn: int):
    first, turned = (
        blade_amplitudes(
            solve(mistuned(disk(1), of="root", values=values), frequency_hz=3.4, harmonics=7), dof
        )
        for values, dof in ((VALUES, None), (tuple(np.roll(VALUES, turn).tolist()), "blade"))
    )
    assert np.ptp(first.max_abs) > 0.05 * first.largest
    np.testing.assert_allclose(turned.max_abs, np.roll(first.max_abs, turn), rtol=1e-8)
    assert turned.worst == (first.worst + turn) % 6
    assert turned.largest == pytest.approx(first.largest, rel=1e-9)


def test_the_mirror_image_runs_the_other_way():
    """Blade j becomes blade -j, the shroud before it the one behind it."""
    mirrored = tuple(VALUES[-j % 6] for j in range(6))
    scene = disk(2)
    image = disk(4, N1_phase=0.6 - 2 * 2 * math.pi / 6)
    one, other = (
        blade_amplitudes(solve(mistuned(s, of="root", values=v), frequency_hz=3.4, harmonics=7)).max_abs
        for s, v in ((scene, VALUES), (image, mirrored))
    )
    np.testing.assert_allclose(other, one[[-j % 6 for j in range(6)]], rtol=1e-8)


def test_blades_that_nothing_joins_may_change_places():
    raw = disk(0).to_dict()
    del raw["structure"]["springs"][1]  # type: ignore[index]
    del raw["contacts"][0]  # type: ignore[attr-defined]
    scene, order = Scene.from_dict(raw), [3, 0, 5, 1, 4, 2]
    one, other = (
        blade_amplitudes(solve(mistuned(scene, of="root", values=v), frequency_hz=3.0)).max_abs
        for v in (VALUES, [VALUES[i] for i in order])
    )
    assert np.ptp(one) > 0.01 * one.max()
    np.testing.assert_allclose(other, one[order], rtol=1e-9)


def test_standing_is_half_the_sum_of_both_waves():
    """As long as nothing slips."""
    stuck = {"N0": 1e6, "N1": 0.0}
    raw = disk(2, "standing", **stuck).to_dict()
    raw["contacts"][1]["N0"] = 1e6  # type: ignore[index]
    standing = motion(solve(Scene.from_dict(raw), frequency_hz=3.4, harmonics=3))
    waves = 0.0
    for order in (2, 4):
        raw["excitation"] |= {"engine_order": order, "pattern": "travelling"}  # type: ignore[operator]
        waves = waves + 0.5 * motion(solve(annulus(Scene.from_dict(raw)), frequency_hz=3.4, harmonics=3))
    np.testing.assert_allclose(standing[:, 1:3], waves[:, 1:3], atol=1e-9 * np.abs(standing).max())


@pytest.mark.parametrize("order", [0, 3, 6, 9])
def test_a_standing_wave_in_phase_or_antiphase_is_a_travelling_one(order: int):
    travelling, standing = disk(order), disk(order, "standing")
    assert sectors_needed(standing).sectors == 1
    one, whole = (
        solve(scene, frequency_hz=3.4, harmonics=5).max_abs for scene in (travelling, annulus(standing))
    )
    assert whole == pytest.approx(one, rel=1e-8)


def test_a_standing_wave_with_friction_is_no_sum_of_waves():
    solution = solve(disk(1, "standing"), frequency_hz=3.4, harmonics=5)
    amplitudes = blade_amplitudes(solution).max_abs
    np.testing.assert_allclose(amplitudes[:3], amplitudes[3:], rtol=1e-8)
    assert np.ptp(amplitudes) > 0.2 * amplitudes.max()
    assert [contact.load[1:].tolist() == [0.0, 0.0] for contact in solution.contacts[::2]] == [False] * 6


def test_nodes_of_a_standing_wave_are_exactly_still():
    whole = annulus(disk(1, "standing", sectors=8))
    assert [force.amplitude == 0.0 for force in whole.excitation] == [j % 4 == 2 for j in range(8)]
    assert [c.N1_value == 0.0 for c in whole.contacts[::2]] == [j % 4 == 2 for j in range(8)]
    assert {force.phase for force in whole.excitation} == {0.4}


@pytest.mark.parametrize(
    ("scene", "sectors", "says"),
    [
        (disk(), 1, "one sector stands for all 6"),
        (with_mistuning(disk(), of=["root"], spread=0.0), 1, "tuned"),
        (with_mistuning(disk(), of=["root"], values=[1.0] * 6), 1, "tuned"),
        (with_mistuning(disk(), of=["root"], values=list(VALUES)), 6, "from 0.95 to 1.06"),
        (disk(2, "standing"), 6, "standing wave of engine order 2"),
        (disk(2, "travelling"), 1, "travelling wave of engine order 2"),
        (two_dof(), 1, "lumped"),
    ],
)
def test_sectors_needed(scene: Scene, sectors: int, says: str):
    extent = sectors_needed(scene)
    assert extent.sectors == sectors
    assert says in extent.reason
    solved = written_out(scene)
    assert solved.name == scene.name
    assert len(solved.contacts) == len(scene.contacts) * sectors
    assert plan(scene, harmonics=3).unknowns == 7 * len(scene.contacts) * sectors


def test_a_scene_file_says_it_too(tmp_path: Path):
    scene = load_scene("bladed-disk")
    text = (Path(__file__).parents[3] / "solver" / "scene" / "shipped" / "bladed-disk.toml").read_text()
    table = '\n[structure.mistuning]\nof = ["tip_middle", "tip"]\nspread = 0.03\nseed = 5\n\n[[contacts]]'
    file = tmp_path / "disk.toml"
    file.write_text(text.replace("\n[[contacts]]", table, 1))
    read = load_scene(file)
    assert annulus(read) == mistuned(scene, of=["tip_middle", "tip"], spread=0.03, seed=5)
    assert Scene.from_dict(read.to_dict()) == read
    solution = solve(read, frequency_hz=755.0, harmonics=3)
    assert solution.scene.name == "bladed-disk"
    assert len(solution.contacts) == 16
    assert linear_model(read).K0.shape == (32, 32)


def test_factors_can_be_had_again():
    whole = mistuned(disk(), of="root", spread=0.02, seed=1)
    drawn = 1.0 + 0.02 * np.random.Generator(np.random.PCG64(1)).standard_normal(6)
    factors = [whole.value(f"structure.root@{j}") / 400.0 for j in range(6)]
    np.testing.assert_allclose(factors, drawn, rtol=1e-15)
    assert mistuned(disk(), of="root", spread=0.02, seed=1) == whole
    assert mistuned(disk(), of="root", spread=0.02, seed=2) != whole


def test_what_is_mistuned():
    whole = mistuned(disk(), of=["root", "drag", "blade_mass", "hub"], values=VALUES)
    first = [whole.structure.masses[2 * j].m for j in range(6)]
    assert first == pytest.approx(VALUES)
    assert [whole.structure.masses[2 * j + 1].m / 3.0 for j in range(6)] == pytest.approx(VALUES)
    assert [d.c / 0.2 for d in whole.structure.dampers] == pytest.approx(VALUES)
    springs = whole.structure.springs
    assert [s.k / 400.0 for s in springs[::3]] == pytest.approx(VALUES)
    assert {s.c for s in springs[::3]} == {1.5}
    assert {s.k for s in springs[1::3]} == {300.0}


def test_an_observed_blade():
    raw = disk(2).to_dict()
    raw["observe"]["dof"] = "blade@4"  # type: ignore[index]
    chosen = with_mistuning(Scene.from_dict(raw), of=["root"], values=VALUES)
    solution = solve(chosen, frequency_hz=3.4, harmonics=7)
    every = blade_amplitudes(solution)
    assert solution.max_abs == pytest.approx(every.max_abs[4], rel=1e-12)
    assert solution.max_abs != pytest.approx(every.max_abs[0], rel=1e-3)
    tuned = solve(Scene.from_dict(raw), frequency_hz=3.4, harmonics=7)
    assert tuned.max_abs == pytest.approx(solve(disk(2), frequency_hz=3.4, harmonics=7).max_abs, rel=1e-9)
    assert every.magnification(tuned) == every.largest / tuned.max_abs
    assert every.magnification(blade_amplitudes(tuned)) == pytest.approx(every.magnification(tuned))
    assert 1.0 < every.magnification(tuned) < 1.5


def test_the_hub_moves_too():
    solution = solve(mistuned(disk(), of="root", values=VALUES), frequency_hz=3.4, harmonics=5)
    tau = np.linspace(0.0, 2.0 * np.pi, 4000)
    turning = np.exp(1j * np.outer(np.arange(6), tau))
    histories = (to_complex(motion(solution)) @ turning).real[1::2]
    found = blade_amplitudes(solution, "hub")
    np.testing.assert_allclose(np.abs(histories).max(axis=1), found.max_abs, rtol=1e-5)
    np.testing.assert_allclose(0.5 * np.ptp(histories, axis=1), found.half_peak_to_peak, rtol=1e-5)


@pytest.mark.parametrize("written", [False, True], ids=["cyclic", "annulus"])
def test_peaks_of_every_blade(written: bool):
    light = disk(2).with_values(LIGHT)
    scene = with_mistuning(light, of=["root"], values=VALUES)
    found = blade_peaks(annulus(scene) if written else scene, 2.8, 3.8, harmonics=3)
    tuned = blade_peaks(light, 2.8, 3.8, harmonics=3)
    assert found.value.shape == tuned.value.shape == (6,)
    assert np.ptp(tuned.value) == 0.0
    assert np.ptp(found.value) > 0.01 * found.largest
    assert found.magnification(tuned) == found.value.max() / tuned.value[0]
    assert all(status is BranchStatus.COMPLETED for status in found.status)
    at_worst = blade_amplitudes(solve(scene, frequency_hz=found.at_hz[found.worst], harmonics=3))
    assert at_worst.max_abs[found.worst] == pytest.approx(found.largest, rel=1e-6)
    for frequency_hz in np.linspace(2.8, 3.8, 12):
        every = blade_amplitudes(solve(scene, frequency_hz=float(frequency_hz), harmonics=3))
        assert np.all(every.max_abs <= found.value * (1.0 + 1e-6))


@pytest.mark.few(3)
@pytest.mark.parametrize("written", [False, True], ids=["cyclic", "annulus"])
@pytest.mark.parametrize("every_branch", [False, True], ids=["one branch", "every branch"])
def test_one_sweep_gives_the_same_peaks_as_one_for_each_blade(written: bool, every_branch: bool):
    scene = with_mistuning(disk(2).with_values(LIGHT), of=["root"], values=VALUES)
    scene = annulus(scene) if written else scene
    found = blade_peaks(scene, 2.8, 3.8, harmonics=5, every_branch=every_branch)
    assert len(found.branches) == (6 if every_branch else 1)
    worst = found.worst_branch
    assert worst is not None
    assert worst.peak is not None
    assert worst.peak.value == pytest.approx(found.largest, rel=1e-12)
    for sector in range(6):
        observe = scene.observe.model_copy(update={"dof": f"blade@{sector}"})
        alone = sweep(scene.model_copy(update={"observe": observe}), start=2.8, stop=3.8, harmonics=5).peak
        assert alone is not None
        assert found.value[sector] == pytest.approx(alone.value, rel=1e-9)
        assert found.at_hz[sector] == pytest.approx(alone.at, rel=1e-9)


@pytest.mark.few(3)
@pytest.mark.parametrize("seed", range(3))
def test_no_blade_moves_more_anywhere_than_at_its_highest_peak(seed: int):
    """Random disks with contacts that slip little or much, against single solutions all over the band."""
    rng = np.random.default_rng(seed)
    raw: dict[str, Any] = load_scene("bladed-disk").to_dict()
    raw["structure"] |= {
        "sectors": 4,
        "stiffness_proportional_damping": float(10.0 ** rng.uniform(-6.5, -5.5)),
    }
    raw["contacts"][0] |= {
        "N0": float(10.0 ** rng.uniform(0.0, 3.0)),
        "N1_ratio": float(rng.uniform(0.0, 0.8)),
    }
    raw["contacts"][1]["N0"] = float(10.0 ** rng.uniform(1.0, 4.0))
    raw["excitation"]["engine_order"] = int(rng.integers(0, 4))
    scene = mistuned(Scene.from_dict(raw), of=("tip_middle", "tip"), spread=0.03, seed=seed)
    peaks = blade_peaks(scene, harmonics=3, every_branch=False)
    beside = (peaks.at_hz[:, None] + np.linspace(-0.5, 0.5, 5)).ravel()
    places = np.concatenate([np.linspace(500.0, 900.0, 41), beside[(beside > 500.0) & (beside < 900.0)]])
    found = [solve(scene, frequency_hz=float(at), harmonics=3) for at in places]
    assert all(one.converged for one in found)
    highest = np.max([blade_amplitudes(one).max_abs for one in found], axis=0)
    np.testing.assert_allclose(highest, peaks.value, rtol=1e-9)
    assert np.all(highest <= peaks.value * (1.0 + 1e-9))
    assert peaks.highest.peaks_open == ()


def test_stopped_between_two_blades():
    scene = with_mistuning(disk(2).with_values(LIGHT), of=["root"], values=VALUES)
    done: list[int] = []
    found = blade_peaks(
        scene, 2.8, 3.8, harmonics=3, should_stop=lambda: bool(done) and done[-1] == 2,
        on_progress=lambda _share, blades: done.append(blades),
    )  # fmt: skip
    assert np.isfinite(found.value).tolist() == [True] * 3 + [False] * 3
    assert found.status[2:4] == (BranchStatus.COMPLETED, BranchStatus.STOPPED)
    assert len(found.branches) == 3
    assert math.isnan(found.largest)


def test_peaks_that_were_not_reached():
    cut = ContinuationSettings(most_points=5)
    found = blade_peaks(disk(), harmonics=1, settings=cut)
    assert math.isnan(found.largest)
    assert set(found.status) == {BranchStatus.TOO_MANY_POINTS}
    with pytest.raises(SettingError, match="did you mean `blade`"):
        blade_peaks(disk(), dof="blad")


def test_sweeps_and_groups():
    scene = with_mistuning(disk(), of=["root"], values=VALUES)
    branch = sweep(scene, start=3.0, stop=3.8, harmonics=3)
    assert branch.reached
    assert branch.peak is not None
    point = solve(scene, frequency_hz=branch.peak.at, harmonics=3)
    assert point.max_abs == pytest.approx(branch.peak.value, rel=1e-8)
    loads = sweep(scene, "shroud.N0", 20.0, 40.0, frequency_hz=3.4, harmonics=3)
    heavier = solve(scene.with_values({"shroud.N0": 40.0}), frequency_hz=3.4, harmonics=3)
    assert loads.amplitude[-1] == pytest.approx(heavier.max_abs, rel=1e-8)


@pytest.mark.parametrize(
    ("scene", "path"),
    [
        (with_mistuning(disk(), of=["root"], values=VALUES), "shroud.N1_phase"),
        (disk(1, "standing"), "shroud.N1"),
        (disk(1, "standing"), "shroud.N1_ratio"),
    ],
)
def test_what_differs_from_sector_to_sector_is_not_continued_in(scene: Scene, path: str):
    with pytest.raises(SettingError, match="differs from sector to sector"):
        sweep(scene, path, 0.1, 0.2, frequency_hz=3.4)


@each(
    ("table", "pointer", "says"),
    [
        ({"of": ["root"]}, "", "needs `spread` .* or `values`, got neither"),
        ({"of": ["root"], "spread": 0.1, "values": [1.0] * 6}, "", "exclude each other.*spread = 0.1"),
        ({"of": ["root"], "seed": 1, "values": [1.0] * 6}, "", "exclude each other.*seed = 1"),
        (
            {"of": ["rot"], "spread": 0.1},
            "/of/0",
            "no spring, damper, mass or DOF 'rot'.*did you mean `root`",
        ),
        ({"of": ["root", "root"], "spread": 0.1}, "/of/1", "'root' twice"),
        ({"of": [], "spread": 0.1}, "/of", "must not be empty"),
        ({"spread": 0.1}, "/of", "`of` is missing: mistuning needs it"),
        ({"of": ["root"], "values": [1.0] * 5}, "/values", "each of the 6 sectors, got 5"),
        ({"of": ["root"], "values": [1.0] * 5 + [0.0]}, "/values/5", "must be > 0, got 0.0"),
        ({"of": ["root"], "spread": -0.1}, "/spread", ">= 0, got -0.1"),
        ({"of": ["root"], "spread": 3.0, "seed": 1}, "/spread", "which must be > 0"),
        ({"of": ["root"], "spread": 0.1, "seed": 1.5}, "/seed", "whole number"),
        ({"of": ["root"], "spred": 0.1}, "/spred", "did you mean `spread`"),
    ],
)
def test_bad_mistuning_is_named(table: dict[str, Any], pointer: str, says: str):
    with pytest.raises(SceneError, match=says) as caught:
        with_mistuning(disk(), **table)
    assert f"/structure/mistuning{pointer}" in [issue.pointer for issue in caught.value.issues]


@pytest.mark.parametrize(
    ("excitation", "says"),
    [
        ({"pattern": "running"}, "'travelling' or 'standing'"),
        ([{"pattern": "standing"}, {"pattern": "travelling"}], "same everywhere, got 'travelling' after"),
    ],
)
def test_bad_patterns_are_named(excitation: Any, says: str):
    raw = disk().to_dict()
    force: Any = raw["excitation"]
    rows = excitation if isinstance(excitation, list) else [excitation]
    raw["excitation"] = [{**force, **row} for row in rows]
    with pytest.raises(SceneError, match=says):
        Scene.from_dict(raw)


def test_what_needs_a_disk():
    raw = two_dof().to_dict()
    raw["excitation"]["pattern"] = "standing"  # type: ignore[index]
    with pytest.raises(SceneError, match="`pattern` = 'standing' needs a cyclic structure"):
        Scene.from_dict(raw)
    with pytest.raises(SettingError, match="must have a cyclic structure to be mistuned"):
        mistuned(two_dof(), of="k1")
    with pytest.raises(SettingError, match="`dof` must be a DOF of every sector"):
        blade_amplitudes(solve(two_dof(), frequency_hz=1.0), "m2")
    with pytest.raises(SettingError, match="did you mean `blade`"):
        blade_amplitudes(solve(disk(), frequency_hz=3.0, harmonics=1), "blad")


@pytest.mark.parametrize("dof", ["blade@6", "blade@", "blad@1", "blade@next", "@1"])
def test_observed_blades_that_are_not_there(dof: str):
    raw = disk().to_dict()
    raw["observe"]["dof"] = dof  # type: ignore[index]
    with pytest.raises(SceneError, match="dof"):
        Scene.from_dict(raw)
