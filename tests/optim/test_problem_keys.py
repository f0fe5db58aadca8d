"""The keys of a design problem as arguments, options and places of what is wrong."""

import inspect
from typing import Any, get_args, get_type_hints

import pytest

import optim
import solver
from optim.problem.checks import Aim, AimWord, DesignError, Method, MethodWord, Scaling, ScalingWord
from optim.problem.design_problem import pose
from optim.problem.issues import problem_issues, uncertainty_issues
from optim.problem.keyword_types import DesignKeywords, FrontKeywords
from optim.problem.problem_keys import OPTIONS, ROBUST, DesignKeys, FrontKeys, options

TWO = solver.load_scene("two-dof")
# `limits` sets keys that have words of their own, with types; it is none itself.
OF_NO_PROBLEM = {"scene", "limits", "on_progress", "should_stop", "on_best"}


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("design", set(DesignKeys.model_fields) - {OPTIONS, *ROBUST}),
        ("robust_design", set(DesignKeys.model_fields) - {OPTIONS}),
        ("pareto_front", set(FrontKeys.model_fields)),
    ],
)
def test_the_arguments_are_the_keys(name: str, keys: set[str]) -> None:
    function = getattr(optim, name)
    assert set(inspect.signature(function).parameters) - OF_NO_PROBLEM == keys
    text = inspect.getdoc(function) or ""
    assert [key for key in keys if f"\n{key} : " not in text] == []
    assert "**problem" not in text


def test_checkers_know_the_keys() -> None:
    assert set(get_type_hints(DesignKeywords)) == set(DesignKeys.model_fields) - {OPTIONS, *ROBUST}
    assert set(get_type_hints(FrontKeywords)) == set(FrontKeys.model_fields) - {"points"}


def test_no_two_keys_share_an_option() -> None:
    flags = [one.flag for one in (options(DesignKeys) | options(FrontKeys)).values()]
    assert len(flags) == len(set(flags))


@pytest.mark.parametrize(
    ("words", "known"), [(MethodWord, Method), (ScalingWord, Scaling), (AimWord, Aim)]
)  # fmt: skip
def test_the_words_of_a_key_are_those_understood(words: Any, known: Any) -> None:
    assert get_args(words) == tuple(one.value for one in known)


def test_an_argument_that_is_no_key_is_refused() -> None:
    with pytest.raises(TypeError, match=r"'max_peek'.*max_peak"):
        optim.design(TWO, max_peek=1.0)


@pytest.mark.parametrize(
    ("place", "name"), [(("limit",), "limit"), (("cases", 0, "set", "damper.mu"), "cases[0].set.damper.mu")]
)
def test_an_error_is_named_by_its_place(place: tuple[str | int, ...], name: str) -> None:
    error = DesignError(place, 1, "must be another one")
    assert (error.name, error.place) == (name, place)
    assert str(error) == f"`{name}` must be another one, got 1"


def test_what_is_wrong_is_told_at_once_and_python_raises_the_first() -> None:
    given = {"variables": {"damper.N0": [20, 300]}, "start": {"damper.N0": 5}, "limit": -1, "basins": 0}
    assert [one.pointer for one in problem_issues(TWO, given)] == ["/start/damper.N0", "/limit", "/basins"]
    with pytest.raises(DesignError, match="`limit`"):
        pose(TWO, **given)


def test_a_bad_sample_is_told_by_its_number() -> None:
    samples = [{"damper.mu": 0.3}, {"bumper.mu": 0.3}]
    (issue,) = uncertainty_issues(TWO, {"variables": {"damper.N0": [20, 300]}}, samples)
    assert issue.pointer == "/uncertain/1/bumper.mu"
