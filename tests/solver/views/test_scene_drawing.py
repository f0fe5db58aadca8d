"""The drawing of a scene: every mass, contact and force is on it, and nothing stands on anything else."""

from itertools import combinations
from math import dist

import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import solver
from solver import Scene
from solver.views.picture import layers_of, parts_of
from solver.views.plots.scenes import MOST_PARTS, scene_figure


def words(figure: Figure) -> set[str]:
    return {text.get_text() for text in figure.axes[0].texts} - {""}


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("two-dof", {"m1", "m2", "damper", "100 N"}),
        ("bladed-disk", {"tip", "middle", "root", "disk", "shroud", "50 N", "next sector"}),
        ("platform-wedge", {"left", "right", "wedge", "wedge-left-0 and 1 more", "60 N"}),
        ("shroud-3d", {"tip", "disk", "shroud-0 and 1 more", "20 N", "next sector"}),
        ("fe-disk", {"ahead-lower", "behind-upper", "tip", "lower", "upper", "20 N", "next sector"}),
    ],
)
def test_everything_is_drawn_and_named(name: str, told: set[str]) -> None:
    figure = scene_figure(solver.load_scene(name))
    assert figure is not None
    assert told <= words(figure)
    circles = [patch.center for patch in figure.axes[0].patches if isinstance(patch, Circle)]
    apart = [dist(a, b) for a, b in combinations(set(circles), 2)]
    assert min(apart) > 0.5, "circles stand on one another"
    assert len(circles) - len(set(circles)) == 1, "one circle is ringed: what is observed"


def test_a_scene_of_very_many_masses_is_not_drawn() -> None:
    chain = {
        "name": "chain",
        "structure": {
            "kind": "lumped",
            "masses": {f"m{i}": 1.0 for i in range(MOST_PARTS + 1)},
            "springs": [{"between": [f"m{i}", "ground"], "k": 1.0} for i in range(MOST_PARTS + 1)],
        },
        "excitation": {"dof": "m0", "amplitude": 1.0},
        "observe": {"dof": "m0", "band": [0.1, 0.2]},
    }
    assert scene_figure(solver.Scene.from_dict(chain)) is None


def test_what_nothing_holds_stands_behind_all_others() -> None:
    springs = [{"between": ["a", "ground"], "k": 7.0}, {"between": ["b", "a"], "k": 7.0}]
    scene = Scene.from_dict(
        {
            "name": "free",
            "structure": {"kind": "lumped", "masses": {"a": 1.0, "b": 1.0, "free": 1.0}, "springs": springs},
            "contacts": [],
            "excitation": {"dof": "a", "amplitude": 1.0},
            "observe": {"dof": "a", "band": [0.1, 3.0]},
        }
    )
    assert layers_of(parts_of(scene)) == {"ground": 0, "a": 1, "b": 2, "free": 3}
