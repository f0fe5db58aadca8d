"""Forged certificates: what is stated has no meaning, a law is violated once, one thing of an honest one is
changed at random. None is accepted that says what a march, which shares nothing with the checker, denies."""

from __future__ import annotations

import copy
import json
import math
import subprocess
import sys
import time
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each import each

from service.cli import main
from stickslip.lab.proofs import checker
from stickslip.lab.proofs.boxes import boxed, orbit_at, settled
from stickslip.lab.proofs.proof_work import ProofHaltedError, allowed
from tests.cases.statement_march import forged, judged

PROOFS = Path(__file__).parents[4] / "benchmarks" / "frictionbench" / "proofs"
HONEST = (
    "two-dof", "one-stop", "two-stops", "rigid-and-stop", "den-hartog-0.8", "den-hartog-stops",
    "elastic-normal-gap-0.2", "elastic-normal-1.5", "moving-load", "floating-50", "two-dof-stuck",
    "flutter-stop", "flutter-two", "iwan-5", "ring-6-order-3", "case-a-peak-100-80", "pressed-stop",
    "three-harmonics", "wedge", "chain-3", "jump-upper", "load-touches", "separation", "patch-1-box",
)  # fmt: skip
SLOW = ("optimum-1",)
MOST_SECONDS = 30.0  # of processor time for any certificate


@cache
def _honest(name: str) -> str:
    return (PROOFS / f"{name}.json").read_text(encoding="utf-8")


def honest(name: str) -> dict[str, Any]:
    """Return a certificate of the benchmark."""
    return json.loads(_honest(name))  # type: ignore[no-any-return]


def refused(raw: Any) -> str:
    """Return why a certificate is refused, which takes bounded time; nothing where it is accepted."""
    begun, told = time.process_time(), ""
    try:
        checker.check(raw)
    except checker.RejectedError as error:
        told = str(error)
    assert time.process_time() - begun < MOST_SECONDS
    return told


@each("name", [p.stem for p in sorted(PROOFS.glob("*.json")) if p.stat().st_size < 4000])
def test_the_judge_finds_honest_certificates_true(name: str) -> None:
    """But for two whose motion changes too fast for its steps."""
    if name not in ("goodman-klumpp-bar", "stiff-10000"):
        assert judged(honest(name)) == ""


# The twenty nearest wrong physics

X = [[0, 1.0]]
NOTHING = {
    "row": [], "mu": 0.0, "kt": 0.0, "waves": [], "kn": 0.0, "gap": 0.0, "normal": [], "rest": 0.0,
    "presses": False, "varies": False,
}  # fmt: skip
SPRING = NOTHING | {"row": X, "mu": 0.5, "kt": 1.0, "waves": [[0, 0.8, 0.0]]}
VARYING = SPRING | {"waves": [[0, 0.8, 0.0], [1, 0.4, 0.5]]}
OPENING = SPRING | {"waves": [[0, 0.3, 0.0], [1, 0.8, 0.5]]}
RIGID, RIGID_OPENING = SPRING | {"kt": None}, OPENING | {"kt": None}
STOP = NOTHING | {"kn": 2.0, "gap": 0.4, "normal": X, "presses": True}
FACE = SPRING | {"mu": 0.4, "waves": [[0, 0.02, 0.0]], "kn": 0.8, "normal": [[1, 1.0]], "presses": True}


def system(contact: dict[str, Any], hertz: float = 0.15, masses: int = 1) -> dict[str, Any]:
    """One mass, or two that a spring joins, with a contact."""
    springs = [[[[i, 1.0]], [[i, 1.0]], 1.0 + 0.5 * i, 0.6] for i in range(masses)]
    joined = [[0, 1.0], [1, -1.0]]
    return {
        "frequency_hz": hertz, "mass": np.eye(masses).tolist(),
        "springs": springs + ([[joined, joined, 0.4, 0.05]] if masses == 2 else []),
        "contacts": [contact | {"name": "c"}], "forces": [{"row": X, "waves": [[1, 1.0, 0.3]]}],
        "observe": X,
    }  # fmt: skip


