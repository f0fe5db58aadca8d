"""A base that moves, against forces in absolute motion, the march, differences; forces on many DOFs."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each import each

import solver
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.errors import SceneError
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities

M, K, C = np.diag([1.0, 0.5]), np.array([[60.0, -20.0], [-20.0, 20.0]]), np.array([[0.9, -0.3], [-0.3, 0.3]])
SPRINGS = [
    {"between": ["x", "ground"], "k": 40.0, "c": 0.6, "name": "foot"},
    {"between": ["x", "y"], "k": 20.0, "c": 0.3, "name": "neck"},
]
RUB = {"name": "rub", "between": ["x", "y"], "kt": 30.0, "mu": 0.3, "N0": 1.1}
ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}


def rig(**more: Any) -> dict[str, Any]:
    return {
        "name": "rig", "structure": {"kind": "lumped", "masses": {"x": 1.0, "y": 0.5}, "springs": SPRINGS},
        "contacts": [], "excitation": {"ground": {"x": 1.0, "y": 1.0}, "amplitude": 0.7},
        "observe": {"dof": "y", "band": [0.3, 2.0]},
    } | more  # fmt: skip


def driven(**more: Any) -> dict[str, Any]:
    """The same with the ground as a DOF of its own that is driven."""
    structure = {
        "kind": "lumped", "masses": {"x": 1.0, "y": 0.5, "floor": 3.0},
        "springs": [SPRINGS[0] | {"between": ["x", "floor"]}, SPRINGS[1]],
    }  # fmt: skip
    return rig(structure=structure, excitation={"driven": {"floor": 1.0}, "amplitude": 0.7}, **more)


@each("way", [rig, driven])
@each("relative", [False, True])
@each("motion", list(ORDERS))
def test_a_moving_base_is_the_absolute_motion(way: Any, motion: str, relative: bool) -> None:
    """In absolute motion springs and dashpots to the ground push with (k + iωc) y."""
    raw = way()
    raw["excitation"]["motion"] = motion
    raw["observe"]["relative"] = relative
    omega = 2.0 * math.pi * 0.9
    y = 0.7 / (1j * omega) ** ORDERS[motion]
    x = np.linalg.solve(K + 1j * omega * C - omega**2 * M, np.array([(40.0 + 0.6j * omega) * y, 0.0]))
    scene, wanted = Scene.from_dict(raw), abs(x[1] - y * relative)
    found = solver.solve(scene, frequency_hz=0.9, harmonics=1)
    assert found.max_abs == pytest.approx(wanted, rel=1e-9)
    history = solver.time_history(found, "y")[1]
    assert np.abs(history).max() == pytest.approx(wanted, rel=1e-3)
    assert solver.march(scene, frequency_hz=0.9).max_abs == pytest.approx(wanted, rel=1e-7)


def test_with_friction_it_is_the_scene_in_absolute_motion() -> None:
    """The same forces at one frequency, written as two harmonic forces on the foot's DOF."""
    omega = 2.0 * math.pi * 0.9
    scene = Scene.from_dict(rig(contacts=[RUB], excitation={
        "ground": {"x": 1.0, "y": 1.0}, "amplitude": 0.2, "motion": "displacement"}))  # fmt: skip
    forces = [
        {"dof": "x", "amplitude": 0.2 * 40.0},
        {"dof": "x", "amplitude": 0.2 * 0.6 * omega, "phase": 0.5 * math.pi},
    ]
    absolute = Scene.from_dict(rig(contacts=[RUB], excitation=forces))
    found, wanted = (solver.solve(each, frequency_hz=0.9, harmonics=15) for each in (scene, absolute))
    assert found.contacts[0].state.value == "stick and slip"
    assert found.max_abs == pytest.approx(wanted.max_abs, rel=1e-9)
    precise = solver.solve(scene, frequency_hz=0.9, harmonics=61)
    marched = solver.march(scene, frequency_hz=0.9)
    assert precise.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=1e-6)


