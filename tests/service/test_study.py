"""Studies: bodies, commands, submissions and functions of Python take the same keys."""

from __future__ import annotations

import inspect
import pickle

import pytest

from service.cli.options.key_options import key_options, options_of
from service.cli.study_command import command_of
from service.jobs.kinds import SHIPPED
from service.jobs.study import Study
from solver.results.views import on_demand

STUDIES = {kind.name: kind.request for kind in SHIPPED if issubclass(kind.request, Study)}
OF_THE_COMMAND = {"--set", "--plot", "--out", "--json"}
# Taken otherwise by the function: as one of three words, as a pair, as an object, or by another function.
OTHERWISE = {
    "design": {"uncertain", "aim", "quantile", "samples", "seed"}, "controlled": {"no_stability"}, "march": {"history"}, "plan": {"effects"},
    "solve": {"effects", "every", "starts", "seed"},
    "sweep": {"effects", "multipliers", "switched"},
    "modes": {
        "start", "stop", "performance", "aero_damping", "mode_alone", "motions", "exact_peaks", "disturbance",
        "phase_resonance",
    },
}  # fmt: skip


@pytest.mark.parametrize("name", STUDIES)
def test_every_face_has_the_same_keys(name: str) -> None:
    study = STUDIES[name]
    flags = {one.name: one.flag for one in key_options(SHIPPED[name], None)}
    own = {flags[key] for key in study.own_keys()}
    assert set(options_of(command_of(study))) - OF_THE_COMMAND == own
    function = inspect.signature(inspect.unwrap(on_demand(study.FUNCTION)))
    assert set(study.own_keys()) - OTHERWISE.get(name, set()) <= function.parameters.keys()


@pytest.mark.parametrize("name", STUDIES)
def test_what_is_left_out_is_the_same_everywhere(name: str) -> None:
    """A default of a body, shown by the command, is that of the function."""
    study = STUDIES[name]
    function = inspect.signature(inspect.unwrap(on_demand(study.FUNCTION))).parameters
    for key in study.own_keys():
        field = study.model_fields[key]
        if field.is_required() or key in OTHERWISE.get(name, ()):
            continue
        default = function[key].default
        assert field.default == default or (field.default is None and default is not inspect.Parameter.empty)


@pytest.mark.parametrize("name", STUDIES)
def test_a_worker_is_sent_it_by_name(name: str) -> None:
    kind = SHIPPED[name]
    assert pickle.loads(pickle.dumps((kind.request, kind.resolve))) == (kind.request, kind.resolve)
    assert callable(pickle.loads(pickle.dumps(kind.run)))