WRONG = [
    ("never slips", system(SPRING)), ("never slips", system(RIGID, 0.06)),
    ("never slips", system(FACE, masses=2)), ("slips early", system(SPRING)),
    ("never slips", system(VARYING)), ("slips on", system(SPRING)), ("slips on", system(FACE, masses=2)),
    ("turns at once", system(SPRING)), ("forgets", system(SPRING)), ("forgets", system(VARYING)),
    ("friction drives", system(RIGID | {"mu": 0.02})), ("steady load", system(VARYING)),
    ("steady load", system(VARYING | {"kt": None})), ("stays open", system(OPENING)),
    ("stays open", system(RIGID_OPENING)), ("stays open", system(FACE, masses=2)),
    ("pulls", system(STOP)), ("pulls", system(RIGID_OPENING)), ("goes through", system(STOP)),
    ("bounces", system(STOP)), ("no reaction", system(STOP)), ("no reaction", system(FACE, masses=2)),
    ("rest without force", system(RIGID_OPENING)), ("rest without force", system(RIGID, 0.06)),
]  # fmt: skip
RIGHT = [
    system(SPRING), system(VARYING), system(OPENING), system(RIGID), system(RIGID, 0.06),
    system(RIGID_OPENING), system(STOP), system(FACE, masses=2),
]  # fmt: skip


@pytest.mark.parametrize("right", RIGHT)
def test_who_forges_by_the_right_laws_is_believed(right: dict[str, Any]) -> None:
    """So that what is refused below is refused for the law that is wrong."""
    raw = forged(right)
    assert refused(raw) == ""
    assert judged(raw) == ""


@pytest.mark.parametrize(("wrong", "right"), WRONG)
def test_a_law_violated_once_is_refused(wrong: str, right: dict[str, Any]) -> None:
    raw = forged(right, wrong)
    assert refused(raw)
    assert judged(raw)


# Statements without a meaning


def _set(raw: Any, path: str, value: Any) -> Any:
    *before, last = [int(key) if key.lstrip("-").isdigit() else key for key in path.split(".")]
    holder = raw
    for key in before:
        holder = holder[key]
    holder[last] = value
    return raw


