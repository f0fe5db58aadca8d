"""Cases and limits with types say what tables and keys say."""

from dataclasses import fields

import pytest

import optim
import solver
from optim import Case, DesignError, Limit
from optim.problem.design_problem import pose, with_limits
from optim.problem.problem_keys import CaseRequest

DISK = {"shroud.N0": (20.0, 3000.0)}


def test_a_case_has_the_keys_of_a_table() -> None:
    assert [one.name for one in fields(Case)] == list(CaseRequest.model_fields)
    case = Case(name="second", engine_order=2, weight=0.5)
    assert dict(case) == {"name": "second", "engine_order": 2, "weight": 0.5}
    assert len(case) == 3
    with pytest.raises(KeyError):
        case["band"]


def test_cases_are_posed_as_tables_are() -> None:
    scene = solver.load_scene("bladed-disk")
    typed = [Case(name="first"), Case(name="second", engine_order=2, band=(500.0, 800.0), weight=0.5)]
    tables = [{"name": "first"}, {"name": "second", "engine_order": 2, "band": [500.0, 800.0], "weight": 0.5}]
    assert pose(scene, variables=DISK, cases=typed) == pose(scene, variables=DISK, cases=tables)


def test_limits_are_the_keys() -> None:
    limits = [Limit("peak", 1e-4), Limit("band_hz", 60.0), Limit("friction_work", 0.1, "shroud"),
              Limit("friction_work", 0.2, "root")]  # fmt: skip
    assert with_limits({"limit": 1e-5}, limits) == {
        "limit": 1e-5, "max_peak": 1e-4, "max_band_hz": 60.0,
        "max_friction_work": {"shroud": 0.1, "root": 0.2},
    }  # fmt: skip
    scene = solver.load_scene("bladed-disk")
    typed = pose(scene, variables=DISK, **with_limits({}, [Limit("band_hz", 60.0)]))
    assert typed == pose(scene, variables=DISK, max_band_hz=60.0)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ([Limit("peaks", 1.0)], ["limits[0].what", "'peaks'", "peak", "did you mean"]),
        ([Limit("peak", 1.0), Limit("peak", 2.0)], ["limits[1]", "given twice"]),
        ([Limit("friction_work", 1.0, "a"), Limit("friction_work", 2.0, "a")], ["limits[1]", "'a'"]),
        ([Limit("friction_work", 1.0), Limit("friction_work", 2.0, "a")], ["limits[1]", "given twice"]),
        ([{"peak": 1.0}], ["limits[0]", "Limit("]),
    ],
)
def test_wrong_limits_are_named(limits: list[Limit], words: list[str]) -> None:
    with pytest.raises(DesignError) as refused:
        with_limits({}, limits)
    assert all(word in str(refused.value) for word in words), str(refused.value)


def test_a_value_that_a_limit_cannot_have_is_named_as_its_key() -> None:
    with pytest.raises(DesignError, match="max_peak"):
        optim.design(solver.load_scene("two-dof"), limits=[Limit("peak", -1.0)])
