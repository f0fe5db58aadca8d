"""FrictionBench: its cases are what its schema says, its answers hold, and its scorer scores."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from each import each
from flint import arb, arb_mat

import stickslip
from benchmarks.frictionbench import answers, multipliers, proofs, scenes, scorer
from benchmarks.frictionbench.model import HERE, load, model, names
from stickslip.lab.proofs import checker

FAST = (
    "den-hartog-0.8", "den-hartog-stops", "sinha-griffin-repelling", "one-slider", "moving-load-phase",
    "case-a-peak-100-150", "elastic-normal-1.5",
)  # fmt: skip
SCHEMA = json.loads((HERE / "case.schema.json").read_text())
KNOWN = {one: answers.stored(one) for one in names() if answers.path(one).exists()}


def test_the_cases_are_what_their_schema_says() -> None:
    assert len(names()) >= 50
    for number, name in enumerate(names(), start=1):
        case = json.loads((HERE / "cases" / f"{name}.json").read_text())
        jsonschema.validate(case, SCHEMA)
        assert (case["name"], case["number"]) == (name, number)


@each("name", names())
def test_a_case_becomes_a_scene_of_the_same_matrices(name: str) -> None:
    from solver.linear.assembly import linear_model

    case = load(name)
    scene = scenes.scene(case)
    assert [one.name for one in scene.contacts] == [one["name"] for one in case["contacts"]]
    if "sectors" not in case["structure"]:
        built = linear_model(scene)
        for key, matrix in zip("MCK", (built.M, built.C0, built.K0), strict=True):
            assert matrix == pytest.approx(
                getattr(model({**case, "contacts": []}), key), rel=1e-12, abs=1e-14
            )


@pytest.mark.parametrize("name", ["one-slider", "floating-50", "two-dof-stuck", "elastic-normal-0.5"])
def test_a_proof_is_checked_by_who_knows_nothing_of_us(name: str) -> None:
    """And the answer is what it claims."""
    raw = json.loads((HERE / "proofs" / f"{name}.json").read_text())
    checker.check(raw)
    half = load(name)["asked"]["what"] == "half-peak-to-peak"
    assert KNOWN[name]["enclosure"] == raw["claims"]["half_peak_to_peak" if half else "max_abs"]


def test_every_motion_that_is_asked_for_attracts() -> None:
    """But for the cycles that are asked for as what they are; and none that did not repeat has an answer."""
    for name, answer in KNOWN.items():
        asked = load(name)["asked"]
        if "harmonics" in asked or asked["what"] == "amplification":
            known = {"attracting": True, "repelling": False}.get(asked.get("which", ""))
            assert answer["attracts"] is known, name
            continue
        assert answer["attracts"] is (asked.get("which") != "repelling"), name
        if "largest" in answer["multipliers"]:
            low, high = (float(one) for one in answer["multipliers"]["largest"])
            assert (high < 1.0) if answer["attracts"] else (low > 1.0), name
            assert low - 2e-9 <= abs(complex(*answer["multipliers"]["estimates"][0])) <= high + 2e-9, name
            assert set(answer["by"]["events"]["held"]) <= set(answer["multipliers"]["neutral"]), name
        assert "did not repeat" not in json.dumps(answer), name


MARCHED = [
    name
    for name, one in ((name, load(name)) for name in KNOWN)
    if one["asked"]["what"] in ("amplitude", "half-peak-to-peak", "peak")
    and "harmonics" not in one["asked"]
    and one["asked"].get("which", "attracting") == "attracting"
]
SLOW = {"floating-50": 1e-6}
"""Friction alone holds the middle, which goes to its place as 1/n: it does not repeat, and says so."""
QUICK = ("wedge", "one-slider", "moving-load-phase", "many-events", "two-dof-stuck", "jump-upper")


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=() if one in QUICK else pytest.mark.long) for one in MARCHED]
)
def test_a_motion_from_rest_ends_in_the_answer(name: str) -> None:
    """A march shares no code with the events; it ends in nothing that repels.

    Steps of rigid friction are of a low order.
    """
    case = load(name)
    hertz = case["asked"].get("frequency_hz", KNOWN[name].get("at"))
    found = stickslip.march(scenes.scene(case), frequency_hz=hertz, max_periods=200_000)
    assert found.converged or name in SLOW
    half = case["asked"]["what"] == "half-peak-to-peak"
    assert (found.half_peak_to_peak if half else found.max_abs) == pytest.approx(
        float(KNOWN[name]["value"]),
        rel=SLOW.get(name, 1e-5 if scenes.scene(case).rigid_contact is not None else 1e-7),
    )


def proof_of(name: str) -> dict[str, Any]:
    """Return a stored proof; of `wedge-once` that of the wedge's motion of one period of its load."""
    if name != "wedge-once":
        return dict(json.loads((HERE / "proofs" / f"{name}.json").read_text()))
    case = load("wedge")
    case["asked"]["frequency_hz"] *= 2
    case["loads"][0]["harmonic"] = 1
    made = scenes.scene(case)
    found = stickslip.solve(made, frequency_hz=case["asked"]["frequency_hz"], harmonics=41)
    proof = stickslip.certify(found).certificate
    assert proof is not None
    return proof