@each(
    ("name", "path", "value", "told"),
    [
        ("one-stop", "orbit.states", [], "orbit.states is a list of 0, it must be a list of 1"),
        ("rigid-and-stop", "orbit.states", ["slip-"], "a list of 1, it must be a list of 2"),
        ("two-dof", "system.forces.0.waves.0.0", -1, "is -1, it must be a whole number from 0"),
        ("two-dof", "system.forces.0.waves.0.0", 0.5, "is 0.5, it must be a whole number from 0"),
        ("two-dof", "system.contacts.0.waves.1.0", 0, "waves has 0 twice"),
        ("two-dof", "system.observe.0.1", math.nan, "system.observe[0][1] is nan"),
        ("two-dof", "system.observe.0.1", math.inf, "system.observe[0][1] is inf"),
        ("two-dof", "system.observe.0.0", 2, "is 2, it must be a whole number from 0 to 1"),
        ("two-dof", "system.springs.0.0.0.0", 3, "is 3, it must be a whole number from 0 to 1"),
        ("two-dof", "system.springs.0.1.0.0", -1, "is -1, it must be a whole number from 0 to 1"),
        ("two-dof", "system.mass.0.0", 0.0, "system.mass[0][0] is 0.0"),
        ("two-dof", "system.mass.0.1", 0.1, "not symmetric"),
        ("two-dof", "system.mass", [[1.0, 2.0], [2.0, 1.0]], "not positive definite"),
        ("two-dof", "system.contacts.0.kt", 0.0, "contacts[0].kt is 0.0"),
        ("two-dof", "system.contacts.0.mu", -0.3, "contacts[0].mu is -0.3"),
        ("two-dof", "system.contacts.0.presses", True, "presses is True, it must be 0 or false"),
        ("one-stop", "system.contacts.0.mu", 0.3, "of a gap"),
        ("two-dof", "system.frequency_hz", 10**400, "frequency_hz is a int"),
        ("two-dof", "system.frequency_hz", True, "frequency_hz is True"),
        ("two-dof", "system.dampers", [], "a key of system is 'dampers'"),
        ("two-dof", "orbit.events.0.at_once", False, "at_once is False, it must be true"),
        ("two-dof", "orbit.events.0.to", "slip+", "that is slip-, is 'slip+', it must be one of stick, open"),
        ("rigid-and-stop", "orbit.pinned", [1, 0.0], "orbit.pinned[0] is 1"),
        ("two-dof", "orbit.fixed_forces.0", 1.0, "must be the number of a contact with a spring that sticks"),
        ("two-dof", "proof.frequency_hz", "2", "a key of proof is 'frequency_hz'"),
        ("two-dof", "proof.load_factor", "2", "a key of proof is 'load_factor'"),
        ("two-dof", "proof.unknowns.0", "nan", "must be a decimal number as text"),
        ("two-dof", "certifies", "peak", "it must be one of periodic orbit"),
        ("two-dof", "claims", {}, "claims is empty"),
        ("two-dof", "claims.peak", ["1", "2"], "a key of claims is 'peak'"),
        ("two-dof", "bits", 10**6, "bits is 1000000"),
        ("two-dof", "system.springs.0.2", 1e60, "too long for the fastest of its motions"),
        ("case-a-peak-100-80", "proof.over.load_factor", "2", "one load_factor"),
        ("flutter-stop", "system.frequency_hz", 1.0, "certifies"),
        ("flutter-stop", "system.contacts.0.waves.0.0", 1, "is 1, it must be a whole number from 0 to 0"),
    ],
)
def test_a_statement_without_a_meaning_says_what_would_be_right(
    name: str, path: str, value: Any, told: str
) -> None:
    assert told in refused(_set(honest(name), path, value))


