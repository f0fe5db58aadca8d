"""Scenes from code are those of files, and what is wrong with them is told at its place."""

import tomllib

import pytest

import solver
from solver import Scene, SceneBuilder, SceneError


def two_dof() -> SceneBuilder:
    return (
        SceneBuilder("two-dof")
        .mass("m1", 1.0)
        .mass("m2", 1.0)
        .spring("ground", "m1", 157.91367041742973, 0.5, name="k1")
        .spring("m1", "m2", 39.47841760435743, 0.5, name="k2")
        .contact("damper", "m2", "ground", kt=30.0, mu=0.3, N0=100.0, N1_ratio=0.3)
        .force("m1", 100.0)
        .observe("m2", 0.2, 2.6)
    )


def test_a_scene_from_code_is_the_one_of_the_file() -> None:
    built = two_dof()
    assert built.build() == solver.load_scene("two-dof")
    assert Scene.from_dict(tomllib.loads(built.toml())) == built.build()


def test_a_disk_with_another_law_and_a_dashpot() -> None:
    disk = (
        SceneBuilder("disk", sectors=8, stiffness_proportional_damping=1e-6)
        .mass("blade", 0.1)
        .mass("rim", 0.4)
        .spring("blade", "rim", 2e6)
        .spring("rim", "ground", 8e6)
        .spring("rim", "rim@next", 1e5)
        .dashpot("blade", "ground", 0.4)
        .contact("shroud", "blade", "blade@next", law="polynomial", a1=1e6, a3=1e12)
        .force("blade", 3.0, engine_order=2)
        .observe("blade", 400.0, 900.0)
        .part("recovery", name="stress", terms={"blade": 1e9, "rim": -1e9}, unit="Pa")
        .build()
    )
    assert disk.structure.sector_count == 8
    assert disk.engine_order == 2
    assert disk.contacts[0].law == "polynomial"
    assert disk.recovery[0].name == "stress"
    assert solver.solve(disk, frequency_hz=600.0, harmonics=3).converged


def test_what_is_wrong_is_told_at_its_place() -> None:
    wrong = two_dof().spring("m2", "m3", -1.0).contact("other", "m1", "ground", kt=1.0, mu=0.3, N_0=1.0)
    with pytest.raises(SceneError) as refused:
        wrong.build()
    pointers = {issue.pointer for issue in refused.value.issues}
    assert "/structure/springs/2/k" in pointers
    assert any(pointer.startswith("/contacts/1") for pointer in pointers)
    with pytest.raises(SceneError, match="observe"):
        SceneBuilder("empty").mass("m", 1.0).force("m", 1.0).build()
