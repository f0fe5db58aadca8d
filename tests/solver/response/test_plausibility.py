"""What of a scene is hardly meant: a note just outside of what is plausible, none just inside."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import optim
import solver
from solver.response.plausibility import FAR, OVERDAMPED, ROUGH, SOUND, STIFF, plausibility
from solver.scene.scene import Scene

DOCS = Path(__file__).parents[3] / "docs"
OMEGA = math.sqrt(1e5 / 0.1)  # of the one mass, all contacts open
HERTZ = OMEGA / (2.0 * math.pi)


def oscillator(
    *, band: tuple[float, float] = (100.0, 200.0), c: float = 1.0, mu: float = 0.3, kt: float = 1e4,
    amplitude: float = 10.0,
) -> Scene:  # fmt: skip
    """One mass of 0.1 kg on 1e5 N/m: 159 Hz; with the contact stuck 167 Hz."""
    spring = {"name": "k", "between": ["x", "ground"], "k": 1e5, "c": c}
    return Scene.from_dict(
        {
            "name": "one", "structure": {"kind": "lumped", "masses": {"x": 0.1}, "springs": [spring]},
            "contacts": [{"name": "rub", "between": ["x", "ground"], "kt": kt, "mu": mu, "N0": 20.0}],
            "excitation": {"dof": "x", "amplitude": amplitude}, "observe": {"dof": "x", "band": list(band)},
        }
    )  # fmt: skip


LONGEST = SOUND * math.pi / (2.0 * OMEGA)
STUCK = math.sqrt(1.1e5 / 0.1) / (2.0 * math.pi)
IN, OUT = 1.0 - 1e-6, 1.0 + 1e-6
EDGES: dict[str, tuple[str, Callable[[float], Scene]]] = {
    "band below": ("far_from_band", lambda f: oscillator(band=(1.0, HERTZ / (FAR * f)))),
    "band above": ("far_from_band", lambda f: oscillator(band=(FAR * f * STUCK, 1e4))),
    "friction": ("friction", lambda f: oscillator(mu=ROUGH * f)),
    "damping": ("damping", lambda f: oscillator(c=2.0 * OVERDAMPED * 0.1 * OMEGA * f)),
    "no damping": ("damping", lambda f: oscillator(c=2e-9 / f * 0.1 * OMEGA)),
    "deflection": ("static_deflection", lambda f: oscillator(amplitude=1e5 * LONGEST * f)),
    "contact": ("stiff_contact", lambda f: oscillator(kt=1e5 * STIFF * f)),
}


@pytest.mark.parametrize("case", EDGES)
def test_each_note_begins_where_it_is_said_to(case: str) -> None:
    name, made = EDGES[case]
    assert plausibility(made(IN)) == ()
    (note,) = plausibility(made(OUT))
    assert note.name == name
    assert note.words


def test_nodes_say_how_large_a_structure_is() -> None:
    nodes = [
        {"name": "a", "at": [0.0, 0.0, 0.0], "dofs": {"x": "x"}},
        {"name": "b", "at": [0.3, 0.0, 0.4], "dofs": {"x": "y"}},
    ]

    def two(amplitude: float) -> Scene:
        raw = oscillator(amplitude=amplitude).to_dict()
        raw["structure"]["masses"] = {"x": 0.1, "y": 0.1}
        raw["structure"]["springs"] = [
            raw["structure"]["springs"][0],
            {"name": "j", "between": ["y", "ground"], "k": 1e5, "c": 1.0},
        ]
        return Scene.from_dict({**raw, "nodes": nodes})

    assert plausibility(two(1e5 * 0.5 * IN)) == ()
    (note,) = plausibility(two(1e5 * 0.5 * OUT))
    assert note.name == "static_deflection"
    assert note.numbers["longest_m"] == pytest.approx(0.5)


def test_nothing_that_excites_is_told() -> None:
    (note,) = plausibility(oscillator(amplitude=0.0))
    assert note.name == "amplitude_zero"
    assert plausibility(oscillator(amplitude=1e-12)) == ()


def test_a_higher_mode_and_a_superharmonic_are_near() -> None:
    """The first frequency may be far from a band of the third, and from that of a harmonic observed alone."""
    raw = oscillator().to_dict()
    raw["structure"]["masses"]["y"] = 0.1
    raw["structure"]["springs"].append({"name": "j", "between": ["x", "y"], "k": 1e8, "c": 1.0})
    raw["observe"]["band"] = [6500.0, 8000.0]
    assert plausibility(Scene.from_dict(raw)) == ()
    raw = oscillator().to_dict()
    raw["observe"] |= {"band": [20.0, 25.0], "harmonic": 7}
    assert plausibility(Scene.from_dict(raw)) == ()


def test_a_floating_part_is_judged_as_its_contacts_hold_it() -> None:
    raw = oscillator().to_dict()
    raw["structure"]["springs"] = [{"name": "k", "between": ["x", "ground"], "k": 0.0, "c": 1.0}]
    raw["observe"]["band"] = [30.0, 70.0]
    assert plausibility(Scene.from_dict(raw)) == ()


@pytest.mark.parametrize("name", [*solver.shipped_scenes(), str(DOCS / "blade.toml")])
def test_shipped_scenes_have_none(name: str) -> None:
    assert plausibility(solver.load_scene(name)) == ()


def test_answers_tell_it_once() -> None:
    scene = oscillator(mu=2.0)
    answers = [
        solver.plan(scene), solver.solve(scene, frequency_hz=150.0, harmonics=1),
        solver.sweep(scene, harmonics=1), optim.design(scene, variables={"rub.N0": (1.0, 50.0)}, harmonics=1),
    ]  # fmt: skip
    for answer in answers:
        (note,) = answer.to_json()["notes"]
        assert note["name"] == "friction"
        said = [value for block in answer.blocks() for _, value in block.pairs]
        assert said.count(note["words"]) == 1


def test_the_damping_is_that_of_the_observed_mode() -> None:
    """Of a mode that is neither driven nor observed nothing is said."""
    raw = oscillator().to_dict()
    raw["structure"]["masses"]["y"] = 0.1
    raw["structure"]["springs"].append({"name": "j", "between": ["y", "ground"], "k": 1e5, "c": 0.0})
    assert plausibility(Scene.from_dict(raw)) == ()
    raw["excitation"]["dof"] = raw["observe"]["dof"] = "y"
    (note,) = plausibility(Scene.from_dict(raw))
    assert note.name == "damping"
    assert note.numbers["natural_hz"] == pytest.approx(HERTZ)
    assert np.isclose(note.numbers["damping_ratio"], 0.0)
