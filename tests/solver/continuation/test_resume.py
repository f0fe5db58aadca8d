"""A branch that was interrupted goes on as if it had not been."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scene_cases import bladed_disk, two_dof

import solver
from solver import ContinuationSettings, SettingError, Stretch, joined, sweep
from solver.continuation.branch import Branch, BranchStatus
from solver.continuation.stretches import Course
from solver.scene.scene import Scene

FINE = ContinuationSettings(largest_step=0.05)


def hardening() -> Scene:
    """The two masses with a cubic spring: the response bends over, with two folds."""
    raw = two_dof().to_dict()
    raw["contacts"].append({"name": "cubic", "law": "polynomial", "between": ["m2", "ground"], "a3": 50.0})
    return Scene.from_dict(raw).with_values({"excitation.amplitude": 40.0})


def large() -> Scene:
    """All sectors of the disk: more than 64 unknowns, whose steps use the factors of the point before."""
    return solver.annulus(bladed_disk())


CASES = {
    "two-dof": (two_dof(), {}),
    "backwards": (two_dof(), {"start": 2.0, "stop": 0.3}),
    "over a load": (bladed_disk(), {"parameter": "shroud.N0", "start": 20.0, "stop": 3000.0,
                                    "frequency_hz": 755.0}),
    "folds": (hardening(), {"harmonics": 5}),
    "large": (large(), {"start": 640.0, "stop": 800.0, "harmonics": 3}),
}  # fmt: skip


def stored(stretches: list[Stretch]) -> Stretch:
    """As a checkpoint brings it back."""
    return Stretch.from_arrays(joined(stretches).to_arrays())


@pytest.mark.parametrize("name", CASES)
def test_a_resumed_branch_is_the_branch(name: str) -> None:
    scene, arguments = CASES[name]
    stretches: list[Stretch] = []
    whole = sweep(scene, settings=FINE, course=Course(on_stretch=stretches.append), **arguments)
    assert whole.reached
    assert len(stretches) >= 3
    if name == "folds":
        assert whole.folds >= 2
    for cut in (1, len(stretches) // 2, len(stretches) - 1, len(stretches)):
        beginning = stored(stretches[:cut])
        resumed = sweep(scene, settings=FINE, course=Course(resume=beginning), **arguments)
        assert_same(resumed, whole, len(beginning.solutions))


def assert_same(resumed: Branch, whole: Branch, known: int) -> None:
    for name in ("solutions", "tangents", "observed", "measures", "states", "values"):
        before, after = getattr(whole, name)[:known], getattr(resumed, name)[:known]
        np.testing.assert_array_equal(after, before)
    assert resumed.status is whole.status
    assert resumed.folds == whole.folds
    assert len(resumed.values) == len(whole.values)
    np.testing.assert_allclose(resumed.solutions, whole.solutions, rtol=0.0, atol=1e-9)
    assert resumed.peak is not None
    assert whole.peak is not None
    assert resumed.peak.value == pytest.approx(whole.peak.value, rel=1e-9)
    assert resumed.peak.at == pytest.approx(whole.peak.at, rel=1e-9)
    assert resumed.newton_iterations == whole.newton_iterations
    assert resumed.rejected_steps == whole.rejected_steps
    assert resumed.seconds > 0.0


def more_than(kept: list[Stretch], count: int) -> bool:
    return len(kept) > count


def test_resumed_twice_and_stopped_between() -> None:
    """Every attempt adds its stretches; the progress begins where the last one ended."""
    whole = sweep(two_dof(), settings=FINE)
    kept: list[Stretch] = []
    shares: list[float] = []
    for attempt in range(50):
        branch = sweep(
            two_dof(),
            settings=FINE,
            course=Course(resume=joined(kept) if kept else None, on_stretch=kept.append),
            on_progress=lambda share, _points: shares.append(share),
            should_stop=partial(more_than, kept, attempt),
        )
        if branch.status is not BranchStatus.STOPPED:
            break
    assert branch.reached
    np.testing.assert_array_equal(branch.solutions, whole.solutions)
    assert shares == sorted(shares)
    assert len(kept) >= 3


def test_the_beginning_of_another_branch_is_refused() -> None:
    stretches: list[Stretch] = []
    sweep(two_dof(), settings=FINE, course=Course(on_stretch=stretches.append))
    beginning = joined(stretches[: len(stretches) // 2])
    others = [
        (two_dof(N0=90.0), {}),
        (two_dof(), {"harmonics": 5}),
        (bladed_disk(), {}),
        (two_dof(), {"parameter": "damper.N0", "start": 20.0, "stop": 400.0, "frequency_hz": 1.2}),
    ]
    for scene, arguments in others:
        with pytest.raises(SettingError, match="`resume` must be the beginning of the same branch"):
            sweep(scene, settings=FINE, course=Course(resume=beginning), **arguments)
    with pytest.raises(SettingError, match="accuracy"):
        sweep(two_dof(), course=Course(resume=beginning), accuracy=1e-3)


def test_the_most_points_are_those_of_both_parts() -> None:
    settings = ContinuationSettings(largest_step=0.05, most_points=150)
    stretches: list[Stretch] = []
    whole = sweep(two_dof(), settings=settings, course=Course(on_stretch=stretches.append))
    later: list[Stretch] = []
    resumed = sweep(two_dof(), settings=settings, course=Course(resume=stretches[0], on_stretch=later.append))
    assert whole.status is resumed.status is BranchStatus.TOO_MANY_POINTS
    followed = [
        sum(len(stretch.solutions) for stretch in each) for each in (stretches, stretches[:1] + later)
    ]
    assert followed[0] == followed[1] >= settings.most_points
    assert np.array_equal(resumed.values, whole.values)


def test_words_of_settings_and_course_may_stand_by_themselves() -> None:
    scene, seen = two_dof(), []
    short = sweep(scene, harmonics=3, errors=False, peaks=False, on_points=lambda *rows: seen.append(rows))
    settings = ContinuationSettings(errors=False, peaks=False)
    long = sweep(scene, harmonics=3, settings=settings)
    assert short.peaks == ()
    assert sum(len(values) for values, _ in seen) <= len(short.values)
    assert seen
    assert np.isnan(short.error_estimate)
    np.testing.assert_array_equal(short.solutions, long.solutions)
    fine = sweep(scene, harmonics=3, settings=FINE, errors=False)
    assert len(fine.values) > len(short.values), "the other settings stay"
    with pytest.raises(SettingError, match="accuracy"):
        sweep(scene, accuracy=0.1, guess=np.zeros(3))
    with pytest.raises(TypeError, match="nonsense"):
        sweep(scene, nonsense=1)
