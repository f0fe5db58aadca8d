"""`register_law`: functions plain, compiled, complex or interpreted; what fails, and where a law is known."""

import json
import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import own_laws
import pytest
from each import each
from joined_scene import JOINED
from launch import COMMAND

import optim
import solver
from solver import extensions
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.law_registry import unregister
from solver.response.solution import SolutionStatus

ROOT = Path(__file__).resolve().parent.parent.parent
HZ = 0.19
Register = Callable[..., type[AnyContact]]


@pytest.fixture
def register() -> Iterator[Register]:
    """Registers laws until the test ends."""
    made: list[type[AnyContact]] = []

    def add(name: str, **given: Any) -> type[AnyContact]:
        made.append(solver.register_law(name, **({"parameters": own_laws.PARAMETERS} | given)))
        return made[-1]

    yield add
    for law in made:
        unregister(law)


def scene(law: str, **values: float) -> solver.Scene:
    contact = {"name": "joint", "law": law, "between": ["b", "ground"], **values}
    return solver.Scene.from_dict({**JOINED, "contacts": [contact]})


def how(law: str, **values: float) -> str:
    (reason,) = (e.reason for e in solver.plan(scene(law, **values)).effects if e.name == "law of joint")
    return reason


def amplitude(law: str, **values: float) -> float:
    found = solver.solve(scene(law, **values), frequency_hz=HZ, harmonics=7)
    assert found.converged
    return found.max_abs


FUNCTIONS = {
    "plain": ({"force": own_laws.smooth}, "central differences"),
    "analytic": ({"force": own_laws.analytic}, "complex step"),
    "compiled": ({"force": own_laws.compiled}, "central differences"),
    "interpreted": ({"force": own_laws.interpreted}, "called as Python, which is slow"),
    "by-hand": ({"force": own_laws.smooth, "slopes": own_laws.slopes}, "derivatives by hand"),
}


def test_every_kind_of_function_gives_the_same(register: Register) -> None:
    found = {}
    for name, (given, words) in FUNCTIONS.items():
        register(name, odd=True, **given)
        assert words in how(name)
        found[name] = amplitude(name)
    referee = solver.march(scene("compiled"), frequency_hz=HZ).max_abs
    assert found == pytest.approx(dict.fromkeys(found, found["by-hand"]), rel=1e-8)
    assert found["plain"] == pytest.approx(referee, rel=2e-3)


def test_what_only_looks_complex_is_differenced(register: Register) -> None:
    register("folded", force=own_laws.folded, odd=True)
    assert "central differences" in how("folded")


def test_a_law_in_samples_is_the_closed_form(register: Register) -> None:
    """A spring with a slider, of which the law `coulomb` knows the events."""
    register("slider", parameters=own_laws.SLIDER, step=own_laws.drag, states=1, odd=True, monotone=True)
    closed = solver.Scene.from_dict(
        {
            **JOINED,
            "contacts": [{"name": "joint", "between": ["b", "ground"], "kt": 0.7, "mu": 1.0, "N0": 0.8}],
        }
    )
    found = solver.solve(scene("slider", k=0.7, limit=0.8), frequency_hz=HZ, harmonics=11)
    expected = solver.solve(closed, frequency_hz=HZ, harmonics=11)
    assert found.converged
    assert found.max_abs == pytest.approx(expected.max_abs, rel=1e-3)
    assert abs(found.max_abs - expected.max_abs) <= found.error_estimate + expected.error_estimate
    marched = solver.march(scene("slider", k=0.7, limit=0.8), frequency_hz=HZ)
    exact = solver.march(closed, frequency_hz=HZ)
    assert marched.half_peak_to_peak == pytest.approx(exact.half_peak_to_peak, rel=1e-5)


@pytest.mark.parametrize(
    "given", [{"force": own_laws.root}, {"force": own_laws.of_drift, "rate": own_laws.drifting, "states": 1}]
)
def test_a_law_without_a_force_that_repeats_is_no_answer(register: Register, given: dict[str, Any]) -> None:
    register("failing", **given)
    found = solver.solve(scene("failing"), frequency_hz=HZ, harmonics=5)
    assert found.status is SolutionStatus.LAW_FAILED
    assert not found.converged
    assert np.isnan(found.max_abs)
    branch = solver.sweep(scene("failing"), start=0.18, stop=0.2, harmonics=3)
    assert branch.status is not solver.BranchStatus.COMPLETED


