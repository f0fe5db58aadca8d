"""Derivatives of all residuals, what data cannot tell, what to measure next, what stays uncertain."""

from typing import Any

import numpy as np
import pytest
from each import each
from measured_cases import TWO_DOF, incremental_loop, table, two_dof_runs

import optim
import solver
from optim.identification.fit import Runs, read_unknowns
from optim.identification.reading import read_data
from optim.problem.checks import DesignError
from optim.problem.uncertainty_input import read_uncertain
from optim.views.tables.studies import identification
from service.rendering.text import print_told

SCENE = solver.load_scene("two-dof")
BOUNDS = {"damper.kt": (15.0, 80.0), "damper.mu": (0.1, 0.6)}
HERTZ = np.linspace(0.85, 1.6, 10).tolist()


def run(conditions: dict[str, float], seed: int = 1, truth: dict[str, float] = TWO_DOF) -> dict[str, Any]:
    return table("two-dof", truth, conditions, HERTZ, np.random.default_rng(seed), 0.02)


def identified(
    data: list[dict[str, Any]], bounds: dict[str, tuple[float, float]], **settings: Any
) -> optim.Identification:
    return optim.identify(SCENE, data, bounds, **{"harmonics": 7, "starts": 1, "candidates": {}, **settings})


def all_kinds() -> list[dict[str, Any]]:
    """A run of every quantity, and a loop."""
    hertz, size = [1.0, 1.1, 1.3], [1.9, 2.1, 1.5]
    under = {"conditions": {"excitation.amplitude": 90.0}}
    motion, force = incremental_loop(33.0, 27.0, 2.5, 200)
    return [
        {"frequency": hertz, "amplitude": size, **under},
        {"frequency": hertz, "amplitude": size, "phase": [-20.0, -60.0, -120.0], **under},
        {"frequency": hertz, "max_abs": size, **under},
        {"frequency": hertz, "half_peak_to_peak": size, "dof": "m1", **under},
        {"motion": motion.tolist(), "force": force.tolist()},
    ]


def test_the_jacobian_of_every_kind_is_that_of_differences() -> None:
    bounds = {**BOUNDS, "structure.k1": (120.0, 200.0), "damper.N1_ratio": (0.1, 0.5)}
    unknowns = read_unknowns(SCENE, bounds, None, None)
    runs = Runs(SCENE, read_data(SCENE, all_kinds(), unknowns.paths), unknowns, 7)
    z, step = np.array([0.4, 0.55, 0.5, 0.45]), 3e-4
    here = runs.at(z)
    assert here.reached.all()
    for i in range(z.size):
        # Of fourth order, so that the step may be large: solutions have a relative residual of 1e-11.
        f = {side: runs.at(z + side * step * np.eye(z.size)[i]).values for side in (-2, -1, 1, 2)}
        known = (8.0 * (f[1] - f[-1]) - (f[2] - f[-2])) / (12.0 * step)
        for part in runs.slices:
            scale = max(np.abs(known[part]).max(), 0.05 * np.abs(here.values[part]).max())
            assert np.abs(here.jacobian[part, i] - known[part]).max() <= 1e-6 * scale


def test_a_contact_that_never_slips_does_not_tell_its_friction() -> None:
    data = [run({"damper.N0": 5000.0})]
    found = identified(data, BOUNDS)
    assert found.status is optim.IdentifyStatus.UNTOLD
    (untold,) = found.untold
    assert untold.names == ("damper.mu",)
    assert "never slips" in untold.words
    kt, mu = found.estimates
    assert kt.told
    assert not mu.told
    assert mu.interval == BOUNDS["damper.mu"]
    assert found.uncertain["damper.mu"] == list(BOUNDS["damper.mu"])


def test_a_contact_that_hardly_sticks_does_not_tell_its_stiffness() -> None:
    data = [run({"damper.N0": 4.0, "excitation.amplitude": 300.0})]
    found = identified(data, BOUNDS)
    assert [one.names for one in found.untold] == [("damper.kt",)]
    assert "never sticks for long" in found.untold[0].words


def test_one_cause_is_said_and_no_two_that_contradict_each_other() -> None:
    """A contact that sticks throughout in the best fit, with data that no contact here has."""
    hertz = np.linspace(0.85, 1.6, 16)
    strange = {"frequency": hertz.tolist(), "amplitude": (1.0 + 0.9 * np.sin(25.0 * hertz)).tolist()}
    for load in (4.0, 100.0, 5000.0):
        found = identified([{**strange, "conditions": {"damper.N0": load}}], BOUNDS, harmonics=3)
        assert found.misfit
        assert not any("never" in one.words for one in found.untold)
        assert found.misfit.count("look as if") + found.misfit.count("Look at the fit") <= 1
    stuck = identified([run({"damper.N0": 5000.0})], {"damper.kt": (32.0, 34.0), "damper.mu": (0.1, 0.6)})
    words = " ".join(one.words for one in stuck.untold)
    assert not ("never slips" in words and "never sticks" in words), words


