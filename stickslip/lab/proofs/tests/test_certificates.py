"""Certificates: orbits proved elsewhere, random scenes, spoilt certificates, what cannot be proved."""

from __future__ import annotations

import copy
import json
import math
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from certified_scenes import random_scene

import stickslip
from service.cli import main
from service.jobs.studies.design_study import Design
from service.jobs.studies.peaks_study import Peaks
from service.jobs.study import Watch
from stickslip.lab.proofs import checker

CERTIFIED = json.loads((Path(__file__).parents[4] / "tests" / "data" / "certified_orbits.json").read_text())


@pytest.fixture(scope="module")
def proved() -> dict[str, Any]:
    """A certificate of two masses with a damper under a load that varies."""
    found = stickslip.certify(stickslip.solve(stickslip.load_scene("two-dof"), frequency_hz=1.2))
    assert found.certificate is not None
    return json.loads(json.dumps(found.certificate))  # type: ignore[no-any-return]


@pytest.mark.few(4)
@pytest.mark.parametrize("case", CERTIFIED, ids=[case["id"] for case in CERTIFIED])
def test_orbits_with_proofs_are_proved_again(case: dict[str, Any]) -> None:
    """Periodic orbits enclosed by interval arithmetic to 18 digits, with no code of this package."""
    scene = stickslip.Scene.from_dict(case["scene"])
    found = stickslip.certify(stickslip.solve(scene, frequency_hz=case["frequency_hz"], harmonics=31))
    assert found.reached, found.reason
    low, high = getattr(found, case["measure"])
    assert low <= case["value"] <= high
    assert high - low <= 1e-15 * high


def share_proved(seeds: range) -> float:
    """Prove the responses of random scenes; each enclosure must hold an exact orbit found by floats."""
    count = 0
    for seed in seeds:
        scene, hz = random_scene(seed)
        found = stickslip.certify(stickslip.solve(scene, frequency_hz=hz, harmonics=21))
        count += found.reached
        if found.reached:
            low, high = found.half_peak_to_peak
            assert high - low <= 1e-15 * high
    return count / len(seeds)


def test_random_scenes_are_proved() -> None:
    assert share_proved(range(4)) >= 0.75


@pytest.mark.long
def test_95_of_100_random_scenes_are_proved() -> None:
    assert share_proved(range(500)) >= 0.95


def test_the_enclosure_holds_what_a_march_finds() -> None:
    scene = stickslip.load_scene("two-dof")
    low, high = stickslip.certify(stickslip.solve(scene, frequency_hz=1.2)).max_abs
    marched = stickslip.march(scene, frequency_hz=1.2)
    assert marched.max_abs == pytest.approx(low, abs=marched.error_estimate + 1e-9)
    assert high - low <= 1e-15 * high


# The checker


def test_the_checker_stands_alone(proved: dict[str, Any], tmp_path: Path) -> None:
    script, file = tmp_path / "alone.py", tmp_path / "certificate.json"
    script.write_text(Path(checker.__file__).read_text(encoding="utf-8"), encoding="utf-8")
    file.write_text(json.dumps(proved), encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, "-I", str(script), str(file)], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    assert "accepted" in ended.stdout
    proved = proved | {"claims": {"max_abs": ["1.8", "1.81"]}}
    file.write_text(json.dumps(proved), encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, "-I", str(script), str(file)], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert "not within" in ended.stderr


