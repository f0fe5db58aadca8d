"""Templates: the natural frequency, damping and stuck resonance that were asked for; random answers."""

import math
import random
from typing import Any

import numpy as np
import pytest

import solver
from stickslip.lab.templates.templates import TEMPLATES, new_scene, template_schema, template_tables

ASKED = {"frequency_hz": 417.0, "modal_mass": 0.083, "damping_ratio": 0.0037}
DISK = {"blades": 30, "engine_order": 7}


def blade_alone(tables: dict[str, Any]) -> tuple[float, float]:
    """Natural frequency [Hz] and damping ratio of the blade without its contacts, by its own M, C and K."""
    structure = tables["structure"]
    mass = structure["masses"]["blade"]
    own = [spring for spring in structure["springs"] if "blade" in spring["between"]]
    assert [set(spring["between"]) for spring in own] == [{"blade", "ground"}]
    assert not [each for each in structure.get("dampers", []) if "blade" in each["between"]]
    (pole, _) = np.roots([mass, own[0].get("c", 0.0), own[0]["k"]])
    return abs(pole) / (2.0 * math.pi), -pole.real / abs(pole)


@pytest.mark.parametrize("name", TEMPLATES)
def test_frequency_and_damping_are_those_asked_for(name: str) -> None:
    frequency, damping = blade_alone(template_tables(name, ASKED))
    assert frequency == pytest.approx(ASKED["frequency_hz"], rel=1e-8)
    assert damping == pytest.approx(ASKED["damping_ratio"], rel=1e-8)


