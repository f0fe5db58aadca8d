"""What is known of a design is not computed again: by another case, measure or number of harmonics."""

import math
from dataclasses import replace

import numpy as np
import pytest
from test_measure import HALF, lopsided

import solver
from benchmarks.problems import case_a
from optim.criteria.evaluation import evaluate
from optim.methods import enough_harmonics as enough
from optim.problem.design_problem import pose
from solver.contacts.kernels.circle import circle_hessian as hessian
from solver.continuation.branch import Branch
from solver.continuation.branches.observation import observing

LOAD = {"damper.N0": (20.0, 3000.0)}


def test_cases_that_observe_another_dof_share_a_response_wherever_they_stand() -> None:
    cases = [
        {"name": "as built"},
        {"name": "more force", "set": {"excitation.amplitude": 130.0}},
        {"name": "driven mass", "observe": "m1"},
        {"name": "narrow", "observe": "m1", "band": [0.2, 0.3]},
        {"name": "other order", "observe": "m1", "order": 2},
    ]
    problem = pose(case_a(), variables=LOAD, cases=cases, harmonics=3)
    assert [case.served_by for case in problem.cases] == [None, None, "as built", None, None]
    found = evaluate(problem, {"damper.N0": 300.0}, gradients=False)
    assert (len(found.responses), found.computed) == (5, 4)
    alone = evaluate(replace(problem, cases=problem.cases[2:3]), {"damper.N0": 300.0}, gradients=False)
    mine = max(row.value for row in found.peaks if row.case == "driven mass")
    assert mine == pytest.approx(alone.peaks[0].value, rel=1e-9)


def test_another_measure_is_read_off_a_response() -> None:
    branch = solver.sweep(lopsided(), harmonics=7)
    swept = solver.sweep(lopsided(measure=HALF), harmonics=7)
    assert isinstance(branch, Branch)
    seen = observing(branch, "b", measure=HALF)
    assert seen.peak is not None
    assert swept.peak is not None
    assert branch.peak is not None
    assert seen.peak.value == pytest.approx(swept.peak.value, rel=1e-9)
    assert seen.peak.value < 0.99 * branch.peak.value


def test_a_search_by_another_measure_computes_no_design_again() -> None:
    values = {"slides.N0": 1.5}
    wanted = {"variables": {"slides.N0": (0.5, 3.0)}, "harmonics": 5}
    first = evaluate(pose(lopsided(), **wanted), values, gradients=False)
    problem = pose(lopsided(measure=HALF), **wanted)
    named = replace(first, responses=(replace(first.responses[0], case=problem.cases[0].name),))
    again = evaluate(problem, values, gradients=False, before=named)
    assert again.computed == 0
    searched = evaluate(problem, values, gradients=False, errors=False, before=named)
    assert math.isnan(searched.branch.error_estimate)  # a search does without: it costs as much as a response
    assert searched.with_errors().branch.error_estimate == again.branch.error_estimate
    assert again.objective == pytest.approx(evaluate(problem, values, gradients=False).objective, rel=1e-9)


def test_a_response_with_more_harmonics_begins_where_the_one_before_did() -> None:
    few, more = (pose(case_a(), variables=LOAD, harmonics=count) for count in (3, 7))
    values = {"damper.N0": 300.0}
    found = evaluate(more, values, gradients=False, before=evaluate(few, values, gradients=False))
    assert found.computed == 1
    assert found.objective == pytest.approx(evaluate(more, values, gradients=False).objective, rel=1e-9)


def test_the_peak_alone_tells_what_its_response_would_be_in_doubt_by() -> None:
    problem = pose(case_a(), variables=LOAD, harmonics=3)
    found = evaluate(problem, {"damper.N0": 300.0}, gradients=False)
    told = enough._doubt_at_peaks(problem, found)
    assert told == pytest.approx(enough.doubt_in(problem, found), rel=1e-6)
    more = replace(problem, harmonics=7)
    ahead = enough._doubt_at_peaks(more, found)
    assert ahead < 0.5 * told
    there = evaluate(more, {"damper.N0": 300.0}, gradients=False, before=found)
    assert ahead <= 1.2 * enough.doubt_in(more, there)


def test_a_force_that_is_zero_has_no_direction() -> None:
    direction = hessian._direction.py_func  # type: ignore[attr-defined]
    assert direction(0.3, 1.0 + 0j, 1e-30j) == pytest.approx(0.0, abs=0.05)
    with np.errstate(invalid="ignore"):
        assert math.isnan(direction(0.3, 0j, 0j).real)