def test_what_a_function_raises_is_raised(register: Register) -> None:
    register("raising", force=own_laws.too_far)
    with pytest.raises(ValueError, match="too far"):
        solver.solve(scene("raising"), frequency_hz=HZ, harmonics=3)


def test_its_limit_is_swept_and_designed(register: Register) -> None:
    register("smooth", force=own_laws.analytic, odd=True, monotone=True)
    found = optim.design(scene("smooth"), variables={"joint.limit": (0.1, 3.0)}, harmonics=3)
    assert found.reached, found.status
    best = found.optimum["joint.limit"]

    def peak(limit: float) -> float:
        return float(solver.sweep(scene("smooth", limit=limit), harmonics=3).peak.value)

    assert found.peak.value == pytest.approx(peak(best), rel=1e-6)
    assert found.peak.value <= min(peak(limit) for limit in (0.1, 0.5 * best, 0.9 * best))
    along = solver.sweep(scene("smooth"), "joint.limit", frequency_hz=HZ, start=0.6, stop=0.9, harmonics=7)
    assert along.amplitude[-1] == pytest.approx(amplitude("smooth", limit=0.9), rel=1e-6)


@each(
    ("given", "words"),
    [
        ({"name": "No Name"}, "lower-case letters"),
        ({"name": "coulomb"}, "there is a law 'coulomb' already"),
        ({"parameters": {}}, "must be 1 to 9"),
        ({"parameters": {"between": solver.LawParameter()}}, "no key that every contact has"),
        ({"parameters": {"k": solver.LawParameter(least=2.0, most=1.0)}}, "least < most"),
        ({"parameters": {"k": solver.LawParameter(least=0.0, default=-1.0)}}, ">= 0 and <= 1e+15"),
        ({"force": None}, "must be given, or `step` in its place"),
        ({"force": 3}, "must be a function"),
        ({"states": 2}, "must be above 0 with a `rate`, and 0 without"),
        ({"states": -1}, "whole number from 0 to 200"),
        ({"samples": 3}, "whole number from 32"),
    ],
)
def test_a_bad_definition_is_told(given: dict[str, Any], words: str) -> None:
    whole = {"name": "bad", "parameters": own_laws.PARAMETERS, "force": own_laws.smooth} | given
    with pytest.raises((solver.SettingError, ValueError)) as refused:
        solver.register_law(**whole)
    assert words in str(refused.value)


def test_a_force_that_is_no_float_is_told(register: Register) -> None:
    register("whole", force=own_laws.whole)
    with pytest.raises(solver.SettingError, match="`force` must return a float"):
        solver.solve(scene("whole"), frequency_hz=HZ, harmonics=3)


@pytest.mark.long
def test_the_command_and_the_service_know_it_by_the_environment(tmp_path: Path) -> None:
    paths = os.pathsep.join((str(ROOT), str(Path(__file__).parent)))
    named = {extensions.VARIABLE: json.dumps(["registering:SmoothFriction"]), "PYTHONPATH": paths}
    (tmp_path / "joined.toml").write_text(
        """
name = "joined"
structure = { kind = "lumped", masses = { a = 1.0 }, springs = [
    { between = ["a", "ground"], k = 1.0, c = 0.02 },
] }
excitation = { dof = "a", amplitude = 1.0 }
observe = { dof = "a", band = [0.1, 0.3] }

[[contacts]]
name = "joint"
law = "smooth-friction"
between = ["a", "ground"]
limit = 0.5
"""
    )
    code = "from service.schemas.answers import law_list; print(law_list().model_dump_json())"
    command = [*COMMAND, "solve", "joined.toml", "--frequency", str(HZ), "--harmonics", "5", "--json"]
    solved, listed = (
        subprocess.run(
            [*line], env={**os.environ, **named}, cwd=tmp_path, capture_output=True, text=True, check=True
        ).stdout
        for line in (command, [COMMAND[0], "-c", code])
    )
    assert json.loads(solved)["converged"]
    (law,) = (law for law in json.loads(listed)["items"] if law["name"] == "smooth-friction")
    assert [(one["name"], one["unit"]) for one in law["parameters"]] == [
        ("k", "N/m"), ("limit", "N"), ("v0", "m/s"),
    ]  # fmt: skip
    assert law["parameters"][1]["words"] == "Force of the friction [N]; 0.6 if left out."