@pytest.mark.parametrize(
    "name",
    [
        "wedge-once",
        *(
            pytest.param(one, marks=pytest.mark.long)
            for one in ("wedge", "one-slider", "two-stops", "moving-load-phase", "elastic-normal-1.5")
        ),
    ],
)
def test_multipliers_are_those_of_motions_that_begin_beside(name: str) -> None:
    """Small differences, marched a period by steps that clip the forces; of the whole monodromy."""
    raw, off = proof_of(name), 5e-3
    told = multipliers.of_proof(raw)
    found = np.linalg.eigvals(stepped_monodromy(raw))
    largest = max(abs(found))
    low, high = (float(one) for one in told["largest"])
    assert low * (1 - off) <= largest <= high * (1 + off)
    for real, imag in told["estimates"]:
        assert min(abs(found - complex(real, imag))) < off * max(1.0, largest)
    if name == "wedge-once":  # it doubles its period
        assert low > 1.6
        assert told["estimates"][0][0] < -1.6


@pytest.mark.parametrize("name", ["flutter-0.2", "flutter-0.5", "flutter-1", "flutter-repelling"])
def test_free_motions_come_back_to_a_cycle_or_leave_it(name: str) -> None:
    """From a little more and a little less, a period of small steps that clip the force."""
    m, amplitude = model(load(name)), float(KNOWN[name]["value"])
    mass, damping, stiffness, contact = m.M.item(), m.C.item(), m.K.item(), m.rows[0]
    limit, h = contact.mu * contact.N0, 2e-4

    def next_peak(x: float) -> float:
        v, f = 0.0, limit
        while True:
            a = -(damping * v + stiffness * x + f) / mass
            y, u = x + h * v + 0.5 * h * h * a, v + h * a
            g = min(max(f + contact.kt * (y - x), -limit), limit)
            b = -(damping * u + stiffness * y + g) / mass
            y, u = x + h * v + h * h * (2.0 * a + b) / 6.0, v + 0.5 * h * (a + b)
            if v > 0.0 >= u:
                return x + 0.5 * v * v / -a
            x, v, f = y, u, g

    more, less = (next_peak(amplitude * factor) for factor in (1.001, 0.999))
    grows = (more - less) / (0.002 * amplitude)
    low, high = (float(one) for one in KNOWN[name]["multipliers"]["largest"])
    assert low - 2e-3 <= grows <= high + 2e-3
    assert next_peak(amplitude) == pytest.approx(amplitude, rel=1e-5)
    assert (grows < 1.0) == KNOWN[name]["attracts"]


