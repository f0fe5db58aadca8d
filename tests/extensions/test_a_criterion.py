"""A criterion of this folder (`rms_amplitude`): named once, designs are minimised and limited by it.

Its sum can be had from responses at single frequencies, without any of the design layer.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from docs_tables import TABLES, criteria_table
from rms_amplitude import RMS, WEIGHTS, frequencies

import optim
import solver
from optim.criteria.criterion import CRITERIA, criteria, register, unregister
from optim.criteria.evaluation import evaluate
from optim.problem.design_problem import pose
from service.client.client import Client
from service.errors import ServiceProblem
from solver import extensions
from solver.errors import SettingError

HARMONICS = 3
BOUNDS = {"damper.N0": (20.0, 400.0)}
NAMED = json.dumps(["rms_amplitude:RMS"])


@pytest.fixture
def named(monkeypatch: pytest.MonkeyPatch) -> None:
    """In this process."""
    monkeypatch.setenv(extensions.VARIABLE, NAMED)


def by_solutions(load: float, mu: float = 0.3) -> float:
    """The same number from responses at single frequencies."""
    scene = solver.load_scene("two-dof").with_values({"damper.N0": load, "damper.mu": mu})
    a = [
        solver.solve(scene, frequency_hz=hz, harmonics=HARMONICS).max_abs
        for hz in frequencies(scene).tolist()
    ]
    return float(np.sqrt(0.5 * WEIGHTS @ np.square(a)))


@pytest.mark.usefixtures("named")
def test_value_gradient_and_hessian_are_those_of_the_sum() -> None:
    problem = pose(
        solver.load_scene("two-dof"), variables=BOUNDS, weights={"rms": 1.0}, harmonics=HARMONICS
    )  # fmt: skip
    load, step = 130.0, 0.02
    (row,) = evaluate(problem, {"damper.N0": load}).of(RMS)
    below, above = by_solutions(load - step), by_solutions(load + step)
    assert row.value == pytest.approx(by_solutions(load), rel=1e-9)
    assert row.gradient[0] == pytest.approx((above - below) / (2.0 * step), rel=1e-6)
    assert row.second is not None
    slopes = [evaluate(problem, {"damper.N0": load + side}).of(RMS)[0].gradient[0] for side in (-step, step)]
    assert row.second()[0, 0] == pytest.approx((slopes[1] - slopes[0]) / (2.0 * step), rel=1e-5)


@pytest.mark.few(2)
@pytest.mark.usefixtures("named")
@pytest.mark.parametrize("method", ["minimax", "ipopt"])
def test_it_is_minimised(method: str) -> None:
    found = optim.design(
        solver.load_scene("two-dof"), variables=BOUNDS, weights={"rms": 1.0}, harmonics=HARMONICS,
        method=method,
    )  # fmt: skip
    assert found.reached, found.status
    best = found.optimum["damper.N0"]
    value = found.evaluation.of(RMS)[0].value
    grid = [by_solutions(load) for load in np.geomspace(*BOUNDS["damper.N0"], 25)]
    assert value == pytest.approx(by_solutions(best), rel=1e-9)
    assert value <= min(grid)
    assert value <= min(by_solutions(best * factor) for factor in (0.999, 1.001))
    assert "rms amplitude" in str(found.summary())
    assert "rms_amplitude" in found.to_dataset().variables
    assert found.to_json()["held_by"]["quantity"] == "rms amplitude"


@pytest.mark.long
@pytest.mark.usefixtures("named")
def test_it_limits_the_least_peak() -> None:
    scene = solver.load_scene("two-dof")
    free = optim.design(scene, variables=BOUNDS, harmonics=HARMONICS)
    least = optim.design(scene, variables=BOUNDS, harmonics=HARMONICS, weights={"rms": 1.0})
    # Between what the least peak has and the least there is: both pull.
    bound = 0.5 * (by_solutions(free.optimum["damper.N0"]) + by_solutions(least.optimum["damper.N0"]))
    found = optim.design(scene, variables=BOUNDS, harmonics=HARMONICS, max_rms=bound)
    assert found.reached, found.status
    assert by_solutions(found.optimum["damper.N0"]) == pytest.approx(bound, rel=1e-4)
    assert found.peak.value > free.peak.value
    assert any(words.startswith("rms amplitude limit of") for words in found.active)


@pytest.mark.long
@pytest.mark.usefixtures("named")
def test_its_worst_case_is_minimised() -> None:
    uncertain = [{"damper.mu": mu} for mu in (0.28, 0.32)]
    found = optim.robust_design(
        solver.load_scene("two-dof"), variables=BOUNDS, weights={"rms": 1.0}, harmonics=HARMONICS,
        uncertain=uncertain, samples=2,
    )  # fmt: skip
    assert found.reached, found.status
    best = found.optimum["damper.N0"]
    here, below, above = (
        max(by_solutions(best * factor, mu) for mu in (0.28, 0.32)) for factor in (1.0, 0.99, 1.01)
    )
    assert found.objective == pytest.approx(here, rel=1e-9)
    assert here < min(below, above)


@pytest.mark.usefixtures("named")
def test_what_is_wrong_is_told() -> None:
    scene = solver.load_scene("two-dof")
    with pytest.raises(optim.DesignError, match=r"max_rms.*> 0"):
        pose(scene, max_rms=-1.0)
    with pytest.raises(optim.DesignError, match=r"`peak`, `band`.* and `rms` can be minimised"):
        pose(scene, weights={"rsm": 1.0})
    with pytest.raises(TypeError, match=r"max_rsm.*max_rms"):
        pose(scene, max_rsm=1.0)


@pytest.mark.long
def test_the_command_takes_its_options_and_key(tmp_path: Path, command: Callable[..., Any]) -> None:
    options = ("--variable", "damper.N0", "20", "400", "--harmonics", "3", "--json")
    bound = by_solutions(150.0)
    minimised = command("design", "two-dof", *options, "--weight", "rms=1", "--max-rms", repr(bound))
    (row,) = (row for row in minimised["rows"] if row["quantity"] == "rms amplitude" and row["weight"])
    assert row["value"] == pytest.approx(by_solutions(minimised["optimum"]["damper.N0"]), rel=1e-9)
    assert row["bound"] == bound
    (tmp_path / "problem.toml").write_text(f'scene = "two-dof"\nmax_rms = {1.001 * row["value"]!r}\n')
    limited = command("design", "--problem", "problem.toml", *options)
    assert by_solutions(limited["optimum"]["damper.N0"]) <= 1.001 * row["value"] * (1.0 + 1e-6)


@pytest.mark.long
def test_the_service_computes_it(client: Client) -> None:
    body = {
        "kind": "design", "scene": "two-dof", "variables": {"damper.N0": [20, 400]}, "harmonics": 3,
        "weights": {"rms": 1},
    }  # fmt: skip
    job = client.wait(client.submit(body).id)
    assert job.status == "successful", job
    found = client.results(job.id).result
    (row,) = (row for row in found["rows"] if row["quantity"] == "rms amplitude")
    assert row["value"] == pytest.approx(by_solutions(found["optimum"]["damper.N0"]), rel=1e-9)
    assert (row["unit"], row["weight"], row["smaller_is_better"]) == ("m", 1.0, True)


def test_the_service_refuses_and_describes_its_key(client: Client) -> None:
    with pytest.raises(ServiceProblem) as refused:
        client.submit({"kind": "design", "scene": "two-dof", "max_rms": 0})
    assert [one["pointer"] for one in refused.value.problem["errors"]] == ["/max_rms"]


def test_the_table_of_criteria_has_it(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "rms" not in criteria_table()
    monkeypatch.setenv(extensions.VARIABLE, NAMED)
    (line,) = (line for line in TABLES["design.md"]["criteria"]().splitlines() if "rms" in line)
    assert line == (
        f"| **rms amplitude** [m]: {RMS.help} | `rms` [1/m] | "
        "`max_rms`: Largest root of the mean square of the amplitude allowed [m]. `--max-rms A` |"
    )


def test_registered_for_one_process() -> None:
    register(RMS)
    try:
        assert RMS in criteria()
        with pytest.raises(ValueError, match="max_rms"):
            register(RMS)
    finally:
        unregister(RMS)
    assert RMS not in criteria()


def test_one_from_outside_does_not_take_words_of_another(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = replace(RMS, name="another rms")
    monkeypatch.setattr(CRITERIA, "added", [RMS, taken])
    with pytest.raises(
        SettingError, match="`criterion` must be the word of one criterion, not of another rms too"
    ):
        criteria()