def test_friction_and_load_show_as_their_product_only() -> None:
    data = [run({"excitation.amplitude": f}) for f in (60.0, 150.0)]
    found = identified(data, {"damper.mu": (0.1, 0.6), "damper.N0": (30.0, 300.0)})
    (untold,) = found.untold
    assert set(untold.names) == {"damper.mu", "damper.N0"}
    assert "product" in untold.words
    assert "measure the load" in untold.words
    mu, load = (one.value for one in found.estimates)
    assert mu * load == pytest.approx(0.27 * 100.0, rel=0.02)


def test_the_next_measurement_is_the_one_that_slips() -> None:
    """Of two candidates one leaves the contact stuck, which tells nothing of mu; the other does."""
    data = [run({"damper.N0": 5000.0})]
    found = identified(data, BOUNDS, candidates={"damper.N0": [4000.0, 100.0]})
    first, second = found.candidates
    assert first.conditions == {"damper.N0": 100.0}
    assert first.tells == "damper.mu"
    assert first.gain > 2.0 > second.gain


def test_the_gain_of_a_candidate_is_kept_when_it_is_measured() -> None:
    """The error of mu after measuring is the one that was promised, to the scatter of the noise level."""
    before = [run({"damper.N0": 100.0, "excitation.amplitude": 90.0})]
    known = {"noise": 0.02, "candidates": {"damper.N0": [50.0]}}
    found = identified(before, BOUNDS, **known)
    after = identified([*before, run({"damper.N0": 50.0, "excitation.amplitude": 90.0}, 2)], BOUNDS, **known)
    promised = found.candidates[0]
    names = [one.name for one in found.estimates]
    i = names.index(promised.tells)
    ratio = after.estimates[i].standard_error / found.estimates[i].standard_error
    assert ratio == pytest.approx(promised.factor, rel=0.15)


def test_what_stays_uncertain_is_read_by_a_robust_design() -> None:
    found = identified(two_dof_runs(np.random.default_rng(3), 0.02), BOUNDS)
    assert set(found.uncertain) == {"centre", "covariance", "confidence"}
    spread = np.sqrt(np.diag(found.uncertain["covariance"]))
    assert spread == pytest.approx([one.standard_error for one in found.estimates])
    here = SCENE.with_values(found.values)
    assert read_uncertain(here, (), found.uncertain).coordinates[0].name == "damper.kt"


def test_noise_that_is_given_too_small_is_said() -> None:
    found = identified(two_dof_runs(np.random.default_rng(3), 0.04), BOUNDS, noise=0.005)
    assert found.reduced_chi2 > 10.0
    assert "larger than the noise given" in found.misfit


def test_data_of_another_structure_are_said_not_to_fit() -> None:
    """No load within the bounds has this response; noise of 10 % alone says nothing of the kind."""
    hertz = np.linspace(0.85, 1.6, 16)
    strange = {"frequency": hertz.tolist(), "amplitude": (1.0 + 0.9 * np.sin(25.0 * hertz)).tolist()}
    found = optim.identify(SCENE, [strange], BOUNDS, harmonics=3, starts=2)
    assert found.noise > 0.25
    assert "the model does not describe the data" in found.misfit
    noisy = identified(two_dof_runs(np.random.default_rng(3), 0.1), BOUNDS)
    assert noisy.misfit == ""


def test_conditions_that_tell_nothing_are_not_proposed(capsys: pytest.CaptureFixture[str]) -> None:
    found = identified(two_dof_runs(np.random.default_rng(3), 0.02), BOUNDS).to_json()
    useless = {"conditions": {"damper.N0": 1.0}, "like": "", "gain": 1e-8, "tells": "damper.kt"}
    for factor, wanted in ((1.0, "none of the 1 conditions tried"), (0.5, "error of damper.kt times 0.5")):
        print_told(identification({**found, "candidates": [{**useless, "factor": factor}]}))
        assert wanted in " ".join(capsys.readouterr().out.split())


def test_it_can_be_stopped() -> None:
    found = optim.identify(SCENE, [run({})], BOUNDS, should_stop=lambda: True)
    assert found.status is optim.IdentifyStatus.STOPPED
    assert not found.fitted


@each(
    ("arguments", "words"),
    [
        ({"unknowns": {}}, ["unknowns", "at least one"]),
        ({"unknowns": {"damper.mu": (0.6, 0.1)}}, ["unknowns.damper.mu", "low < high"]),
        ({"priors": {"damper.N0": (1.0, 1.0)}}, ["priors", "damper.N0", "unknown"]),
        ({"priors": {"damper.mu": (0.3, 0.0)}}, ["priors.damper.mu", "standard deviation > 0"]),
        ({"noise": 2.0}, ["noise", "0.02"]),
        ({"starts": 0}, ["starts", "from 1"]),
        ({"seed": -1}, ["seed", "from 0"]),
        ({"candidates": {"damper.mu": [0.3]}}, ["candidates.damper.mu", "neither looked for"]),
        ({"candidates": {"damper.N0": []}}, ["candidates.damper.N0", "list of numbers"]),
    ],
)
def test_bad_arguments_are_named(arguments: dict[str, Any], words: list[str]) -> None:
    given = {"data": [run({})], "unknowns": BOUNDS, **arguments}
    with pytest.raises(DesignError) as caught:
        optim.identify(SCENE, **given)
    assert all(word in str(caught.value) for word in words), str(caught.value)
