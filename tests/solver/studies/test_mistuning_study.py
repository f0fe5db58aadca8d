"""Studies of many mistuned disks: each disk against the same disk on its own."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from each import each
from scene_cases import bladed_disk, two_dof

from solver import (
    MistuningStatus,
    MistuningStudy,
    Scene,
    SceneError,
    SettingError,
    blade_peaks,
    load_scene,
    mistuned,
    mistuning_study,
)

ASKED: dict[str, Any] = {"of": ["tip_middle"], "spread": 0.03, "samples": 4, "seed": 7, "harmonics": 1}


def small(**force: float) -> Scene:
    raw: dict[str, Any] = dict(bladed_disk().to_dict())
    raw["excitation"] = {**raw["excitation"], **force}
    raw["structure"] = {**raw["structure"], "sectors": 3}
    raw["observe"] = {**raw["observe"], "band": [700.0, 850.0]}
    return Scene.from_dict(raw)


@pytest.fixture(scope="module")
def study() -> MistuningStudy:
    return mistuning_study(small(), **ASKED)


def test_every_disk_is_the_one_of_its_seed(study: MistuningStudy) -> None:
    assert study.status is MistuningStatus.COMPLETED
    assert [disk.seed for disk in study.disks] == [7, 8, 9, 10]
    tuned = blade_peaks(small(), harmonics=1)
    assert study.tuned.largest == tuned.largest
    for disk in study.disks[1:3]:
        alone = blade_peaks(mistuned(small(), of="tip_middle", spread=0.03, seed=disk.seed), harmonics=1)
        np.testing.assert_allclose(disk.peaks.value, alone.value, rtol=1e-13)
        assert disk.magnification == pytest.approx(alone.magnification(tuned), rel=1e-13)
        given = mistuned(small(), of="tip_middle", values=disk.factors)
        np.testing.assert_allclose(blade_peaks(given, harmonics=1).value, alone.value, rtol=1e-12)


def test_the_figures_are_those_of_the_disks(study: MistuningStudy) -> None:
    found: Any = study.to_json()
    factors = [disk.magnification for disk in study.disks]
    assert found["mean"] == pytest.approx(sum(factors) / 4.0, rel=1e-14)
    assert found["deviation"] == pytest.approx(np.std(factors, ddof=1), rel=1e-12)
    assert {q["share"]: q["magnification"] for q in found["quantiles"]}[0.5] == pytest.approx(
        np.median(factors), rel=1e-14
    )
    worst = study.worst
    assert worst is not None
    assert found["worst"] == worst.to_json()
    assert worst.magnification == max(factors)
    assert found["worst"]["largest"] == max(found["worst"]["peaks"])
    tuned, highest = study.branches
    assert tuned.peak is not None
    assert highest.peak is not None
    assert tuned.peak.value == study.tuned.largest
    assert highest.peak.value == pytest.approx(worst.peaks.largest, rel=1e-13)


def test_a_spread_of_nothing_magnifies_nothing() -> None:
    found = mistuning_study(small(), of="tip", spread=0.0, samples=1, harmonics=1)
    assert found.magnifications == pytest.approx(1.0, rel=1e-9)
    assert found.to_json()["deviation"] is None


def test_more_disks_begin_with_the_same_and_a_stop_keeps_those_that_are_whole(study: MistuningStudy) -> None:
    done: list[tuple[float, int]] = []
    stopped = mistuning_study(
        small(), **{**ASKED, "samples": 50}, on_progress=lambda *at: done.append(at),
        should_stop=lambda: bool(done) and done[-1][1] == 2,
    )  # fmt: skip
    assert stopped.status is MistuningStatus.STOPPED
    assert not stopped.reached
    assert [disk.magnification for disk in stopped.disks] == [d.magnification for d in study.disks[:2]]
    shares = [share for share, _ in done]
    assert shares == sorted(shares)
    assert 2.0 / 51.0 < shares[-1] < 4.0 / 51.0


def test_what_is_not_known_is_left_out_of_the_figures() -> None:
    """A response that ends early, of a disk and of the tuned one: no numbers in place of a peak."""

    def once(at: int) -> MistuningStudy:
        """The study whose responses are asked to stop at one step alone."""
        calls = itertools.count(1)
        return mistuning_study(small(), **ASKED, should_stop=lambda: next(calls) == at)

    found = once(3)
    assert found.status is MistuningStatus.INCOMPLETE
    assert sum(disk.known for disk in found.disks) == found.magnifications.size == 3
    lost = next(disk.to_json() for disk in found.disks if not disk.known)
    assert (lost["magnification"], lost["largest"], lost["worst_blade"]) == (None, None, None)
    found = once(1)
    assert found.status is MistuningStatus.NO_RESPONSE
    assert found.disks == found.branches == ()
    assert math.isnan(found.tuned.largest)
    assert found.to_json()["worst"] is None
    assert found.to_json()["mean"] is None
    assert found.to_json()["tuned"] == {"peak": None, "at_hz": None}


def test_a_disk_at_rest_is_nothing_to_compare_with() -> None:
    found = mistuning_study(small(amplitude=0.0), **ASKED)
    assert found.status is MistuningStatus.NO_RESPONSE
    assert found.disks == found.branches == ()


@each(
    ("change", "name"),
    [({"samples": 0}, "samples"), ({"samples": True}, "samples"), ({"spread": -0.1}, "spread"),
     ({"spread": math.nan}, "spread"), ({"spread": 2.0}, "spread"), ({"dof": "hub"}, "dof"),
     ({"start": 0.0}, "start"), ({"harmonics": -1}, "harmonics")],
)  # fmt: skip
def test_bad_settings(change: dict[str, Any], name: str) -> None:
    with pytest.raises(SettingError, match=f"`{name}`"):
        mistuning_study(small(), **{**ASKED, **change})


def test_bad_scenes() -> None:
    with pytest.raises(SettingError, match="cyclic"):
        mistuning_study(two_dof(), of="k1")
    with pytest.raises(SceneError, match="nothing"):
        mistuning_study(load_scene("bladed-disk"), of="nothing")