def _numbers(found: Any, place: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the places of all numbers that are neither 0 nor whole ones, which stand for places."""
    if isinstance(found, dict):
        return [each for key, value in found.items() for each in _numbers(value, (*place, key))]
    if isinstance(found, list):
        return [each for i, value in enumerate(found) for each in _numbers(value, (*place, i))]
    return [place] if isinstance(found, float) and found else []


def _spoilt(raw: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return a certificate with one thing wrong."""
    raw = copy.deepcopy(raw)
    orbit, unknowns, way = raw["orbit"], raw["proof"]["unknowns"], int(rng.integers(5))
    if way == 0:  # a number of the system or of where the orbit begins
        places = [each for each in _numbers(raw) if each[0] in ("system", "orbit")]
        *path, last = places[int(rng.integers(len(places)))]
        holder: Any = raw
        for key in path:
            holder = holder[key]
        holder[last] *= 1.0 + float(10.0 ** rng.uniform(-12.0, -1.0)) * float(rng.choice([-1.0, 1.0]))
    elif way == 1:  # the order of events
        i = int(rng.integers(len(orbit["events"]) - 1))
        orbit["events"][i : i + 2] = orbit["events"][i : i + 2][::-1]
    elif way == 2:  # an unknown beside its box
        i = int(rng.integers(len(unknowns)))
        middle, radius = unknowns[i].split(" +/- ")
        unknowns[i] = f"{float(middle) * (1.0 + 1e-9)!r} +/- {radius}"
    elif way == 3:  # boxes too small
        for i, each in enumerate(unknowns):
            middle, radius = each.split(" +/- ")
            unknowns[i] = f"{middle} +/- {float(radius) * 1e-20!r}"
    else:  # claims that are narrower, or elsewhere
        key = str(rng.choice(list(raw["claims"])))
        low, high = map(float, raw["claims"][key])
        moved = 1e-12 * abs(high) * float(rng.choice([-1.0, 1.0]))
        raw["claims"][key] = [repr(low + moved), repr(high + moved)]
    return raw


def test_spoilt_certificates_are_rejected(proved: dict[str, Any]) -> None:
    rng = np.random.default_rng(7)
    checker.check(proved)
    for _ in range(100):
        with pytest.raises(checker.RejectedError):
            checker.check(_spoilt(proved, rng))


def test_many_events_are_proved_with_states_that_are_unknown_anew() -> None:
    """36 events with 128 bits; a state that is unknown anew is as little to be changed as the first."""
    scene, hz = random_scene(38)
    near = stickslip.solve(scene, frequency_hz=hz, harmonics=21)
    found = stickslip.certify(near)
    assert found.reached, found.reason
    assert (found.events, found.bits) == (36, 128)
    assert abs(near.max_abs - found.max_abs[0]) <= near.error_estimate
    raw = json.loads(json.dumps(found.certificate))
    checker.check(raw)
    middle, radius = raw["proof"]["unknowns"][-3].split(" +/- ")
    raw["proof"]["unknowns"][-3] = f"{float(middle) + 1e-9!r} +/- {radius}"
    with pytest.raises(checker.RejectedError):
        checker.check(raw)
    anew = [each for each in raw["orbit"]["events"] if each.pop("anew", False)]
    assert anew
    with pytest.raises(checker.RejectedError, match="unknowns"):
        checker.check(raw)


def test_products_of_floats_are_bounded() -> None:
    """Against rational numbers, of sizes from 1e-100 to 1e100, of long sums that cancel."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        a, b = (
            checker.Rough(rng.normal(size=size) * 10.0 ** rng.integers(-100, 100), None)
            for size in ((2, 30), (30, 2))
        )
        product, less = a @ b, a - checker.Rough(a.middle * (1.0 + 1e-15))
        for i, k in np.ndindex(2, 2):
            true = sum(Fraction(x) * Fraction(y) for x, y in zip(a.middle[i], b.middle[:, k], strict=True))
            assert abs(true - Fraction(product.middle[i, k])) <= Fraction(product.off[i, k])
            true = Fraction(a.middle[i, k]) - Fraction(a.middle[i, k] * (1.0 + 1e-15))
            assert abs(true - Fraction(less.middle[i, k])) <= Fraction(less.off[i, k])


@pytest.mark.parametrize(("beta", "count"), [(0.8, 2), (1.5, 2)])
def test_rigid_friction_is_proved_as_den_hartog_has_it(beta: float, count: int) -> None:
    """x0² = (1 / (1 - β²))² - (F U)² for P = k = m = 1, U = sin(π/β) / (β (1 + cos(π/β)))."""
    limit, angle = 0.2, np.pi / beta
    scene = stickslip.Scene.from_dict({
        "name": "rigid", "structure": {"kind": "lumped", "masses": {"x": 1.0},
            "springs": [{"between": ["x", "ground"], "k": 1.0}]},
        "contacts": [{"name": "f", "law": "coulomb", "between": ["x", "ground"], "kt": "inf", "mu": 1.0,
                      "N0": limit}],
        "excitation": [{"dof": "x", "amplitude": 1.0}], "observe": {"dof": "x", "band": [0.1, 0.3]},
    })  # fmt: skip
    found = stickslip.certify(stickslip.solve(scene, frequency_hz=beta / (2.0 * np.pi)))
    assert found.reached, found.reason
    assert found.events == count
    U = np.sin(angle) / (beta * (1.0 + np.cos(angle)))
    assert found.max_abs[0] == pytest.approx(
        np.sqrt((1.0 / (1.0 - beta**2)) ** 2 - (limit * U) ** 2), rel=1e-12
    )


def test_rigid_friction_that_sticks_is_proved_and_a_force_beyond_its_limit_is_not() -> None:
    """Two masses, one with rigid friction under a load that varies; a very stiff spring is near that."""

    def scene(kt: Any) -> stickslip.Scene:
        return stickslip.load_scene("two-dof").with_values({"damper.kt": kt, "damper.N0": 80.0})

    found, near = (stickslip.certify(stickslip.solve(scene(kt), frequency_hz=1.2)) for kt in (math.inf, 1e5))
    assert found.reached, found.reason
    assert found.max_abs[0] == pytest.approx(near.max_abs[0], rel=2e-3)
    raw = json.loads(json.dumps(found.certificate))
    checker.check(raw)
    assert "stick" in [each["to"] for each in raw["orbit"]["events"]]
    raw["system"]["contacts"][0]["mu"] *= 0.999
    with pytest.raises(checker.RejectedError):
        checker.check(raw)


# What cannot be proved, and what is proved of what is not determined


def test_what_sticks_all_the_time_is_named() -> None:
    scene = stickslip.load_scene("two-dof").with_values({"damper.N0": 2000.0})
    found = stickslip.certify(stickslip.solve(scene, frequency_hz=1.2))
    assert found.reached, found.reason
    assert found.held == ("damper",)
    assert found.events == 0


def test_what_has_no_place_in_a_proof_is_refused() -> None:
    scene = stickslip.load_scene("two-dof")
    found = stickslip.solve(scene, frequency_hz=1.2)
    with pytest.raises(stickslip.SettingError, match="path of a load"):
        stickslip.certify(found, least_over="damper.kt")


@pytest.mark.long
def test_a_disk_is_proved_of_the_disk_written_out() -> None:
    """Its enclosure holds what the balance of one sector says, within the error it estimates."""
    found = stickslip.solve(stickslip.load_scene("bladed-disk"), frequency_hz=700.0, harmonics=21)
    proof = stickslip.certify(found)
    assert proof.reached, proof.reason
    assert proof.max_abs[1] - proof.max_abs[0] <= 1e-15 * proof.max_abs[1]
    assert abs(found.max_abs - proof.max_abs[0]) <= found.error_estimate


# Peaks


@pytest.fixture(scope="module")
def peak() -> stickslip.Certificate:
    """The peak of two masses with a damper, from a balance that is a little beside it."""
    branch = stickslip.sweep(stickslip.load_scene("two-dof"))
    assert branch.peak is not None
    found = stickslip.solve(stickslip.load_scene("two-dof"), frequency_hz=branch.peak.at)
    return stickslip.certify(found, peak=True)


def test_a_peak_is_proved_and_marches_lie_below_it(peak: stickslip.Certificate) -> None:
    assert peak.reached, peak.reason
    (low, high), (before, after) = peak.max_abs, peak.frequency_hz
    assert high - low <= 1e-15 * high
    assert after - before <= 1e-15 * after
    scene = stickslip.load_scene("two-dof")
    for share in (1.0 - 1e-3, 1.0, 1.0 + 1e-3):
        marched = stickslip.march(scene, frequency_hz=share * before)
        assert marched.max_abs <= high + marched.error_estimate + 1e-8
    assert stickslip.march(scene, frequency_hz=before).max_abs == pytest.approx(low, rel=1e-7)


@pytest.mark.parametrize("count", [24, pytest.param(100, marks=pytest.mark.long)])
def test_spoilt_certificates_of_peaks_are_rejected(peak: stickslip.Certificate, count: int) -> None:
    assert peak.certificate is not None
    raw, rng = json.loads(json.dumps(peak.certificate)), np.random.default_rng(3)
    checker.check(raw)
    for i in range(count):
        with pytest.raises(checker.RejectedError):
            checker.check(_spoilt_peak(raw, i, rng))


def _spoilt_peak(raw: dict[str, Any], i: int, rng: np.random.Generator) -> dict[str, Any]:
    """Return a certificate of a peak with one thing wrong."""
    raw = copy.deepcopy(raw)
    three = raw["proof"]["three"]
    if i % 4 == 0:  # a number of the system
        places = [each for each in _numbers(raw) if each[0] == "system" and each[1] != "frequency_hz"]
        *path, last = places[int(rng.integers(len(places)))]
        holder: Any = raw
        for key in path:
            holder = holder[key]
        holder[last] *= 1.0 + float(10.0 ** rng.uniform(-12.0, -1.0))
    elif i % 4 == 1:  # two of the orbits that are compared
        one, other = rng.choice([0, 1, 2], size=2, replace=False).tolist()
        three[one], three[other] = three[other], three[one]
    elif i % 4 == 2:  # an unknown beside its box
        unknowns = [raw["proof"]["over"], *three][int(rng.integers(4))]["unknowns"]
        k = int(rng.integers(len(unknowns)))
        middle, radius = unknowns[k].split(" +/- ")
        unknowns[k] = f"{float(middle) * (1.0 + 1e-9)!r} +/- {radius}"
    else:  # a claim that is elsewhere
        key = ("peak", "frequency_hz")[int(rng.integers(2))]
        low, high = map(float, raw["claims"][key])
        moved = 1e-12 * high * float(rng.choice([-1.0, 1.0]))
        raw["claims"][key] = [repr(low + moved), repr(high + moved)]
    return raw


def _ring(contacts: list[dict[str, Any]], phases: tuple[float, ...]) -> stickslip.Scene:
    """Masses in a ring, each on a spring of its own, with forces of these phases."""
    names = [f"x{i}" for i in range(len(phases))]
    springs = [{"between": [one, "ground"], "k": 1.0, "c": 0.05} for one in names]
    springs += [
        {"between": [one, other], "k": 0.3, "c": 0.01}
        for one, other in zip(names, [*names[1:], names[0]], strict=True)
    ]
    return stickslip.Scene.from_dict({
        "name": "ring",
        "structure": {"kind": "lumped", "masses": dict.fromkeys(names, 1.0), "springs": springs},
        "contacts": contacts, "observe": {"dof": "x0", "band": [0.1, 0.3]},
        "excitation": [
            {"dof": one, "amplitude": 1.0, "phase": phase} for one, phase in zip(names, phases, strict=True)
        ],
    })  # fmt: skip


def test_opposite_blades_that_slip_at_one_instant_are_proved() -> None:
    """By symmetry they are apart by the rounding of their phases alone: floats have the order by chance."""
    dampers = [
        {"name": f"f{i}", "law": "coulomb", "between": [f"x{i}", "ground"], "kt": 0.8, "mu": 0.5, "N0": 0.5}
        for i in range(4)
    ]
    scene = _ring(dampers, tuple(0.5 * np.pi * i for i in range(4)))
    near = stickslip.solve(scene, frequency_hz=0.19, harmonics=61)
    found = stickslip.certify(near)
    assert found.reached, found.reason
    assert found.events == 16
    assert abs(near.max_abs - found.max_abs[0]) <= near.error_estimate


@pytest.mark.parametrize("between", [["x0", "x1"], ["x1", "x0"]])
def test_contacts_that_are_alike_turn_together(between: list[str]) -> None:
    """Two in parallel, one told the other way round, are as one of twice the stiffness and the load."""
    one = {"name": "f", "law": "coulomb", "between": ["x0", "x1"], "kt": 0.8, "mu": 0.5, "N0": 0.5}
    phases = (0.0, 2.0)
    pair = _ring([one, one | {"name": "g", "between": between}], phases)
    single = _ring([one | {"kt": 1.6, "N0": 1.0}], phases)
    found, other = (stickslip.certify(stickslip.solve(each, frequency_hz=0.25)) for each in (pair, single))
    assert found.reached, found.reason
    assert found.events == 2 * other.events
    low, high = other.max_abs
    assert low <= found.max_abs[1]
    assert found.max_abs[0] <= high
    raw = json.loads(json.dumps(found.certificate))
    checker.check(raw)
    raw["system"]["contacts"][1]["mu"] *= 1.0 + 1e-14
    with pytest.raises(checker.RejectedError, match="need not be at one instant"):
        checker.check(raw)


def test_what_friction_alone_holds_is_proved() -> None:
    """Its place is arbitrary, and only some forces of what sticks balance: one of them is an unknown."""
    between = ["x0", "x1"], ["x1", "x2"]
    scene = stickslip.Scene.from_dict({
        "name": "afloat", "structure": {"kind": "lumped", "masses": dict.fromkeys(("x0", "x1", "x2"), 1.0),
            "springs": [
                {"between": [one, "ground"], "k": k, "c": 0.05} for one, k in (("x0", 1.0), ("x2", 1.3))
            ],
        },
        "contacts": [
            {"name": each[0], "law": "coulomb", "between": each, "kt": 0.8, "mu": 0.5, "N0": 2.0}
            for each in between
        ],
        "excitation": [{"dof": "x0", "amplitude": 0.3}], "observe": {"dof": "x0", "band": [0.1, 0.3]},
    })  # fmt: skip
    near = stickslip.solve(scene, frequency_hz=0.13)
    found = stickslip.certify(near)
    assert found.reached, found.reason
    low, high = found.half_peak_to_peak
    assert low * (1.0 - 1e-9) <= near.half_peak_to_peak <= high * (1.0 + 1e-9)
    raw = json.loads(json.dumps(found.certificate))
    checker.check(raw)
    del raw["orbit"]["pinned"]
    with pytest.raises(checker.RejectedError, match="other states are to be fixed"):
        checker.check(raw)


def test_what_is_no_peak_says_so() -> None:
    scene = stickslip.load_scene("two-dof")
    found = stickslip.certify(stickslip.solve(scene, frequency_hz=1.6), peak=True)
    assert not found.reached
    assert found.certificate is None
    assert "no extreme" in found.reason  # uphill, up to where other events happen


@pytest.mark.long
def test_the_least_peak_is_proved() -> None:
    track = stickslip.peaks.track_peak(stickslip.load_scene("two-dof"), "damper.N0", 40.0, 400.0)
    best = track.optimum
    scene = stickslip.load_scene("two-dof").with_values({"damper.N0": best.at})
    near = stickslip.solve(scene, frequency_hz=best.active[0].frequency)
    found = stickslip.certify(near, least_over="damper.N0")
    assert found.reached, found.reason
    assert found.max_abs[1] - found.max_abs[0] <= 1e-14 * found.max_abs[1]
    assert found.max_abs[0] == pytest.approx(best.peak, rel=1e-3)


def test_the_work_of_a_proof_is_limited() -> None:
    """Seed 38 has 36 events: it ends where the work allowed is used up, at the same place each time."""
    scene, hz = random_scene(38)
    found = stickslip.solve(scene, frequency_hz=hz, harmonics=21)
    ended = [stickslip.certify(found, most_work=1.0) for _ in range(2)]
    assert ended[0].status is stickslip.solutions.CertificateStatus.WORK_USED_UP
    assert 1.0 < ended[0].work < 2.0
    assert ended[0].work == ended[1].work
    assert ended[0].certificate is None


def test_a_proof_is_stopped_on_request() -> None:
    scene = stickslip.load_scene("two-dof")
    near = stickslip.solve(scene, frequency_hz=1.03724)
    ended = stickslip.certify(near, peak=True, should_stop=lambda: True)
    assert ended.status is stickslip.solutions.CertificateStatus.STOPPED
    assert ended.certificate is None


def test_a_solution_that_did_not_converge_is_not_proved() -> None:
    scene = stickslip.load_scene("two-dof")
    found = replace(
        stickslip.solve(scene, frequency_hz=1.2), status=stickslip.solutions.SolutionStatus.NOT_CONVERGED
    )
    proof = stickslip.certify(found)
    assert not proof.reached
    assert proof.reason == found.status.value


# Peaks that studies found


@pytest.mark.long
def test_the_least_peak_of_a_study_is_proved(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "answer.json"
    for words in (
        ["peaks", "two-dof", "--parameter", "damper.N0", "--from", "40", "--to", "400"],
        ["design", "two-dof", "--variable", "damper.N0", "40", "400"],
    ):
        assert main([*words, "--certify", "--json"]) == 0
        file.write_text(capsys.readouterr().out, encoding="utf-8")
        (found,) = json.loads(file.read_text(encoding="utf-8"))["certificates"]
        assert (found["proves"], found["certified"]) == ("least peak", True)
        assert found["load_factor"][0] == pytest.approx(1.0, abs=1e-3)
        assert main(["check-proof", str(file)]) == 0
        assert "load_factor" in capsys.readouterr().out


def test_peaks_that_are_not_least_over_a_load_are_proved_at_their_place() -> None:
    """At an end of the range, over a stiffness: the peak there."""
    asked = {"parameter": "damper.kt", "start": 25.0, "stop": 30.0, "certify": True, "checks": 0}
    answer = Peaks.compute(stickslip.load_scene("two-dof"), asked, Watch())
    best, (proof,) = answer.json["optimum"], answer.json["certificates"]
    assert proof["proves"] == "peak"
    assert proof["certified"], proof["reason"]
    assert proof["max_abs"][0] == pytest.approx(best["peak"], rel=1e-3)
    assert proof["frequency_hz"][0] == pytest.approx(best["active"][0]["frequency"], rel=1e-3)


def test_what_cannot_be_proved_is_refused_before_anything_is_computed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A law without pieces, and a design in spite of what is not known."""
    assert (
        main(
            [
                "peaks",
                "platform-wedge",
                "--parameter",
                "wedge.mu",
                "--from",
                "0.1",
                "--to",
                "0.5",
                "--certify",
            ]
        )
        == 2
    )
    assert "must be coulomb, elastic-normal or gap" in capsys.readouterr().err
    body = {"scene": "two-dof", "uncertain": {"damper.mu": [0.28, 0.32]}, "certify": True}
    issues = Design.model_validate(body).issues(stickslip.load_scene("two-dof"))
    assert [each.subject for each in issues] == [("certify",)]


# The command

Run = Callable[..., tuple[int, str, str]]


def test_the_command_proves_and_checks(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "answer.json"
    assert main(["solve", "two-dof", "--frequency", "1.2", "--certify", "--json"]) == 0
    file.write_text(capsys.readouterr().out, encoding="utf-8")
    assert json.loads(file.read_text(encoding="utf-8"))["certificate"]["certified"]
    assert main(["check-proof", str(file)]) == 0
    assert "max_abs" in capsys.readouterr().out
    assert main(["solve", "two-dof", "--frequency", "1.2", "--certify"]) == 0
    assert "proved" in capsys.readouterr().out
    file.write_text("{}", encoding="utf-8")
    assert main(["check-proof", str(file)]) == 2
    assert "must be a certificate" in capsys.readouterr().err
    file.write_text('{"claims": {"max_abs": ["1", "2"]}, "bits": 128}', encoding="utf-8")
    assert main(["check-proof", str(file)]) == 2
    assert "as this version writes it" in capsys.readouterr().err
