"""Kernels are compiled for one type of system: whatever scene it is of, and however it was made."""

import numba
import pytest

import solver
from solver.balance.balance import Balance, build, less_harmonics, linear_part, more_harmonics
from solver.scene.parameter_paths import parameter_paths

SCENES = ("two-dof", "bladed-disk", "platform-wedge", "platform-cylinder", "shroud-3d")


def all_of(balance: Balance) -> list[object]:
    """The systems that are made of one: with more harmonics, with fewer, without contacts."""
    wide = more_harmonics(balance, balance.n_harmonics + 4)
    few = less_harmonics(balance, 1)
    return [each.system for each in (balance, wide, few)] + [linear_part(balance, balance.n_harmonics + 2)]


@pytest.mark.parametrize("name", SCENES)
def test_every_system_is_of_one_type(name: str) -> None:
    """An empty array of reals for one of complex numbers once had every kernel compiled twice."""
    expected = numba.typeof(build(solver.load_scene("two-dof"), "frequency", harmonics=3).system)
    scene = solver.load_scene(name)
    paths = [path for path in parameter_paths(scene) if path.startswith("structure.")][:1]
    for path in ("excitation.amplitude", *paths):
        balance = build(scene, path, harmonics=3, frequency_hz=scene.observe.band[0])
        assert {str(numba.typeof(each)) for each in all_of(balance)} == {str(expected)}, path
    balance = build(scene, "frequency", harmonics=3)
    assert {str(numba.typeof(each)) for each in all_of(balance)} == {str(expected)}
