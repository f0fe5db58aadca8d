"""The description of a design problem: cases, groups, limits, weights; what ends how; bad input by name."""

import numpy as np
import pytest
from each import each

import optim
import solver
from optim.criteria.criterion import criteria
from optim.criteria.evaluation import evaluate
from optim.criteria.frequency_ranges import FORBIDDEN
from optim.criteria.peak_criterion import BAND, PEAK
from optim.problem.checks import DesignError
from optim.problem.design_problem import pose
from optim.results.design_result import DesignStatus

TWO, DISK = {"damper.N0": (20.0, 500.0)}, {"shroud.N0": (20.0, 3000.0)}


def highest(scene: solver.Scene, **sweep: object) -> float:
    return solver.sweep(scene, **sweep).peaks[0].value  # type: ignore[arg-type]


def test_several_bands_levels_and_orders_are_judged_together() -> None:
    scene = solver.load_scene("bladed-disk")
    cases = [
        {"name": "order 1", "band": [500.0, 900.0]},
        {"name": "order 2", "engine_order": 2, "weight": 0.5},
        {"name": "stronger", "set": {"excitation.amplitude": 80.0}, "band": [700.0, 800.0], "weight": 0.6},
    ]
    result = optim.design(scene, variables=DISK, cases=cases, harmonics=8)
    assert result.reached
    enough = result.problem.harmonics
    N0 = result.optimum["shroud.N0"]
    here = scene.with_values({"shroud.N0": N0})
    from optim.problem.cases import with_engine_order

    second = highest(with_engine_order(here, 2), harmonics=enough)
    third = highest(
        here.with_values({"excitation.amplitude": 80.0}), start=700.0, stop=800.0, harmonics=enough
    )
    expected = max(highest(here, harmonics=enough), 0.5 * second, 0.6 * third)
    assert result.evaluation.objective == pytest.approx(expected, rel=1e-9)  # type: ignore[union-attr]
    for factor in (0.97, 1.03):
        there = evaluate(result.problem, {"shroud.N0": N0 * factor})
        assert there.objective > expected
    assert {row.case for row in result.evaluation.rows} == {"order 1", "order 2", "stronger"}  # type: ignore[union-attr]
    held = result.held_by
    assert held is not None
    assert f"{held.what} of {held.case}" in result.active
    assert str(result.peak).endswith("Hz>")
    assert f"value {1e3 * result.peak.value:.4g} mm" in str(result.peak)  # type: ignore[union-attr]
    frame = result.to_pandas()
    at = frame[frame["optimum"]].iloc[0]
    assert at["peak_of_order 2"] == pytest.approx(second, rel=1e-9)
    assert at["peak_of_stronger"] == pytest.approx(third, rel=1e-9)


def test_several_observed_dofs_are_cases_of_their_own() -> None:
    scene = solver.load_scene("bladed-disk")
    problem = pose(scene, variables=DISK, cases=[{"observe": ["tip", "middle"]}])
    found = evaluate(problem, {"shroud.N0": 200.0})
    raw = scene.to_dict()
    raw["observe"] = {"dof": "middle", "band": [500.0, 900.0]}
    middle = solver.Scene.from_dict(raw).with_values({"shroud.N0": 200.0})
    peaks = {row.case: row.value for row in reversed(found.peaks)}
    assert peaks["bladed-disk, tip"] == highest(scene.with_values({"shroud.N0": 200.0}))
    assert peaks["bladed-disk, middle"] == pytest.approx(highest(middle), rel=1e-10)
    ranged = pose(
        scene,
        variables=DISK,
        cases=[{"observe": ["tip", "middle"]}],
        limit=1e-4,
        forbidden_hz=[[700.0, 720.0]],
    )
    rows = evaluate(ranged, {"shroud.N0": 200.0}).of(FORBIDDEN)
    inside = {row.case: row.value for row in reversed(rows)}
    assert inside["bladed-disk, middle"] == pytest.approx(highest(middle, start=700.0, stop=720.0), rel=1e-10)