def test_a_sweep_over_the_frequency_and_over_the_level() -> None:
    scene = Scene.from_dict(driven(contacts=[RUB]))
    branch = solver.sweep(scene, harmonics=3)
    assert branch.reached
    assert branch.peak is not None
    at_peak = solver.solve(scene, frequency_hz=branch.peak.at, harmonics=3)
    assert branch.peak.value == pytest.approx(at_peak.max_abs, rel=1e-8)
    levels = solver.sweep(scene, "excitation.amplitude", 0.1, 1.4, frequency_hz=0.9, harmonics=3)
    assert levels.reached
    double = solver.solve(scene.with_values({"excitation.amplitude": 1.4}), frequency_hz=0.9, harmonics=3)
    assert levels.amplitude[-1] == pytest.approx(double.max_abs, rel=1e-8)


@pytest.mark.parametrize("way", [rig, driven])
def test_gradients_are_differences(way: Any) -> None:
    scene = Scene.from_dict(way(contacts=[RUB]))
    paths = ("structure.foot", "structure.neck", "rub.N0", "rub.kt", "excitation.amplitude")
    balance = build(scene, harmonics=7)
    u = Workspace.of(balance).solve(2.0 * math.pi * 0.8).u
    gradient = Sensitivities(balance, paths).gradient(u, 0.8).by_parameters
    for path, slope in zip(paths, gradient, strict=True):
        value = scene.value(path)
        high, low = (
            solver.solve(scene.with_values({path: at}), frequency_hz=0.8, harmonics=7).max_abs
            for at in ((1.0 + 1e-5) * value, (1.0 - 1e-5) * value)
        )
        assert slope == pytest.approx((high - low) / (2e-5 * value), rel=3e-6), path


@pytest.mark.parametrize("motion", list(ORDERS))
def test_driven_dofs_move_in_several_harmonics(motion: str) -> None:
    """Each harmonic of one pattern, with its own phase, against the matrices, and with friction the march."""
    entries = [
        {"driven": {"floor": -0.8}, "motion": motion, "amplitude": 0.7, "phase": 0.2},
        {"driven": {"floor": -0.8}, "motion": motion, "amplitude": 0.5, "harmonic": 3, "phase": -1.1},
    ]
    omega, turn = 2.0 * math.pi * 0.5, np.exp(2j * np.pi * np.arange(4096) / 4096)
    wanted = np.zeros(4096)
    for k, motion_of in ((1, 0.7 * np.exp(0.2j)), (3, 0.5 * np.exp(-1.1j))):
        s = 1j * k * omega
        push = np.array([(40.0 + 0.6 * s) * -0.8 * motion_of / s ** ORDERS[motion], 0.0])
        wanted += (np.linalg.solve(K + s * C + s**2 * M, push)[1] * turn**k).real
    linear = Scene.from_dict(driven() | {"excitation": entries})
    found = solver.solve(linear, frequency_hz=0.5, harmonics=3)
    history = np.asarray(solver.time_history(found, "y")[1])
    assert history == pytest.approx(
        wanted[:: 4096 // history.size], rel=1e-10, abs=1e-10 * np.abs(wanted).max()
    )
    assert found.max_abs == pytest.approx(np.abs(wanted).max(), rel=1e-6)  # the most of 4096 instants
    rubbing = Scene.from_dict(driven(contacts=[RUB]) | {"excitation": entries})
    precise, marched = (
        solver.solve(rubbing, frequency_hz=0.5, harmonics=61),
        solver.march(rubbing, frequency_hz=0.5),
    )
    assert precise.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=1e-5)


