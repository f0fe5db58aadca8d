"""What is proposed of a scene, and why a study is not."""

from __future__ import annotations

import pytest

import solver
from service.jobs.names import there
from service.jobs.study import study_named


@pytest.mark.parametrize("name", solver.shipped_scenes())
def test_a_study_is_proposed_or_a_sentence_says_why_not(name: str) -> None:
    scene = solver.load_scene(name)
    for kind in there():
        study = study_named(kind)
        told = study.propose(scene)
        if isinstance(told, str):
            assert told[0].isupper(), told
            assert told.endswith("."), told
            assert "`" not in told, told
        else:
            assert told.times >= 1
            body = {**told.body, **dict.fromkeys(told.of_peak, 1e-3)}
            if kind not in ("identify", "posterior"):
                assert study(scene=name, **body).issues(scene) == []


def test_what_takes_hours_is_not_proposed() -> None:
    disk = solver.load_scene("fe-disk")
    for kind in ("march", "transient"):
        told = study_named(kind).propose(disk)
        assert isinstance(told, str)
        assert "hours" in told


def test_a_study_of_unequal_blades_is_priced_by_its_blades() -> None:
    small, large = (
        study_named("mistuning").propose(solver.load_scene(n)) for n in ("bladed-disk", "shroud-3d")
    )
    assert not isinstance(small, str)
    assert not isinstance(large, str)
    assert small.times == 100 * 8
    assert large.body["samples"] == 20
    assert large.times == 20 * 24


def test_of_a_damper_that_lifts_off_heavy_ones_are_proposed_where_every_mass_counts() -> None:
    scene = solver.load_scene("platform-cylinder")
    front, grid, design = (study_named(kind).propose(scene) for kind in ("pareto", "map", "design"))
    assert not isinstance(front, str)
    assert not isinstance(grid, str)
    assert not isinstance(design, str)
    low, high = design.body["variables"]["cylinder.mass"]
    assert front.body["variables"]["cylinder.mass"] == [1.5 * scene.value("cylinder.mass"), high]
    assert grid.body["from"] == 1.5 * scene.value("cylinder.mass") > low
    assert "fold" in study_named("peaks").propose(scene)


def test_a_front_without_variables_is_the_one_proposed() -> None:
    scene, study = solver.load_scene("platform-cylinder"), study_named("pareto")
    told = study.propose(scene)
    assert not isinstance(told, str)
    assert study.completed(scene, {"points": 3}) == {**told.body, "points": 3}
    own = {"variables": {"cylinder.mass": [0.001, 0.002]}}
    assert study.completed(scene, own) == own