def test_contacts_that_share_a_value_have_one_variable() -> None:
    scene = solver.load_scene("bladed-disk")
    result = optim.design(scene, variables={"shroud.mu,root.mu": (0.1, 0.6)})
    assert result.reached
    (mu,) = result.optimum.values()
    assert list(result.optimum) == ["shroud.mu,root.mu"]
    both = scene.with_values({"shroud.mu": mu, "root.mu": mu})
    assert highest(both) == pytest.approx(result.peak.value, rel=1e-12)  # type: ignore[union-attr]


@pytest.mark.long
def test_a_forbidden_range_keeps_the_resonance_out() -> None:
    """Speeds times the order: 42900 to 43800 revolutions a minute forbid 715 to 730 Hz to order 1."""
    scene, limit = solver.load_scene("bladed-disk"), 9.2e-5
    problem = {"variables": DISK, "limit": limit, "harmonics": 8}  # three and six leave a peak open by 5 %
    free = optim.design(scene, **problem)  # type: ignore[arg-type]
    kept = optim.design(scene, speeds_rpm=[[42900.0, 43800.0]], **problem)  # type: ignore[arg-type]
    assert free.problem.harmonics == kept.problem.harmonics

    def inside(N0: float) -> float:
        there = scene.with_values({"shroud.N0": N0})
        return highest(there, start=715.0, stop=730.0, harmonics=kept.problem.harmonics)

    assert inside(free.optimum["shroud.N0"]) > limit
    assert kept.reached
    assert inside(kept.optimum["shroud.N0"]) <= limit * (1.0 + 1e-6)
    assert kept.peak.value >= free.peak.value * (1.0 - 1e-9)  # type: ignore[union-attr]
    for N0 in np.geomspace(20.0, 3000.0, 13):
        if inside(float(N0)) <= limit:
            peak = highest(scene.with_values({"shroud.N0": float(N0)}), harmonics=kept.problem.harmonics)
            assert peak >= kept.peak.value * (1.0 - 1e-9)  # type: ignore[union-attr]


def test_a_limit_on_wear_is_kept_and_costs_peak() -> None:
    scene = solver.load_scene("two-dof")
    free = optim.design(scene, variables=TWO)
    here = scene.with_values(dict(free.optimum))
    work = solver.worst_friction_work(solver.sweep(here), "damper").value
    limited = optim.design(scene, variables=TWO, max_friction_work={"damper": 0.999 * work})
    assert limited.reached
    there = scene.with_values(dict(limited.optimum))
    assert solver.worst_friction_work(solver.sweep(there), "damper").value <= 0.999 * work * (1.0 + 1e-6)
    assert limited.peak.value > free.peak.value  # type: ignore[union-attr]
    assert any("friction work limit" in words for words in limited.active)


def test_a_contact_that_never_separates() -> None:
    scene = solver.load_scene("two-dof").with_values({"damper.N1": 120.0})
    free = optim.design(scene, variables=TWO, method="minimax")
    kept = optim.design(scene, variables=TWO, contact_states={"damper": "never-separates"})
    assert kept.reached
    assert kept.optimum["damper.N0"] >= 120.0 * (1.0 - 1e-6)
    assert kept.peak.value >= free.peak.value * (1.0 - 1e-12)  # type: ignore[union-attr]


def test_the_band_can_be_minimised_with_a_limit_on_the_peak() -> None:
    scene = solver.load_scene("bladed-disk")
    result = optim.design(
        scene,
        variables=DISK,
        limit=0.8e-4,
        weights={"band": 1.0},
        max_peak=1.1e-4,
        start={"shroud.N0": 400.0},
    )
    assert result.reached
    assert result.peak.value == pytest.approx(1.1e-4, rel=1e-6)  # type: ignore[union-attr]
    assert result.band_hz == result.evaluation.objective  # type: ignore[union-attr]
    assert "peak limit of 0.00011 m" in result.active
    # Where the peak is that high, on the other side of the optimum, the band is wider.
    assert result.optimum["shroud.N0"] > 300.0