def test_text_that_is_no_certificate_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By the command and by the file alone: no traceback."""
    text, file = _honest("two-dof"), tmp_path / "forged.json"
    texts = [
        "", "[]", "null", "1", "[" * 100_000, '{"a":' * 100_000, text[:-2], text.replace("1.198", "1e999"),
        text.replace("1.198", "NaN"), text.replace("1.198", "9" * 5000),
        text.replace('"bits": 128', '"bits": 128, "bits": 128'), text.replace('"slip-"', '"slip\\ud800"'),
        '{"certificate": ' * 400 + "1" + "}" * 400, json.dumps({"certificates": [{"certificate": None}]}),
    ]  # fmt: skip
    for text in texts:
        with pytest.raises(checker.RejectedError):
            checker.check(checker.read(text))
        file.write_text(text, encoding="utf-8")
        assert main(["check-proof", str(file)]) == 2
        assert "must be a certificate" in capsys.readouterr().err
    file.write_bytes(b"\xff\xfe\x00")
    ended = subprocess.run([sys.executable, checker.__file__, str(file)], capture_output=True, check=False)
    assert (ended.returncode, ended.stderr[:9], b"Traceback" in ended.stderr) == (1, b"rejected:", False)


def test_a_cycle_gone_through_twice_is_refused() -> None:
    """Its frequency would be half of what it is."""
    raw = honest("flutter-1")
    unknowns, events = raw["proof"]["unknowns"], raw["orbit"]["events"]
    first = len(unknowns) - len(events) - 1
    lengths = unknowns[first:]
    middle, radius = zip(*(each.split(" +/- ") for each in lengths), strict=True)
    joined = f"{Decimal(middle[0]) + Decimal(middle[-1])} +/- {Decimal(radius[0]) * 2}"
    raw["proof"]["unknowns"] = unknowns[:first] + [*lengths[:-1], joined, *lengths[1:]]
    raw["orbit"]["events"] = events * 2
    raw["claims"] = {"frequency_hz": [str(Decimal(end) / 2) for end in raw["claims"]["frequency_hz"]]}
    assert "several times over" in refused(raw)


def test_a_load_that_is_a_wave_alone_is_no_constant_one() -> None:
    """Contacts of other stiffness under it come to rest at other instants."""
    raw = honest("iwan-5")
    for c in raw["system"]["contacts"]:
        c["waves"][0][0] = 1
    assert "need not be at one instant" in refused(raw)


def test_peaks_of_other_branches_make_no_least_peak() -> None:
    """A peak that is higher elsewhere does not make the one here the least."""
    proof = (raw := honest("optimum-1"))["proof"]
    orbits = [proof["over"], *(each["over"] for each in proof["three"])]
    with checker.ctx.workprec(raw["bits"]):
        checker.one_branch(checker.Work(), raw, orbits)
        for key, other in (("frequency_hz", "0.19"), ("load_factor", "1.001")):
            with pytest.raises(checker.RejectedError):
                checker.one_branch(checker.Work(), raw, [*orbits[:3], orbits[3] | {key: other}])
        beside = [each.replace("-2.0", "-2.1") for each in orbits[3]["unknowns"]]
        with pytest.raises(checker.RejectedError):
            checker.one_branch(checker.Work(), raw, [*orbits[:3], orbits[3] | {"unknowns": beside}])


# Ten thousand mutations

ODD = [
    None, True, False, -1, 0, 1, 2, 0.5, -0.5, 1e308, -1e-300, math.nan, math.inf, "", "x", "1", "nan", [],
    {}, [[]], 10**30, 10**400, "slip+", "stick", "open", [0, 1.0], "1 +/- 1e3", "1e9999", 3.0,
]  # fmt: skip


def _places(raw: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    keys = raw.keys() if isinstance(raw, dict) else range(len(raw)) if isinstance(raw, list) else ()
    return [path] * bool(path) + [each for key in keys for each in _places(raw[key], (*path, key))]


def _mutated(raw: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return a certificate with one thing changed, anywhere in it, or sometimes two."""
    raw = copy.deepcopy(raw)
    for _ in range(1 + int(rng.random() < 0.2)):
        every = _places(raw)
        groups = sorted({path[:2] for path in every}, key=str)  # so that boxes are not most of it
        group = groups[int(rng.integers(len(groups)))]
        every = [path for path in every if path[:2] == group] or every
        *path, last = every[int(rng.integers(len(every)))]
        holder: Any = raw
        for key in path:
            holder = holder[key]
        value, way = holder[last], int(rng.integers(8))
        if way == 0:
            del holder[last]
        elif way == 1 and isinstance(holder, list):
            holder.insert(last, copy.deepcopy(value))
        elif way == 2 and isinstance(holder, list) and len(holder) > 1:
            other = int(rng.integers(len(holder)))
            holder[last], holder[other] = holder[other], holder[last]
        elif way == 3 and isinstance(holder, dict):
            holder[f"{last}s" if rng.random() < 0.5 else "extra"] = value
        elif way in (4, 5) and type(value) in (int, float) and not abs(value) > 1e99:
            change = float(10.0 ** rng.uniform(-15.0, 1.0)) * float(rng.choice([-1.0, 1.0]))
            holder[last] = [-value, value * (1.0 + change), value + 1, value / 2][int(rng.integers(4))]
        elif way in (4, 5) and isinstance(value, str) and value[:1] in "-0123456789":
            middle, *rest = value.split(" +/- ")
            change = Decimal(1) + Decimal(10) ** int(rng.integers(-30, 1))
            holder[last] = " +/- ".join([str(Decimal(middle) * change), *rest])
        elif way in (4, 5) and isinstance(value, str):
            holder[last] = str(rng.choice(["stick", "slip+", "slip-", "open", "closed", "peak"]))
        else:
            holder[last] = ODD[int(rng.integers(len(ODD)))]
    return raw