def test_bounds_of_the_largest_multiplier_hold() -> None:
    """Of matrices whose eigenvalues are known: pairs, equal ones, and none but zeros."""
    rng = np.random.default_rng(3)
    for moduli in ([0.9, 0.5], [1.7, 1.69, 0.1], [0.7, 0.7, 0.7], [1e-9, 1e-12]):
        blocks = [m * np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]]) for m, t in
                  zip(moduli, rng.uniform(0, 3, len(moduli)), strict=True)]  # fmt: skip
        n = 2 * len(blocks)
        matrix, mixed = np.zeros((n, n)), rng.normal(size=(n, n))
        for k, block in enumerate(blocks):
            matrix[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = block
        with proofs.precision(128):
            balls, frame = arb_mat(matrix.tolist()), arb_mat(mixed.tolist())
            low, high = multipliers.radius(frame * balls * frame.inv())
            assert low < max(moduli) * (1 + 1e-15)
            assert high > max(moduli) * (1 - 1e-15)
            assert high < low * 1.001
            nilpotent = arb_mat(np.diag([1.0] * (n - 1), 1).tolist())
            assert multipliers.radius(nilpotent)[1] == 0


def stepped_monodromy(raw: dict[str, Any], steps: int = 10000, small: float = 1e-5) -> np.ndarray:
    """Return central differences of a period of the statement of a certificate, by steps of Heun's rule."""
    s, orbit = raw["system"], raw["orbit"]
    M, n, c = np.array(s["mass"]), len(s["mass"]), s["contacts"]
    K, C = np.zeros((n, n)), np.zeros((n, n))
    omega, h = 2.0 * np.pi * s["frequency_hz"], 1.0 / s["frequency_hz"] / steps

    def row(terms: list[list[float]]) -> np.ndarray:
        made = np.zeros(n)
        for at, factor in terms:
            made[int(at)] += factor
        return made

    for ends, terms, k, d in s["springs"]:
        K += k * np.outer(row(ends), row(terms))
        C += d * np.outer(row(ends), row(terms))
    along, across = (np.array([row(one[key]) for one in c]) for key in ("row", "normal"))
    kt, kn, mu, gap, rest, presses = (
        np.array([float(one[key] or 0.0) for one in c])[:, None]
        for key in ("kt", "kn", "mu", "gap", "rest", "presses")
    )
    inverse = np.linalg.inv(M)

    def waves(every: list[Any], t: float) -> float:
        return sum(a * np.cos(k * (omega * t + orbit["begins"]) + p) for k, a, p in every)

    def load(x: np.ndarray, t: float) -> np.ndarray:
        given = np.array([waves(one["waves"], t) for one in c])[:, None]
        return np.maximum(given + kn * (across @ x - gap), 0.0)

    def rate(x: np.ndarray, v: np.ndarray, f: np.ndarray, t: float) -> np.ndarray:
        push = sum(row(one["row"]) * waves(one["waves"], t) for one in s["forces"])[:, None]
        pressed = presses * (load(x, t) - rest)
        return inverse @ (push - K @ x - C @ v - along.T @ f - across.T @ pressed)

    box = [float(arb(one).mid()) for one in raw["proof"]["unknowns"]]
    moved = sorted({one["contact"] for one in orbit["events"] if c[one["contact"]]["kt"]})
    free = 2 * n + len(moved)
    w = np.array(box[:free])[:, None] + small * np.hstack([np.eye(free), -np.eye(free)])
    x, v, f = w[:n], w[n : 2 * n], np.zeros((len(c), 2 * free))
    f[moved] = w[2 * n :]
    f = np.clip(f, -mu * load(x, 0.0), mu * load(x, 0.0))
    for k in range(steps):
        t = k * h
        a = rate(x, v, f, t)
        y, u = x + h * v + 0.5 * h * h * a, v + h * a
        limit = mu * load(y, t + h)
        g = np.clip(f + kt * (along @ (y - x)), -limit, limit)
        b = rate(y, u, g, t + h)
        x, v, f = x + h * v + h * h * (2.0 * a + b) / 6.0, v + 0.5 * h * (a + b), g
    ends = np.vstack([x, v, f[moved]])
    return (ends[:, :free] - ends[:, free:]) / (2.0 * small)


def test_an_answer_says_by_how_many_ways() -> None:
    assert set(KNOWN) == set(scorer.answered())
    for name, answer in KNOWN.items():
        assert answer["ways"] == len(answer["by"]), name
        if answer.get("enclosure"):
            low, high = (float(one) for one in answer["enclosure"])
            assert low <= float(answer["value"]) <= high or abs(high - low) < 1e-15 * abs(high), name
    assert sum(one["ways"] > 1 and one["agreed_digits"] >= answers.WANTED for one in KNOWN.values()) >= 50


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n in FAST else pytest.mark.long) for n in KNOWN]
)
def test_an_answer_is_found_again_by_its_ways(name: str) -> None:
    found = answers.recompute(name, most=80 if name in FAST else answers.FAR)
    assert set(found["by"]) - {"march"} == set(KNOWN[name]["by"]) - {"march"}
    assert float(found["value"]) == pytest.approx(
        float(KNOWN[name]["value"]), rel=1e-13 if found.get("enclosure") else 1e-9
    )
    # Beyond what is wanted digits are rounding: another processor agrees in others.
    wanted = min(7.0 if name in FAST else answers.WANTED, KNOWN[name]["agreed_digits"] - 0.5)
    assert found["ways"] == 1 or found["agreed_digits"] >= wanted


@pytest.mark.parametrize("name", FAST)
def test_our_answer_is_within_our_own_estimate(name: str) -> None:
    found, known = scenes.answer(load(name), 21), KNOWN[name]
    error = abs(found["value"] - float(known["value"]))
    assert scorer.covers(error, found["estimate"], known), (error, found["estimate"])


def test_the_archive_holds_every_case_and_its_answer(tmp_path: Path) -> None:
    with zipfile.ZipFile(scorer.archive(str(tmp_path / "all.zip"))) as packed:
        made = packed.namelist()
        packed.extractall(tmp_path)
    command = [sys.executable, "-I", "-c", "import sys; sys.path.insert(0, '.'); import protocol"]
    subprocess.run(command, cwd=tmp_path / "frictionbench", check=True)
    assert {f"frictionbench/cases/{name}.json" for name in names()} <= set(made)
    assert {f"frictionbench/answers/{name}.json" for name in KNOWN} <= set(made)
    assert {
        "frictionbench/CITATION.cff",
        "frictionbench/checker.py",
        "frictionbench/proofs/case-a.json",
    } <= set(made)