def test_an_infeasible_problem_says_by_how_much_and_which_limits() -> None:
    scene = solver.load_scene("bladed-disk")
    result = optim.design(
        scene, variables=DISK, limit=0.8e-4, max_band_hz=40.0, max_peak=1.02e-4, harmonics=5
    )  # fmt: skip
    assert result.status is DesignStatus.INFEASIBLE
    assert not result.reached
    broken = {row.quantity: row for row in result.broken}
    assert set(broken) == {BAND, PEAK}
    # It breaks the limits least: both by the same share, and no neighbour by less.
    shares = [row.excess(1.0) for row in broken.values()]
    assert shares[0] == pytest.approx(shares[1], rel=1e-4)
    for factor in (0.98, 1.02):
        there = evaluate(result.problem, {"shroud.N0": result.optimum["shroud.N0"] * factor})
        assert there.violation(dict.fromkeys(criteria(), 1.0)) > max(shares)
    answer = result.to_json()
    assert {entry["quantity"] for entry in answer["broken"]} == {"peak", "band"}  # type: ignore[attr-defined]
    assert all(entry["by"] > 0.0 for entry in answer["broken"])  # type: ignore[attr-defined]
    # Relaxed by what it says, it can be kept.
    relaxed = optim.design(
        scene,
        variables=DISK,
        limit=0.8e-4,
        max_band_hz=40.0 * (1.0 + 1.001 * max(shares)),
        max_peak=1.02e-4 * (1.0 + 1.001 * max(shares)),
        harmonics=5,
    )
    assert relaxed.reached


@pytest.mark.parametrize("method", ["tracked", "minimax", "ipopt"])
def test_a_flat_problem_says_so(method: str) -> None:
    scene = solver.load_scene("two-dof").with_values({"damper.mu": 0.0})
    result = optim.design(scene, variables=TWO, method=method)
    assert result.status is DesignStatus.FLAT
    assert not result.reached


@pytest.mark.parametrize("method", ["tracked", "minimax", "ipopt"])
def test_an_optimum_on_a_bound_says_so(method: str) -> None:
    result = optim.design(
        solver.load_scene("two-dof"), variables={"damper.N0": (150.0, 500.0)}, method=method
    )
    assert result.status is DesignStatus.AT_BOUND
    assert result.optimum["damper.N0"] == 150.0
    assert "lower bound of damper.N0" in result.active
    ((_, side, multiplier),) = result.conditions.bounds  # type: ignore[union-attr]
    assert side == "lower"
    assert multiplier > 0.0


def loose() -> solver.Scene:
    """A part held by a contact alone that slips all the time: no sweep of it gets through."""
    return solver.Scene.from_dict(
        {
            "name": "loose",
            "structure": {"kind": "lumped", "masses": {"m1": 1.0}, "springs": [], "dampers": []},
            "contacts": [
                {"name": "damper", "between": ["m1", "ground"], "kt": 30.0, "mu": 0.3, "N0": 1.0, "N1": 0.5}
            ],
            "excitation": {"dof": "m1", "amplitude": 30.0},
            "observe": {"dof": "m1", "band": [0.2, 1.5]},
        }
    )


@pytest.mark.parametrize("method", ["auto", "minimax", "ipopt"])
def test_a_failed_inner_solve_never_passes_as_a_value(method: str) -> None:
    result = optim.design(loose(), variables={"damper.N0": (0.9, 1.1)}, method=method)
    assert result.status is DesignStatus.NO_RESPONSE
    assert not result.reached
    assert result.optimum == {}
    assert result.peak is None
    answer = result.to_json()
    assert answer["optimum"] == {}
    assert answer["peak"] is None


def test_a_design_that_fails_on_the_way_is_left_out() -> None:
    """The response is not covered where a caller stops it: no number of it is used."""
    problem = pose(solver.load_scene("two-dof"), variables=TWO)
    stopped = evaluate(problem, {"damper.N0": 100.0}, should_stop=lambda: True)
    assert not stopped.good
    assert stopped.rows == ()
    assert stopped.objective == np.inf


