"""What a stranger has computed for an answer ends within limits, and beside the service."""

import json
from pathlib import Path
from typing import Any

import pytest
from attack_site import GRACE_SECONDS, Attack, Site, attacked

import solver

TWO: dict[str, Any] = solver.load_scene("two-dof").to_dict()
DISK: dict[str, Any] = solver.load_scene("bladed-disk").to_dict()


def contacts(count: int) -> dict[str, Any]:
    return {**TWO, "contacts": [{**TWO["contacts"][0], "name": f"c{n}"} for n in range(count)]}


def sectors(count: int, observed: str = "") -> dict[str, Any]:
    observe = {**DISK["observe"], "dof": DISK["observe"]["dof"] + observed}
    return {**DISK, "structure": {**DISK["structure"], "sectors": count}, "observe": observe}


def masses(count: int) -> dict[str, Any]:
    names = [f"m{n}" for n in range(1, count + 1)]
    springs = [
        {"between": [a, b], "k": 1.0, "c": 0.01} for a, b in zip(names, [*names[1:], "ground"], strict=True)
    ]
    structure = {"kind": "lumped", "masses": dict.fromkeys(names, 1.0), "springs": springs}
    return {**TWO, "structure": structure}


def plan(scene: object, harmonics: int = 11) -> Attack:
    return Attack.of("/v1/plan", {"scene": scene, "harmonics": harmonics})


def read(text: str, form: str = "toml") -> Attack:
    return Attack.of("/v1/scenes/read", {"text": text, "form": form})


def job(kind: str, scene: object, **words: object) -> Attack:
    return Attack.of("/v1/jobs", {"kind": kind, "scene": scene, **words})


ATTACKS: dict[str, Attack] = {
    "a plan of 100 contacts and 200 harmonics": plan(contacts(100), 200),
    "a plan of 1000 sectors": plan(sectors(1000, "@3"), 3),
    "a plan of a thousand masses": plan(masses(1000)),
    "a plan of 8000 masses": plan(masses(8000)),
    "a job of 10 000 sectors": job("march", sectors(10_000, "@3"), frequency_hz=700.0),
    "a sweep of 10 000 sectors": job("sweep", sectors(10_000, "@3"), harmonics=1),
    "a job of 8000 masses": job("solve", masses(8000), frequency_hz=1.0, harmonics=1),
    "a preview of 2000 masses": Attack.of(
        "/v1/previews", {"kind": "point", "scene": masses(2000), "frequency_hz": 1.0, "harmonics": 1}
    ),
    "TOML with a long dotted key": read("a" + ".a" * 40_000 + " = 1"),
    "TOML with many dotted keys": read("".join(f"{'a.' * 30}b{n} = 1\n" for n in range(8_000))),
    "TOML with a long dotted table": read("[a" + '."b"' * 40_000 + "]"),
    "TOML of 4 MB": read("a = [" + "0," * 299_000 + "0]"),
    "TOML of many tables": read("".join(f"[t{n}]\n" for n in range(60_000))),
    "TOML nested deeply": read("a = " + "[" * 100_000),
    "TOML with a long integer": read("a = " + "9" * 5000),
    "TOML with a long integer in base 16": read("a = 0x" + "f" * 500_000),
    "JSON text nested deeply": read("[" * 100_000, "json"),
    "JSON text with a long integer": read('{"a": ' + "9" * 5000 + "}", "json"),
    "JSON text of 4 MB": read('{"a": [' + "0," * 1_900_000 + "0]}", "json"),
    "JSON text of as many values as are read": read('{"a": [' + "0.125," * 490_000 + "0]}", "json"),
}  # fmt: skip


LONG = {
    "a plan of a thousand masses", "a plan of 8000 masses", "a sweep of 10 000 sectors",
    "TOML with many dotted keys", "TOML with a long dotted table", "TOML of many tables",
    "TOML nested deeply", "JSON text nested deeply", "JSON text of 4 MB",
}  # fmt: skip


@pytest.mark.few(16)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long if name in LONG else ()) for name in ATTACKS]
)
def test_a_costly_computation_hurts_nobody_else(site: Site, name: str) -> None:
    figures = site.bears([ATTACKS[name]])
    answer = figures.answers[0]
    assert answer.status in (200, 400, 413, 422), answer.body[:500]
    assert answer.seconds < 3.0, "2 s of a computation, and what is around it"


def nested(depth: int) -> Any:
    found: Any = 1.0
    for _ in range(depth):
        found = [found]
    return found


DEEP: dict[str, Attack] = {
    "in uncertain": job("design", "two-dof", uncertain=nested(500)),
    "in a value of uncertain": job("design", "two-dof", uncertain={"damper.mu": nested(500)}),
    "in max_friction_work": job("design", "two-dof", max_friction_work=nested(500)),
    "in structure.M": plan(
        {**TWO, "structure": {"kind": "matrices", "M": nested(500), "K": [[1]], "dofs": ["a"]}}
    ),
    "in a JSON text": read(json.dumps({"structure": nested(500)}), "json"),
    "in a TOML text": read("structure = " + "[" * 500 + "]" * 500),
    "in keys of a TOML text": read("a." * 500 + "b = 1"),
}  # fmt: skip
DIGITS = "9" * 5000
LARGE: dict[str, Attack] = {
    "in uncertain": Attack(
        "/v1/jobs", f'{{"kind": "design", "scene": "two-dof", "uncertain": {DIGITS}}}'.encode()
    ),
    "in harmonics": Attack("/v1/plan", f'{{"scene": "two-dof", "harmonics": {DIGITS}}}'.encode()),
    "in a scene": Attack("/v1/scenes", f'{{"name": "a", "structure": {{"M": {DIGITS[:400]}}}}}'.encode()),
    "in a JSON text": read(f'{{"a": {DIGITS}}}', "json"),
    "in a TOML text": read(f"a = {DIGITS}"),
}


def refused(site: Site, attacks: dict[str, Attack], word: bytes) -> None:
    answers = {name: site.send(attack) for name, attack in attacks.items()}
    wrong = {
        name: one for name, one in answers.items() if one.status not in (400, 422) or word not in one.body
    }
    assert wrong == {}


def test_what_is_nested_deeply_is_refused_with_the_limit(site: Site) -> None:
    refused(site, DEEP, b"64")


def test_an_integer_of_thousands_of_digits_is_refused_with_its_place(site: Site) -> None:
    refused(site, LARGE, b"digits")


@pytest.mark.long
def test_many_costly_computations_of_one_key_hurt_nobody_else(site: Site) -> None:
    """They take turns among themselves, whatever the number of connections."""
    figures = site.bears([plan(masses(600), 11)] * 3, at_once=3)
    assert {answer.status for answer in figures.answers} <= {200, 422, 429, 503}


def test_another_client_is_answered_while_one_computes(site: Site) -> None:
    def ask() -> int:
        return site.send(plan("two-dof"), site.other).status

    assert site.meanwhile([plan(masses(1000))] * 2, ask, at_once=2) == 200


@pytest.mark.long
def test_a_service_that_computes_ends_within_the_grace(tmp_path: Path) -> None:
    large = Attack("/v1/scenes", b'{"scene": {"a": [' + b"0.1234," * 490_000 + b"1]}}")
    with attacked(tmp_path) as site, site.sending([plan(masses(1000)), plan(masses(1000)), large]):
        assert site.stops() < GRACE_SECONDS + 3.0
