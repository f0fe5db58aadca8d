"""Rigid contacts: Den Hartog's closed forms, with stops and without, and `march`, by Moreau's scheme."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import stickslip
from solver.response.solution import SolutionStatus
from solver.results.known import Stable
from solver.scene.json_schema import scene_schema
from solver.scene.toml import toml_text

MASSES = {"kind": "lumped", "masses": {"x": 1.0}, "springs": [{"between": ["x", "ground"], "k": 1.0}]}
GRID = [(b, F) for b in (0.6, 0.8, 0.9, 1.1, 1.25, 1.5, 2.0) for F in (0.2, 0.4, 0.6, 0.75)]
WITH_STOPS = [(0.6, 0.6), (0.6, 0.75), (1.1, 0.75), (1.25, 0.75), (1.5, 0.75), (2.0, 0.6), (2.0, 0.75)]


def one_mass(F: float, **contact: Any) -> stickslip.Scene:
    """Mass, spring 1 N/m, force cos ωt, rigid friction of limit F."""
    rubbing = {"name": "f", "between": ["x", "ground"], "kt": math.inf, "mu": 1.0, "N0": F} | contact
    return stickslip.Scene.from_dict(
        {"name": "den-hartog", "structure": MASSES, "contacts": [rubbing],
         "excitation": {"dof": "x", "amplitude": 1.0}, "observe": {"dof": "x", "band": [0.02, 0.5]}}
    )  # fmt: skip


def without_stops(b: float, F: float) -> float:
    """Amplitude of J. P. Den Hartog, Trans. ASME APM-53-9 (1931), m = k = P = 1."""
    U = math.sin(math.pi / b) / (b * (1.0 + math.cos(math.pi / b)))
    return math.sqrt((1.0 / (1.0 - b * b)) ** 2 - (F * U) ** 2)


def with_stops(b: float, F: float) -> float:
    """Amplitude X of the motion that rests once each half period.

    At X it leaves when cos bt = X − F; then x'' + x = cos bt + F until x' = 0, where x must be −X.
    """
    c = 1.0 / (1.0 - b * b)

    def way(X: float) -> float:
        t1 = math.acos(X - F) / b
        p, q = X - F - c * math.cos(b * t1), b * c * math.sin(b * t1)

        def rate(t: Any) -> Any:
            return -p * np.sin(t - t1) + q * np.cos(t - t1) - b * c * np.sin(b * t)

        ts = np.linspace(t1, t1 + 1.001 * math.pi / b, 4001)[1:]
        back = rate(ts) >= 0.0
        (turns,) = np.nonzero(~back[:-1] & back[1:])
        if not len(turns):
            return math.nan
        t = brentq(rate, ts[turns[0]], ts[turns[0] + 1], xtol=1e-15)
        return p * math.cos(t - t1) + q * math.sin(t - t1) + c * math.cos(b * t) + F + X

    xs = np.linspace(max(1e-6, F - 1.0 + 1e-9), F + 1.0 - 1e-9, 400)
    values = [way(float(X)) for X in xs]
    i = next(
        i for i in range(399) if values[i] * values[i + 1] <= 0.0 and abs(values[i] - values[i + 1]) < 1.0
    )
    return float(brentq(way, xs[i], xs[i + 1], xtol=1e-14))


@pytest.mark.few(4)
@pytest.mark.parametrize(("b", "F"), [each for each in GRID if each not in WITH_STOPS])
def test_den_hartog_without_stops(b: float, F: float) -> None:
    found = stickslip.solve(one_mass(F), frequency_hz=b / (2.0 * math.pi))
    exact = without_stops(b, F)
    assert found.converged
    assert found.flags == ()
    assert abs(found.max_abs - exact) <= found.error_estimate <= 1e-10
    assert found.contacts[0].state.value == "stick and slip"
    assert found.stable is Stable.YES
    assert stickslip.stability(found).radius < 1.0
    # the force is F sgn(x') and its first harmonic 4 F / π
    assert math.hypot(*found.contacts[0].force[1:3]) == pytest.approx(4.0 * F / math.pi, rel=1e-11)


@pytest.mark.few(6)
@pytest.mark.parametrize(("b", "F"), WITH_STOPS)
def test_den_hartog_with_stops(b: float, F: float) -> None:
    found = stickslip.solve(one_mass(F), frequency_hz=b / (2.0 * math.pi))
    assert found.converged
    assert found.max_abs == pytest.approx(with_stops(b, F), rel=1e-10)
    assert found.error_estimate <= 1e-10


def random_scene(seed: int) -> tuple[stickslip.Scene, float]:
    """One to five masses in a chain, up to four contacts, of which the first is rigid; a frequency [Hz]."""
    rng = np.random.default_rng(seed)
    names = [f"m{i}" for i in range(int(rng.integers(1, 6)))]

    def spread(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(low, high))

    pairs = [[names[0], "ground"], *([a, b] for a, b in pairwise(names))]
    springs = [{"between": pair, "k": spread(-0.3, 0.7), "c": spread(-2.0, -0.7)} for pair in pairs]
    contacts: list[dict[str, Any]] = []
    for c in range(int(rng.integers(1, 5))):
        i = int(rng.integers(0, len(names)))
        kind = (
            str(rng.choice(["rigid", "elastic", "normal", "gap"], p=[0.5, 0.2, 0.15, 0.15])) if c else "rigid"
        )
        each: dict[str, Any] = {"name": f"c{c}", "between": [names[i], "ground"]}
        if kind == "gap":
            contacts.append(
                each | {"law": "gap", "k": spread(-1.0, 1.0), "gap": float(rng.uniform(-0.1, 0.5))}
            )
            continue
        rigid = kind == "rigid" or (kind == "normal" and rng.random() < 0.5)
        each |= {"kt": math.inf if rigid else spread(-0.5, 1.5), "mu": float(rng.uniform(0.1, 1.0))}
        each |= {"N0": float(rng.uniform(0.02, 0.6))}
        if rng.random() < 0.5:
            each |= {"N1_ratio": float(rng.uniform(0.0, 1.6)), "N1_phase": float(rng.uniform(0.0, 6.0))}
        if kind == "normal":
            each |= {
                "law": "elastic-normal",
                "kn": spread(-1.0, 0.5),
                "prestressed": bool(rng.random() < 0.5),
            }
            each |= {"normal_between": [names[int(rng.integers(0, len(names)))], "ground"]}
        contacts.append(each)
    raw = {
        "name": f"r{seed}", "contacts": contacts,
        "structure": {"kind": "lumped", "masses": {a: spread(-0.5, 0.5) for a in names}, "springs": springs},
        "excitation": {"dof": names[0], "amplitude": spread(0.3, 1.0), "phase": 1.0},
        "observe": {"dof": names[-1], "band": [0.01, 1.0]},
    }  # fmt: skip
    return stickslip.Scene.from_dict(raw), spread(-1.3, -0.3)


@pytest.mark.few(keep=[6])
@pytest.mark.parametrize("seed", range(8))
def test_random_scenes_are_what_a_march_finds(seed: int) -> None:
    """Elastic contacts, gaps, loads that vary and move beside rigid ones."""
    scene, hz = random_scene(seed)
    found = stickslip.solve(scene, frequency_hz=hz)
    marched = stickslip.march(scene, frequency_hz=hz, max_periods=400)
    assert found.converged
    near = 5e-5 + 3.0 * marched.error_estimate
    still = 1e-4 * marched.max_abs  # where all comes to rest at last, a march of 400 periods has not yet
    if "history_dependent" not in found.flags:
        assert found.half_peak_to_peak == pytest.approx(
            marched.half_peak_to_peak, rel=near, abs=still + 1e-12
        )
    if "mean_undetermined" not in found.flags:
        assert found.max_abs == pytest.approx(marched.max_abs, rel=near, abs=1e-12)
        assert found.error_estimate <= 1e-9 * found.max_abs


def test_several_masses_have_the_powers_in_balance() -> None:
    scene, hz = random_scene(4)
    found = stickslip.solve(scene, frequency_hz=hz, harmonics=200)
    assert stickslip.solutions.power_balance(found).imbalance < 1e-3


def test_parallel_contacts_are_one() -> None:
    """Loads that add up; how they share the force is in proportion to their limits."""
    both = one_mass(0.1).to_dict()
    first = both["contacts"][0]
    both["contacts"] = [first, {**first, "name": "g", "between": ["ground", "x"], "mu": 0.5, "N0": 0.6}]
    two = stickslip.solve(stickslip.Scene.from_dict(both), frequency_hz=0.13)
    one = stickslip.solve(one_mass(0.4), frequency_hz=0.13)
    assert two.max_abs == pytest.approx(one.max_abs, rel=1e-12)
    assert -two.contacts[1].force == pytest.approx(3.0 * two.contacts[0].force, rel=1e-9)
    assert two.contacts[0].force - two.contacts[1].force == pytest.approx(one.contacts[0].force, rel=1e-9)


def test_what_sticks_all_the_time_has_no_mean_of_its_own() -> None:
    found = stickslip.solve(one_mass(1.2), frequency_hz=0.1)
    assert found.converged
    assert found.max_abs == 0.0
    assert {"mean_undetermined", "all_stuck"} <= set(found.flags)
    assert found.contacts[0].utilisation == pytest.approx(1.0 / 1.2, rel=1e-3)


def test_a_mass_that_friction_alone_holds_ratchets() -> None:
    raw = one_mass(0.3).to_dict()
    raw["structure"] = {"kind": "lumped", "masses": {"x": 1.0}, "springs": []}
    raw["excitation"] = [raw["excitation"], {"dof": "x", "amplitude": 0.1, "harmonic": 0}]
    found = stickslip.solve(stickslip.Scene.from_dict(raw), frequency_hz=0.1)
    assert found.status is SolutionStatus.RATCHETS


def test_a_large_kt_comes_near_like_its_root() -> None:
    """The error of elastic friction falls with the square root of kt: 1e2, 1e4 are ten times apart."""
    exact = without_stops(1.25, 0.4)
    off = []
    for kt in (1e2, 1e4):
        found = stickslip.solve(one_mass(0.4, kt=kt), frequency_hz=1.25 / (2.0 * math.pi), harmonics=121)
        off.append(abs(found.max_abs - exact))
    assert 7.0 < off[0] / off[1] < 14.0
    assert off[1] / exact < 0.01


# Elastic scenes

CERTIFIED = json.loads((Path(__file__).parents[4] / "tests" / "data" / "certified_orbits.json").read_text())


@pytest.mark.few(3)
@pytest.mark.parametrize("case", CERTIFIED, ids=[case["id"] for case in CERTIFIED])
def test_elastic_orbits_with_proofs(case: dict[str, Any]) -> None:
    """Periodic orbits enclosed by interval arithmetic to 18 digits, with no code of this package."""
    scene = stickslip.Scene.from_dict(case["scene"])
    found = stickslip.solve(scene, frequency_hz=case["frequency_hz"], exact=True)
    assert found.status is SolutionStatus.CONVERGED
    value = getattr(found, case["measure"])
    assert value == pytest.approx(case["value"], rel=1e-11)
    assert abs(value - case["value"]) <= found.error_estimate


def test_exact_refuses_what_has_no_events() -> None:
    scene = stickslip.load_scene("bladed-disk")
    with pytest.raises(stickslip.SettingError, match="sectors"):
        stickslip.solve(scene, frequency_hz=700.0, exact=True)


# kn = inf


def pressed(kn: float, N0: float = 2.0, kt: float = math.inf) -> stickslip.Scene:
    """Two masses; y is pressed against the ground, where x rubs."""
    springs = [
        {"between": ["x", "ground"], "k": 1.0, "c": 0.05}, {"between": ["y", "ground"], "k": 2.0},
        {"between": ["x", "y"], "k": 0.7, "c": 0.02},
    ]  # fmt: skip
    contact = {
        "name": "f", "law": "elastic-normal", "between": ["x", "ground"], "normal_between": ["y", "ground"],
        "prestressed": True, "kt": kt, "kn": kn, "mu": 0.3, "N0": N0,
    }  # fmt: skip
    return stickslip.Scene.from_dict(
        {
            "name": "pressed", "contacts": [contact], "observe": {"dof": "x", "band": [0.02, 0.5]},
            "structure": {"kind": "lumped", "masses": {"x": 1.0, "y": 1.0}, "springs": springs},
            "excitation": [
                {"dof": "x", "amplitude": 1.0}, {"dof": "y", "amplitude": 0.5, "phase": 1.0}
            ],
        }
    )  # fmt: skip


@pytest.mark.parametrize("kt", [math.inf, 3.0])
def test_a_rigid_normal_contact_is_a_constraint(kt: float) -> None:
    found = stickslip.solve(pressed(math.inf, kt=kt), frequency_hz=0.12)
    marched = stickslip.march(pressed(math.inf, kt=kt), frequency_hz=0.12)
    assert found.converged
    assert marched.converged
    assert found.max_abs == pytest.approx(marched.max_abs, rel=3e-5 + 3.0 * marched.error_estimate)
    elastic = stickslip.solve(pressed(1e3, kt=kt), frequency_hz=0.12, harmonics=31)
    assert found.max_abs == pytest.approx(elastic.max_abs, rel=3e-3)
    assert np.abs(found.contacts[0].second_motion).max() < 1e-12


def test_a_rigid_normal_contact_that_opens_says_so() -> None:
    found = stickslip.solve(pressed(math.inf, N0=0.5), frequency_hz=0.12)
    assert found.status is SolutionStatus.RIGID_OPENS
    assert math.isnan(found.max_abs)
    assert "impact" in found.status.value
    assert not stickslip.march(pressed(math.inf, N0=0.5), frequency_hz=0.12).converged


# Scenes


def test_infinity_goes_through_files() -> None:
    scene = one_mass(0.4)
    assert stickslip.Scene.from_dict(json.loads(json.dumps(scene.to_dict(), allow_nan=False))) == scene
    assert one_mass(0.4, kt="inf") == scene
    import tomllib

    assert stickslip.Scene.from_dict(tomllib.loads(toml_text(scene.to_dict()))) == scene
    assert (
        stickslip.Scene.from_dict(tomllib.loads(toml_text(scene.to_dict()).replace('"inf"', "inf"))) == scene
    )
    assert scene.with_values({"f.kt": 3.0}).with_values({"f.kt": math.inf}) == scene
    assert {"const": "inf"} in scene_schema()["$defs"]["Contact"]["properties"]["kt"]["anyOf"]


@pytest.mark.parametrize("kt", [-math.inf, math.nan, "Inf.", 2e15, 0.0, None, "1"])
def test_what_is_no_stiffness_is_refused(kt: object) -> None:
    with pytest.raises(stickslip.SceneError, match="`kt`"):
        one_mass(0.4, kt=kt)


def test_laws_that_cannot_be_rigid_name_the_field() -> None:
    raw = one_mass(0.4).to_dict()
    raw["contacts"][0] |= {"law": "coulomb-2d", "between_second": ["x", "ground"]}
    with pytest.raises(stickslip.SceneError, match="kt"):
        stickslip.Scene.from_dict(raw)


def test_other_studies_refuse_by_name() -> None:
    scene = one_mass(0.4)
    for study in (
        lambda: stickslip.response_map(scene, "f.N0", 0.1, 1.0),
        lambda: stickslip.design(scene, variables={"f.N0": (0.1, 1.0)}),
        lambda: stickslip.solve_all(scene, frequency_hz=0.2),
    ):
        with pytest.raises(stickslip.SettingError, match=r"f\.kt"):
            study()


def test_a_rigid_contact_beside_another_law_is_refused() -> None:
    raw = one_mass(0.4).to_dict()
    raw["contacts"].append({"name": "p", "law": "polynomial", "between": ["x", "ground"], "a3": 1.0})
    with pytest.raises(stickslip.SettingError, match="p"):
        stickslip.solve(stickslip.Scene.from_dict(raw), frequency_hz=0.2)


def test_loops_of_rigid_contacts_are_refused() -> None:
    raw = one_mass(0.4).to_dict()
    raw["structure"]["masses"]["y"] = 1.0
    raw["structure"]["springs"].append({"between": ["y", "ground"], "k": 1.0})
    for name, between in (("g", ["x", "y"]), ("h", ["y", "ground"])):
        raw["contacts"].append({**raw["contacts"][0], "name": name, "between": between})
    with pytest.raises(stickslip.SettingError, match="loop"):
        stickslip.solve(stickslip.Scene.from_dict(raw), frequency_hz=0.2)