@each(
    ("arguments", "words"),
    [
        ({"variables": {"damper.N0,damper.nothing": (1.0, 2.0)}}, ["damper.nothing"]),
        ({"variables": {"damper.N0": (1.0, 2.0), "damper.N0,damper.kt": (1.0, 2.0)}}, ["damper.N0", "one"]),
        ({"scaling": {"damper.mu": "linear"}}, ["scaling", "damper.mu"]),
        ({"scaling": {"damper.N0": "cubic"}}, ["scaling.damper.N0", "cubic", "logarithmic"]),
        (
            {"variables": {"damper.N0": (0.0, 2.0)}, "scaling": {"damper.N0": "logarithmic"}},
            ["scaling.damper.N0", "> 0"],
        ),
        ({"cases": []}, ["cases", "at least one"]),
        ({"cases": ["all"]}, ["cases[0]", "'all'"]),
        ({"cases": [{"bend": [1.0, 2.0]}]}, ["cases[0].bend", "band"]),
        ({"cases": [{"band": [2.0, 1.0]}]}, ["cases[0].band", "low < high"]),
        ({"cases": [{"band": [1.0]}]}, ["cases[0].band", "two numbers"]),
        ({"cases": [{"weight": 0.0}]}, ["cases[0].weight", "> 0", "0.0"]),
        ({"cases": [{"engine_order": 2}]}, ["cases[0].engine_order", "cyclic"]),
        ({"cases": [{"order": 0}]}, ["cases[0].order", ">= 1"]),
        ({"cases": [{"name": ""}]}, ["cases[0].name"]),
        ({"cases": [{"name": "a"}, {"name": "a"}]}, ["cases", "twice"]),
        ({"cases": [{"observe": []}]}, ["cases[0].observe"]),
        ({"cases": [{"observe": "m9"}]}, ["m9"]),
        ({"cases": [{"set": {"damper.nothing": 1.0}}]}, ["damper.nothing"]),
        ({"cases": [{"set": 3.0}]}, ["cases[0].set"]),
        ({"weights": {"peak": 0.0}}, ["weights", "> 0"]),
        ({"weights": {"height": 1.0}}, ["weights.height", "peak"]),
        ({"weights": {"peak": -1.0}}, ["weights.peak", "-1.0"]),
        ({"max_peak": 0.0}, ["max_peak", "0.0"]),
        ({"forbidden_hz": [[1.0, 2.0]]}, ["limit", "forbidden"]),
        ({"forbidden_hz": [[2.0, 1.0]], "limit": 1.0}, ["forbidden_hz[0]", "low < high"]),
        ({"speeds_rpm": [60.0, 90.0], "limit": 1.0}, ["speeds_rpm[0]", "two numbers"]),
        ({"max_friction_work": {"dumper": 1.0}}, ["max_friction_work", "dumper", "damper"]),
        ({"max_friction_work": -2.0}, ["max_friction_work", "-2.0"]),
        ({"contact_states": {"damper": "sticks"}}, ["contact_states.damper", "never-separates", "sticks"]),
        ({"contact_states": {"dumper": "never-separates"}}, ["contact_states", "dumper"]),
    ],
)
def test_bad_input_names_the_argument_and_the_value(arguments: dict[str, object], words: list[str]) -> None:
    with pytest.raises((DesignError, solver.SettingError, solver.SceneError)) as caught:
        optim.design(solver.load_scene("two-dof"), **arguments)  # type: ignore[arg-type]
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    "cases", [[{"name": "a"}], [{"name": "b", "band": [0.3, 2.5], "set": {"damper.mu": 0.3}}]]
)
def test_cases_measure_what_the_scene_does(cases: list[dict[str, object]]) -> None:
    """Half peak to peak, that of the motion in time, of which the mean is a hundredth."""
    raw = solver.load_scene("two-dof").to_dict()
    static = {"dof": "m1", "amplitude": 20.0, "harmonic": 0}
    observe = {**raw["observe"], "measure": "half_peak_to_peak"}  # type: ignore[dict-item]
    forces = [raw["excitation"], static]
    scene = solver.Scene.from_dict({**raw, "observe": observe, "excitation": forces})
    problem = pose(scene, variables={"damper.N0": (60.0, 80.0)}, cases=cases, harmonics=3)
    highest = evaluate(problem, {"damper.N0": 70.0}, gradients=False).of(PEAK)[0]
    there = solver.solve(scene.with_values({"damper.N0": 70.0}), frequency_hz=highest.at_hz, harmonics=3)
    motion = solver.time_history(there, scene.observe.dof, samples=4096)[1]
    assert abs(motion.mean()) > 0.005 * np.ptp(motion)
    assert highest.value == pytest.approx(0.5 * np.ptp(motion), rel=1e-5)