def _elsewhere(raw: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return the proved orbit of another scene presented as one of this."""
    changed = copy.deepcopy(raw)
    places = [
        path for path in _places(changed["system"])
        if path[0] in ("mass", "springs", "contacts", "forces", "frequency_hz")
    ]  # fmt: skip
    for _ in range(20):
        *path, last = places[int(rng.integers(len(places)))]
        holder: Any = changed["system"]
        for key in path:
            holder = holder[key]
        if type(holder[last]) is float and holder[last]:
            holder[last] *= 1.0 + float(10.0 ** rng.uniform(-12.0, -2.0))
            break
    kept = checker.ctx.prec
    try:
        checker.ctx.prec = changed["bits"]
        with allowed(100.0, None):
            orbit = orbit_at(changed)
            middles = [checker.arb(each).mid() for each in changed["proof"]["unknowns"]]
            start, now, _ = settled(orbit, middles)
            changed["proof"]["unknowns"], (low, high, _) = boxed(orbit, start, now)
    except (checker.RejectedError, ProofHaltedError, ZeroDivisionError, np.linalg.LinAlgError):
        return changed | {"system": raw["system"]}
    finally:
        checker.ctx.prec = kept
    found = {"max_abs": high.max(-low), "half_peak_to_peak": (high - low) / 2}
    changed["claims"] = {
        key: [each.lower().str(22, radius=False), each.upper().str(22, radius=False)]
        for key, each in found.items()
    }
    return changed | {"system": raw["system"]}


def _same(raw: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether two certificates state the same, with claims that can both be true."""
    orbits = [
        each["orbit"] | {"events": [{k: e[k] for k in ("contact", "to")} for e in each["orbit"]["events"]]}
        for each in (raw, other)
    ]
    claims = all(
        max(Decimal(one[0]), Decimal(two[0])) <= min(Decimal(one[1]), Decimal(two[1]))
        for key, one in other["claims"].items()
        if (two := raw["claims"].get(key)) is not None
    )
    return raw["system"] == other["system"] and orbits[0] == orbits[1] and claims


def accepted_but_false(count: int, seed: int) -> tuple[dict[str, int], list[Any]]:
    """Mutate, check, judge what is accepted; return counts, and what is accepted and false."""
    rng, counts, wrong = np.random.default_rng(seed), dict.fromkeys(("refused", "same", "true"), 0), []
    for i in range(count):
        name = SLOW[0] if i % 100 == 0 else HONEST[int(rng.integers(len(HONEST)))]
        raw = honest(name)
        if i % 10 == 1 and "unknowns" in raw["proof"]:
            other = _elsewhere(raw, rng)
        elif i % 10 == 2:  # one part of another certificate
            part = str(rng.choice(["system", "orbit", "proof", "claims"]))
            other = raw | {part: honest(HONEST[int(rng.integers(len(HONEST)))])[part]}
        else:
            other = _mutated(raw, rng)
        if refused(other):
            counts["refused"] += 1
        elif _same(raw, other):
            counts["same"] += 1
        elif told := judged(other):
            wrong.append((name, i, told, other))
        else:
            counts["true"] += 1
    return counts, wrong


@pytest.mark.parametrize(
    ("seed", "count"),
    [(0, 300), *(pytest.param(seed, 1000, marks=pytest.mark.long) for seed in range(1, 11))],
)
def test_no_mutation_is_accepted_that_is_false(seed: int, count: int) -> None:
    counts, wrong = accepted_but_false(count, seed)
    assert wrong == []
    assert counts["refused"] > 0.9 * count