def shaken(ground: bool, **more: Any) -> dict[str, Any]:
    """Matrices with inertia between all DOFs; each harmonic has its pattern, phases and kind of motion."""
    structure = {
        "kind": "matrices", "dofs": ["x", "y", "p", "q"],
        "M": [[2.0, 0.1, 0.3, 0.1], [0.1, 1.5, 0.1, 0.2], [0.3, 0.1, 1.0, 0.1], [0.1, 0.2, 0.1, 1.0]],
        "K": [[70.0, -20.0, -30.0, 0.0], [-20.0, 60.0, 0.0, -25.0],
              [-30.0, 0.0, 80.0, 0.0], [0.0, -25.0, 0.0, 90.0]],
        "C": [[0.9, -0.2, -0.3, 0.0], [-0.2, 0.8, 0.0, -0.3], [-0.3, 0.0, 1.0, 0.0], [0.0, -0.3, 0.0, 1.0]],
        "mass_proportional_damping": 0.02,
    }  # fmt: skip
    key = "ground" if ground else "driven"
    entries = [
        {key: {"p": [1.0, 0.4], "q": [0.6, -1.9]}, "amplitude": 0.5, "phase": 0.2, "motion": "displacement"},
        {key: {"q": -0.8}, "amplitude": 0.9, "harmonic": 3, "phase": -1.1, "motion": "velocity"},
        {key: {"p": [0.7, 2.0]}, "amplitude": 1.3, "harmonic": 2},
        {"forces": {"x": 0.4, "p": 2.0}, "amplitude": 1.0, "harmonic": 2},
    ]
    return rig(structure=structure, excitation=entries, **more)


def shaken_at_random(seed: int) -> dict[str, Any]:
    """The same with patterns drawn by chance: shares of 0 and far apart, any phases, equal patterns."""
    rng = np.random.default_rng(seed)
    key, dofs = ("driven", ["p", "q"]) if seed % 2 else ("ground", ["x", "y", "p", "q"])
    entries: list[dict[str, Any]] = []
    for _ in range(rng.integers(1, 5)):
        names = rng.permutation(dofs)[: rng.integers(1, len(dofs) + 1)].tolist()
        shares = {dof: rng.choice([0.0, 1.0, -(10.0 ** rng.uniform(-6.0, 3.0))]) for dof in names}
        if entries and rng.random() < 0.3:
            shares = entries[0][key]
        elif rng.random() < 0.6:
            shares = {dof: [share, rng.choice([-7.0, 0.5 * math.pi, rng.uniform(-4.0, 4.0)])]
                      for dof, share in shares.items()}  # fmt: skip
        entries.append({
            key: shares, "amplitude": 10.0 ** rng.uniform(-4.0, 2.0), "phase": rng.uniform(-4.0, 4.0),
            "harmonic": int(rng.integers(1, 4)), "motion": str(rng.choice(list(ORDERS))),
        })  # fmt: skip
    return shaken(seed % 2 == 0) | {"excitation": entries}


def shaken_motion(raw: dict[str, Any], relative: bool, omega: float) -> np.ndarray:
    """The motion of y over a period by the matrices: driven coordinates known, the others solved for."""
    key = "driven" if any("driven" in entry for entry in raw["excitation"]) else "ground"
    structure, dofs = raw["structure"], raw["structure"]["dofs"]
    M, K, C = (np.array(structure[name]) for name in "MKC")
    C = C + structure["mass_proportional_damping"] * M
    total, turn = np.zeros(2**15), np.exp(2j * np.pi * np.arange(2**15) / 2**15)
    for k in (1, 2, 3):
        s, moved, base, force = 1j * k * omega, np.zeros(4, complex), 0.0, np.zeros(4, complex)
        for entry in raw["excitation"]:
            if entry.get("harmonic", 1) != k:
                continue
            size = entry["amplitude"] * np.exp(1j * entry.get("phase", 0.0))
            if "forces" in entry:
                force += size * np.array([entry["forces"].get(dof, 0.0) for dof in dofs])
                continue
            size /= s ** ORDERS[entry.get("motion", "acceleration")]
            base += size
            for dof, share in entry[key].items():
                factor, phase = share if isinstance(share, list) else (share, 0.0)
                moved[dofs.index(dof)] += size * factor * np.exp(1j * phase)
        Z = K + s * C + s**2 * M
        if key == "ground":
            x = np.linalg.solve(Z, force - s**2 * M @ moved) + moved * (not relative)
        else:
            named = {dof for entry in raw["excitation"] for dof in entry.get(key, ())}
            x, free = moved.copy(), np.array([dof not in named for dof in dofs])
            x[free] = np.linalg.solve(Z[np.ix_(free, free)], (force - Z[:, ~free] @ moved[~free])[free])
            x -= base * relative
        total += (x[1] * turn**k).real
    return total


