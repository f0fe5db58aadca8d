"""Studies: bodies, commands, submissions and functions of Python take the same keys, by one contract."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Iterator, Mapping

from each import each

from optim.problem.problem_keys import options
from service.cli.options.key_options import key_options, options_of
from service.cli.table import STUDY, TOP
from service.jobs.common.problem_requests import ProblemRequest
from service.jobs.kind_registry import JobRequest
from service.jobs.kinds import SHIPPED, studies
from service.jobs.kinds.bodies import KIND, body_model
from service.jobs.study import Study
from solver.first_use import on_demand

STUDIES = studies()
OF_THE_COMMAND = {"--set", "--plot", "--out", "--json", "--report", "--uncertain", "--problem", "--without"}
# Functions besides that take keys of a study.
BESIDES = {
    "solve": ("solver:solve_all",), "design": ("optim:robust_design",), "sensitivities": (),
    "modes": ("solver:limit_cycles",), "wear": ("solver:least_worn_peak",),
    "quasi-periodic": ("solver:quasi_periodic_curve",),
    "posterior": ("optim:compare_models", "optim:reassemblies"),
}  # fmt: skip
# Keys that Python takes otherwise: as one of three words, as a pair, or by a function of its own.
OTHERWISE: Mapping[str, set[str]] = {
    "controlled": {"no_stability"}, "march": {"history"}, "solve": {"every", "certify", "multipliers"},
    "peaks": {"certify"}, "design": {"certify", "options"}, "sweep": {"multipliers", "switched"},
    "quasi-periodic": {"to_hz"}, "posterior": {"varied", "assemblies", "models"},
    "wear": {"parameter", "start", "stop", "factors"},
    "modes": {
        "start", "stop", "performance", "aero_damping", "motions", "exact_peaks", "disturbance", "certify",
        "phase_resonance",
    },
}  # fmt: skip
# Arguments of Python alone: objects and callbacks, and what keys say in other words.
REQUIRED = inspect.Parameter.empty
WATCHED = {"scene", "limits", "on_progress", "should_stop", "on_best"}
OF_PYTHON: Mapping[str, set[str]] = {
    "sweep": {"settings", "course"},
    "sensitivities": {"values"},
    "map": {"effects"},
    "peaks": {"effects"},
    "march": {"start", "tractions"},
    "transient": {"start"},
    "modes": {"amplitudes", "errors", "found", "most_points", "stability"},
    "controlled": {"errors", "most_points", "stability"},
}


def parameters(study: type[Study]) -> Mapping[str, inspect.Parameter]:
    """Those of the functions behind a study; of what is grouped the fields."""
    places = (study.FUNCTION, *BESIDES.get(study.NAME, ()))
    functions = [inspect.signature(inspect.unwrap(on_demand(place))) for place in places]
    taken = {name: one for each in reversed(functions) for name, one in each.parameters.items()}
    for argument, place in study.GROUPED.items():
        del taken[argument]
        taken |= inspect.signature(on_demand(place)).parameters
    return taken


def defaults(study: type[Study]) -> Iterator[tuple[str, object, object]]:
    """Each key that may be left out, with the default of the body and that of the function."""
    known = parameters(study)
    for key in set(study.own_keys()) - OTHERWISE.get(study.NAME, set()):
        field = study.model_fields[key]
        if not field.is_required():
            yield key, field.default, known[key].default


@each("name", STUDIES)
def test_every_face_has_the_same_keys(name: str) -> None:
    study, own = STUDIES[name], set(STUDIES[name].own_keys())
    known = set(parameters(study))
    assert own - OTHERWISE.get(name, set()) <= known, "a key that Python lacks"
    assert known - WATCHED - OF_PYTHON.get(name, set()) - own == set(), "an argument without a key"
    made = {one.name: one for one in key_options(SHIPPED[name], None)}
    flags = {made[key].flag for key in own}
    command = TOP[name].function()
    taken = set(options_of(command)) - OF_THE_COMMAND
    if name in (
        "identify",
        "posterior",
    ):  # measured data are files, an argument of the command, and what their columns are
        flags = flags - {"--data"} | {"--column"}
    if issubclass(study, ProblemRequest):  # tables stand in the problem file alone
        flags = {one.flag for one in options(study).values()}
    assert taken == flags
    body = body_model(name, study)
    keys = {made[key].key for key in own} | set(JobRequest.model_fields) | {KIND, "scene", "set"}
    assert body.model_json_schema()["properties"].keys() == keys


@each("name", STUDIES)
def test_what_is_left_out_is_the_same_everywhere(name: str) -> None:
    """A default of a body, shown by the command, is that of the function."""
    for key, of_body, of_function in defaults(STUDIES[name]):
        unsaid = of_body in (None, "auto") and (key == "uncertain" or of_function is not REQUIRED)
        assert of_body == of_function or unsaid, key


@each("name", STUDIES)
def test_a_worker_is_sent_it_by_name(name: str) -> None:
    kind = SHIPPED[name]
    assert pickle.loads(pickle.dumps((kind.request, kind.resolve))) == (kind.request, kind.resolve)
    assert callable(pickle.loads(pickle.dumps(kind.run)))
    assert not hasattr(STUDIES[name], "FIGURE") or callable(on_demand(STUDIES[name].FIGURE))


def test_every_kind_is_a_study_with_a_command() -> None:
    assert STUDIES.keys() == {kind.name for kind in SHIPPED}
    assert STUDIES.keys() <= TOP.keys()
    assert {name for name, entry in TOP.items() if getattr(entry, "home", "") == STUDY} <= STUDIES.keys()
