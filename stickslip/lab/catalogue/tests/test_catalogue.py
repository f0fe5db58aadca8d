"""The best of a catalogue, against each option by itself."""

import math

import pytest

import optim
import solver
from optim.problem.checks import DesignError
from stickslip.lab.catalogue.catalogue import OptionStatus, catalogue
from solver.errors import SettingError

OPTIONS = {
    "soft": {"damper.kt": 15.0, "damper.mu": 0.3},
    "stiff": {"damper.kt": 45.0, "damper.mu": 0.3},
    "smooth": {"damper.kt": 30.0, "damper.mu": 0.1},
}


def test_options_alone_are_ranked_by_their_responses() -> None:
    scene = solver.load_scene("two-dof")
    found = catalogue(scene, OPTIONS, variables={}, harmonics=3)
    peaks = {}
    for name, values in OPTIONS.items():
        branch = solver.sweep(scene.with_values(values), harmonics=3)
        assert branch.peak is not None
        peaks[name] = branch.peak.value
    assert [one.name for one in found.options] == sorted(peaks, key=lambda name: peaks[name])
    assert {one.name: one.objective for one in found.options} == pytest.approx(peaks, rel=1e-9)
    # With a limit that the best alone keeps.
    least, second = sorted(peaks.values())[:2]
    limited = catalogue(scene, OPTIONS, variables={}, harmonics=3, max_peak=0.5 * (least + second))
    assert [one.status for one in limited.options] == [
        OptionStatus.FEASIBLE, OptionStatus.INFEASIBLE, OptionStatus.INFEASIBLE,
    ]  # fmt: skip
    assert catalogue(scene, OPTIONS, variables={}, harmonics=3, max_peak=0.1 * least).best is None


def test_each_option_has_its_best_design() -> None:
    scene, variables = solver.load_scene("two-dof"), {"damper.N0": (20.0, 400.0)}
    found = catalogue(scene, OPTIONS, variables=variables, harmonics=3)
    for one in found.options:
        alone = optim.design(scene.with_values(OPTIONS[one.name]), variables=variables, harmonics=3)
        assert alone.evaluation is not None
        assert one.objective == pytest.approx(alone.evaluation.objective, rel=1e-9)
        assert dict(one.values) == pytest.approx(dict(alone.optimum), rel=1e-6)
    assert found.best is not None
    # The first option as a design: its values and those of the option lead to its peak.
    assert found.design.options == found.options
    assert set(found.design.optimum) == {"damper.N0", "damper.kt", "damper.mu"}
    branch = solver.sweep(scene.with_values(found.design.optimum), harmonics=found.design.problem.harmonics)
    assert branch.peak is not None
    assert branch.peak.value == pytest.approx(found.best.objective, rel=1e-9)
    assert found.best.objective == min(one.objective for one in found.options)


def test_an_option_that_is_too_heavy_is_cut_off() -> None:
    scene = solver.load_scene("platform-wedge")
    (body,) = scene.bodies
    options = {
        name: {f"{body.name}.mass": factor * body.mass}
        for name, factor in (("as it is", 1.0), ("heavy", 1e3))
    }
    found = catalogue(scene, options, variables={}, harmonics=1, weights={"mass": 1.0, "peak": body.mass})
    assert [one.status for one in found.options] == [OptionStatus.FEASIBLE, OptionStatus.CUT]
    assert found.options[1].least == pytest.approx(1e3 * body.mass, rel=1e-12)
    assert found.options[1].least > found.options[0].objective > found.options[0].least
    assert math.isinf(found.options[1].objective)


def test_what_is_wrong_is_told() -> None:
    scene = solver.load_scene("two-dof")
    with pytest.raises(DesignError, match="at least one name"):
        catalogue(scene, {})
    with pytest.raises(SettingError, match=r"damper\.N9") as refused:
        catalogue(scene, {"x": {"damper.N9": 1.0}})
    assert refused.value.place[:2] == ("options", "x")
    with pytest.raises(DesignError, match="variable") as fixed:
        catalogue(scene, {"x": {"damper.N0": 1.0}}, variables={"damper.N0": (20.0, 400.0)})
    assert fixed.value.place == ("options", "x", "damper.N0")
    stopped = catalogue(scene, OPTIONS, should_stop=lambda: True)
    assert {one.status for one in stopped.options} == {OptionStatus.STOPPED}
