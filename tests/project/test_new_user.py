"""The benchmark of a new user: what it reads off the pages is what the pages say."""

import shlex

import pytest

from benchmarks.harness import WrongResultError
from benchmarks.new_user import TUTORIALS, Tutorial, edited, stages, steps

SCENE = """name = "blade"

[structure]
kind = "matrices"
damping_ratio = 0.001

# A contact joins two DOFs; fill it in:
# [[contacts]]
# name = "damper"

[excitation]
amplitude = 1.0 # N
engine_order = 1

[observe]
band = [129.0, 517.0]
"""


@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda tutorial: tutorial.page)
def test_every_page_is_followed_from_the_mesh_to_a_report(tutorial: Tutorial) -> None:
    """Each command once, in order, with the edit between the import and the first use of the scene."""
    text = tutorial.text()
    done = list(steps(text))
    commands = [line for kind, line in done if kind == "sh"]
    outside = text.split("```sh\n")[1:]
    assert commands == [line for block in outside for line in block.split("```")[0].splitlines()]
    (edit,) = [i for i, (kind, _) in enumerate(done) if kind == "edit"]
    assert " import " in done[edit - 1][1]
    assert shlex.split(done[edit + 1][1])[:2] == ["stickslip", "plan"]
    assert sum("--report" in line for line in commands) == 1


def test_the_edit_of_the_blade_is_the_one_its_page_asks_for() -> None:
    (section,) = [text for kind, text in steps(TUTORIALS[0].text()) if kind == "edit"]
    scene, keys = edited(SCENE, section)
    assert "\ndamping_ratio = 0.001\n" in scene
    assert 'between = ["platform", "ground"]' in scene
    assert "# A contact joins" not in scene
    assert "amplitude = 1.0 # N" in scene
    assert 0 < keys < 200


def test_the_edit_of_the_disk_changes_force_and_band_too() -> None:
    (section,) = [text for kind, text in steps(TUTORIALS[1].text()) if kind == "edit"]
    scene, _ = edited(SCENE, section)
    for line in ("damping_ratio = 0.0005", "amplitude = 20.0", "engine_order = 4", "band = [150.0, 450.0]"):
        assert f"\n{line}\n" in scene
    assert scene.count("[[contacts]]") == 2


def test_an_edit_that_the_scene_does_not_allow_is_told() -> None:
    (section,) = [text for kind, text in steps(TUTORIALS[1].text()) if kind == "edit"]
    with pytest.raises(WrongResultError, match="engine_order"):
        edited(SCENE.replace("engine_order = 1\n", ""), section)


PRINTED = [
    (1.0, "python3 -m venv .venv\n"),
    (4.0, ".venv/bin/python -m pip install --quiet setuptools numpy\n"),
    (9.0, ".venv/bin/python -m service.warm_up --first & kernels=$!\n"),
    (9.0, ".venv/bin/python -m pip install --quiet -e '.[fast]'\n"),
    (90.0, ".venv/bin/stickslip demo\n"),
    (95.0, "Best damper of two-dof\n"),
    (95.5, "damper.N0        104.8 N\n"),
    (96.0, "shroud.N0        185.5 N\n"),
]


def test_the_stages_of_a_set_up_are_told_apart() -> None:
    begins, optimum, line = stages(PRINTED)
    assert begins == [
        ("environment", 1.0), ("numerical packages", 4.0), ("kernels beside the other packages", 9.0),
        ("demo", 90.0),
    ]  # fmt: skip
    assert (optimum, line) == (95.5, "damper.N0 104.8 N")


def test_an_optimum_before_the_set_up_is_none() -> None:
    with pytest.raises(WrongResultError, match="no optimum"):
        stages([PRINTED[-1], *PRINTED[:-3]])