ALONE: dict[str, dict[str, Any]] = {
    "ground-damper": {"normal_load": 1.0},
    "platform-damper": {"angle": 0.0},
    "shroud": {"angle": 1.4, "normal_load": 1.0, "kn": 1e-2},
    "split-ring": {},
}
"""What makes the contact rub and not press, beside neighbours that lie flat and move against each other."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long if name == "shroud" else ()) for name in TEMPLATES]
)
def test_without_friction_the_response_is_that_of_the_blade(name: str) -> None:
    """The resonance is F / (2 D k) at f sqrt(1 - 2 D²)."""
    flat = {} if name == "ground-damper" else {"blades": 500, "engine_order": 250}
    branch = solver.sweep(new_scene(name, **ASKED, **ALONE[name], **flat, mu=1e-9))
    k = ASKED["modal_mass"] * (2.0 * math.pi * ASKED["frequency_hz"]) ** 2
    d = ASKED["damping_ratio"]
    assert branch.peak is not None
    assert branch.peak.at == pytest.approx(ASKED["frequency_hz"] * math.sqrt(1.0 - 2.0 * d**2), rel=1e-5)
    assert branch.peak.value == pytest.approx(20.0 / (2.0 * d * k), rel=1e-3)


LOADED: dict[str, dict[str, Any]] = {
    "ground-damper": {"normal_load": 1e6},
    "platform-damper": {"speed": 60_000.0, "damper_mass": 1e-4, "angle": 0.3},
    "shroud": {"normal_load": 1e6},
    "split-ring": {"speed": 60_000.0, "damper_mass": 1e-4},
}


@pytest.mark.parametrize(
    ("name", "below"),
    [("ground-damper", 1e-6), ("platform-damper", 0.05), ("shroud", 1e-6), ("split-ring", 0.05)],
)
def test_stuck_the_resonance_is_that_of_the_closed_form(name: str, below: float) -> None:
    """Under a large load; of a body the closed form is an upper bound, and the band ends above it."""
    answers = {**ASKED, **LOADED[name], **({} if name == "ground-damper" else DISK)}
    template = TEMPLATES[name].model_validate(answers)
    scene = new_scene(name, **answers)
    branch = solver.sweep(scene)
    k = ASKED["modal_mass"] * (2.0 * math.pi * ASKED["frequency_hz"]) ** 2
    stuck = ASKED["frequency_hz"] * math.sqrt(1.0 + template.stiffening / k)
    assert branch.peak is not None
    damping = ASKED["damping_ratio"] * ASKED["frequency_hz"] / stuck
    ratio = branch.peak.at / (stuck * math.sqrt(1.0 - 2.0 * damping**2))
    assert 1.0 - below <= ratio <= 1.0 + 1e-6
    assert scene.observe.band[1] > stuck


def drawn(name: str, chance: random.Random) -> dict[str, Any]:
    """Answers at random within what is met with; a body's load is above the force."""

    def log(low: float, high: float) -> float:
        return math.exp(chance.uniform(math.log(low), math.log(high)))

    kt = log(3e5, 1e7)
    answers: dict[str, Any] = {
        "frequency_hz": log(100.0, 2000.0), "modal_mass": log(0.03, 0.6), "damping_ratio": log(5e-4, 5e-3),
        "kt": kt, "mu": chance.uniform(0.15, 0.6), "force": log(1.0, 50.0),
    }  # fmt: skip
    if name == "ground-damper":
        return answers
    blades = chance.randint(10, 90)
    answers |= {"blades": blades, "engine_order": chance.randint(1, blades // 2), "kn": kt * log(0.7, 2.0)}
    if name == "shroud":
        return answers | {"angle": chance.uniform(0.3, 1.3)}
    mass, radius, speed = log(2e-3, 1e-2), chance.uniform(0.2, 0.6), log(3000.0, 10000.0)
    load = mass * radius * (speed * math.pi / 30.0) ** 2
    answers |= {"damper_mass": mass, "radius": radius, "speed": speed, "force": load * log(0.02, 0.3)}
    if name == "platform-damper":
        answers |= {"shape": chance.choice(["wedge", "cylinder"]), "angle": chance.uniform(0.2, 0.9)}
    return answers


@pytest.mark.parametrize("name", TEMPLATES)
def test_scenes_of_random_answers_are_planned_and_swept(name: str) -> None:
    chance = random.Random(name)
    for answers in ({}, *(drawn(name, chance) for _ in range(2))):
        scene = new_scene(name, **answers)
        assert solver.plan(scene).unknowns > 0
        branch = solver.sweep(scene, harmonics=5)
        assert branch.status is solver.BranchStatus.COMPLETED, answers
        assert branch.peak is not None


@pytest.mark.parametrize("name", TEMPLATES)
def test_answers_at_the_ends_of_their_ranges_make_a_scene_or_are_named(name: str) -> None:
    chance = random.Random(f"ends of {name}")
    properties = template_schema(TEMPLATES[name])["properties"]
    ends = {
        key: [given.get("minimum", given.get("exclusiveMinimum", 0.0)), given["maximum"]]
        for key, given in properties.items()
        if "maximum" in given
    }
    made = 0
    for _ in range(200):
        answers = {key: chance.choice(given) for key, given in ends.items() if chance.random() < 0.4}
        words = []
        try:
            new_scene(name, **answers)
        except solver.SceneError as refused:
            words = [issue.said() for issue in refused.issues]
        else:
            made += 1
            continue
        assert words
        assert all(words)
    assert made > 0


@pytest.mark.parametrize("name", TEMPLATES)
def test_every_question_has_words_and_a_default(name: str) -> None:
    schema = template_schema(TEMPLATES[name])
    assert "required" not in schema
    assert [key for key, given in schema["properties"].items() if not given["description"]] == []
    assert schema["description"]


@pytest.mark.parametrize(
    ("name", "answers", "pointer", "words"),
    [
        ("gear", {}, "", "no template 'gear': there are ground-damper, platform-damper"),
        ("shroud", {"muu": 1}, "/muu", "`muu` is no question of 'shroud': there are name, frequency_hz"),
        ("shroud", {"blades": 2}, "/blades", "`blades` must be >= 3, got 2"),
        ("split-ring", {"mu": 0.0}, "/mu", "`mu` must be > 0, got 0.0"),
        ("platform-damper", {"shape": "disk"}, "/shape", "'disk'"),
        ("ground-damper", {"name": "my blade"}, "/name", "'my blade'"),
    ],
)
def test_wrong_answers_are_named(name: str, answers: dict[str, Any], pointer: str, words: str) -> None:
    with pytest.raises(solver.SceneError, match=r".") as caught:
        new_scene(name, **answers)
    (issue,) = caught.value.issues
    assert issue.pointer == pointer
    assert words in issue.said()