@pytest.mark.parametrize("relative", [False, True])
@pytest.mark.parametrize("ground", [True, False])
def test_each_harmonic_has_its_own_pattern_and_phases(ground: bool, relative: bool) -> None:
    """Against the matrices; and with friction, where it slips, against the march, and by its powers."""
    raw = shaken(ground)
    raw["observe"] = {"dof": "y", "band": [0.3, 2.0], "relative": relative}
    scene = Scene.from_dict(raw)
    assert Scene.from_dict(scene.to_dict()) == scene
    wanted = shaken_motion(raw, relative, 2.0 * math.pi * 0.4)
    found = solver.solve(scene, frequency_hz=0.4, harmonics=3)
    history = np.asarray(solver.time_history(found, "y")[1])
    high = np.abs(wanted).max()
    assert history == pytest.approx(wanted[:: 2**15 // history.size], rel=1e-10, abs=1e-10 * high)
    assert found.max_abs == pytest.approx(high, rel=1e-7)  # the most of 32768 instants
    assert solver.march(scene, frequency_hz=0.4).max_abs == pytest.approx(found.max_abs, rel=1e-7)
    rubbing = Scene.from_dict(raw | {"contacts": [RUB | {"between": ["y", "p"]}]})
    precise = solver.solve(rubbing, frequency_hz=0.4, harmonics=61)
    assert precise.contacts[0].state.value == "stick and slip"
    marched = solver.march(rubbing, frequency_hz=0.4)
    assert precise.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=1e-5)
    assert solver.power_balance(precise).imbalance < 1e-9


@pytest.mark.parametrize("ground", [True, False])
def test_gradients_where_patterns_differ(ground: bool) -> None:
    """By the level and phase of all excitations, contact and damping; the peak of a sweep is a solution."""
    scene = Scene.from_dict(shaken(ground, contacts=[RUB | {"between": ["y", "p"]}]))
    paths = (
        "rub.N0",
        "rub.kt",
        "excitation.amplitude",
        "excitation.phase",
        "structure.mass_proportional_damping",
    )
    balance = build(scene, harmonics=7)
    u = Workspace.of(balance).solve(2.0 * math.pi * 0.8).u
    gradient = Sensitivities(balance, paths).gradient(u, 0.8).by_parameters
    for path, slope in zip(paths, gradient, strict=True):
        value = scene.value(path)
        step = 1e-5 * (value or 1.0)
        high, low = (
            solver.solve(scene.with_values({path: at}), frequency_hz=0.8, harmonics=7).max_abs
            for at in (value + step, value - step)
        )
        assert slope == pytest.approx((high - low) / (2.0 * step), rel=3e-6), path
    branch = solver.sweep(scene, harmonics=3)
    assert branch.reached
    assert branch.peak is not None
    at_peak = solver.solve(scene, frequency_hz=branch.peak.at, harmonics=3)
    assert branch.peak.value == pytest.approx(at_peak.max_abs, rel=1e-8)
    assert "contacts" in solver.plan(scene, harmonics=3).to_json()


@each("seed", range(40))
def test_random_patterns(seed: int) -> None:
    raw = shaken_at_random(seed)
    raw["observe"] = {"dof": "y", "band": [0.3, 2.0], "relative": seed % 4 > 1}
    scene = Scene.from_dict(raw)
    wanted = shaken_motion(raw, seed % 4 > 1, 2.0 * math.pi * 0.7)
    found = solver.solve(scene, frequency_hz=0.7, harmonics=3)
    history = np.asarray(solver.time_history(found, "y")[1])
    high = np.abs(wanted).max()
    assert history == pytest.approx(wanted[:: 2**15 // history.size], rel=1e-10, abs=1e-10 * high)
    assert found.max_abs == pytest.approx(high, rel=1e-7)
    assert solver.march(scene, frequency_hz=0.7).max_abs == pytest.approx(high, rel=1e-6)


def test_a_driven_dof_of_share_zero_is_held() -> None:
    entries = {"driven": {"p": 1.0, "q": 0.0}, "amplitude": 0.7, "motion": "displacement"}
    raw = shaken(False) | {"excitation": entries}
    scene = Scene.from_dict(raw)
    found = solver.solve(scene, frequency_hz=0.4, harmonics=1)
    assert np.abs(solver.time_history(found, "q")[1]).max() < 1e-12
    assert solver.march(scene, frequency_hz=0.4).max_abs == pytest.approx(found.max_abs, rel=1e-7)


def test_ground_and_driven_together_are_refused() -> None:
    entries = [{"driven": {"p": 1.0}, "amplitude": 1.0}, {"ground": {"x": 1.0}, "amplitude": 1.0}]
    with pytest.raises(SceneError, match="the ground moves or DOFs are driven, not both"):
        Scene.from_dict(shaken(False) | {"excitation": entries})


def test_a_pattern_is_the_sum_of_its_forces(tmp_path: Path) -> None:
    pattern = {"forces": {"x": [0.5, 0.3], "y": -2.0}, "amplitude": 3.0, "phase": 0.1}
    apart = [
        {"dof": "x", "amplitude": 1.5, "phase": 0.4}, {"dof": "y", "amplitude": -6.0, "phase": 0.1},
    ]  # fmt: skip
    one, two = (Scene.from_dict(rig(contacts=[RUB], excitation=each)) for each in (pattern, apart))
    found = solver.solve(one, frequency_hz=0.9, harmonics=7)
    assert found.max_abs == pytest.approx(solver.solve(two, frequency_hz=0.9, harmonics=7).max_abs, rel=1e-12)
    assert solver.march(one, frequency_hz=0.9).max_abs == pytest.approx(
        solver.march(two, frequency_hz=0.9).max_abs, rel=1e-9
    )
    assert Scene.from_dict(one.to_dict()) == one
    (tmp_path / "pressure.csv").write_text("dof, factor, phase\nx, 0.5, 0.3\ny, -2.0\n")
    file = one.to_dict()
    file["excitation"]["forces"] = "pressure.csv"  # type: ignore[index]
    (tmp_path / "rig.json").write_text(__import__("json").dumps(file))
    assert solver.load_scene(tmp_path / "rig.json") == one


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"excitation": {"amplitude": 1.0}}, "needs one of `dof`, `forces`, `ground`, `driven`, got none"),
        ({"excitation": {"dof": "x", "motion": "velocity", "amplitude": 1.0}}, "needs `ground` or `driven`"),
        ({"excitation": {"ground": {"z": 1.0}, "amplitude": 1.0}}, "there is no DOF 'z'"),
        ({"excitation": {"ground": {"x": 1.0}, "amplitude": 1.0, "harmonic": 0}}, "must be at least 1"),
        (
            {
                "excitation": {"dof": "x", "amplitude": 1.0},
                "observe": {"dof": "x", "band": [1.0, 2.0], "relative": True},
            },
            "`relative` = true needs a base",
        ),
    ],
)
def test_what_is_wrong_is_said(change: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Scene.from_dict(rig(**change))
