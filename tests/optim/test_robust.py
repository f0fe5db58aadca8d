"""Robust design: worst case against brute force, mean and quantiles against sampling, statuses, bad input."""

import itertools
import json
import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from mistuned_cases import disk as friction_disk

import optim
import solver
from optim.criteria.criterion import CriterionRow
from optim.criteria.peak_criterion import BAND, PEAK
from optim.problem.design_problem import pose
from optim.problem.uncertainty_input import read_uncertain
from optim.problem.uncertainty_set import Scenario, UncertaintyShape
from optim.robust.robust_result import RobustStatus
from optim.robust.scenarios import Outcome, outcome
from optim.robust.worst_case import Aspect, UnknownScenarioError, pessimise
from solver.continuation.branches.observation import observing

N0 = {"damper.N0": (60.0, 300.0)}
KT_AND_MU = {"damper.kt": {"deviation": 0.2}, "damper.mu": [0.2, 0.4]}
TWO = solver.load_scene("two-dof")
HARMONICS = 5


def peak_at(values: dict[str, float], harmonics: int = HARMONICS) -> float:
    """The highest peak with some values of the scene, by a sweep."""
    branch = solver.sweep(TWO.with_values(values), harmonics=harmonics)
    assert branch.peak is not None
    return branch.peak.value


@cache
def worst_case() -> optim.RobustResult:
    return optim.robust_design(TWO, uncertain=KT_AND_MU, variables=N0, samples=12, harmonics=HARMONICS)


def test_the_worst_case_is_that_of_a_grid_over_the_intervals() -> None:
    result = worst_case()
    assert result.status is RobustStatus.OPTIMAL
    assert result.robust is not None
    grid = [
        peak_at({"damper.N0": result.optimum["damper.N0"], "damper.kt": kt, "damper.mu": mu})
        for kt, mu in itertools.product(np.linspace(24.0, 36.0, 5), np.linspace(0.2, 0.4, 5))
    ]
    assert result.robust.worst_peak == pytest.approx(max(grid), rel=1e-6)
    assert result.objective == pytest.approx(result.robust.worst_peak, rel=1e-6)
    assert 0.0 <= result.gap <= 1e-6


def test_no_neighbour_has_a_lower_worst_case() -> None:
    result = worst_case()
    for factor in (0.8, 0.95, 0.99, 0.999, 1.001, 1.01, 1.05, 1.25):
        corners = [
            peak_at({"damper.N0": factor * result.optimum["damper.N0"], "damper.kt": kt, "damper.mu": mu})
            for kt, mu in itertools.product((24.0, 36.0), (0.2, 0.4))
        ]
        assert max(corners) >= result.objective * (1.0 - 1e-8)


def test_the_robust_optimum_stands_beside_the_nominal_one() -> None:
    result = worst_case()
    assert result.nominal is not None
    assert result.robust is not None
    assert result.nominal.peak < result.robust.peak < result.robust.worst_peak < result.nominal.worst_peak
    assert result.gain == pytest.approx(1.0 - result.robust.worst_peak / result.nominal.worst_peak)
    for side in (result.nominal, result.robust):
        assert side.spread.mean <= side.spread.quantile(0.95) <= side.worst_peak
        assert side.peak == pytest.approx(peak_at(dict(side.values)), rel=1e-9)
    held = [cut for cut in result.cuts if cut.multiplier > 0.0]
    assert sum(cut.multiplier for cut in held) == pytest.approx(1.0)
    assert len(held) == 2, "two scenarios are equally bad at this optimum"


@pytest.mark.long
def test_a_load_that_is_only_met_within_ten_per_cent() -> None:
    result = optim.robust_design(
        TWO, uncertain={"damper.N0": {"deviation": 0.1}}, variables=N0, samples=4, harmonics=HARMONICS
    )
    assert result.status is RobustStatus.OPTIMAL
    ends = [peak_at({"damper.N0": result.optimum["damper.N0"] * share}) for share in np.linspace(0.9, 1.1, 9)]
    assert result.objective == pytest.approx(max(ends), rel=1e-6)
    for factor in (0.97, 0.995, 1.005, 1.03):
        there = factor * result.optimum["damper.N0"]
        assert max(peak_at({"damper.N0": s * there}) for s in (0.9, 1.1)) >= result.objective * (1.0 - 1e-8)


def test_the_worst_of_an_ellipsoid_lies_on_its_edge() -> None:
    half_axes = {"damper.kt": 0.2, "damper.mu": 0.3}
    problem = pose(TWO, variables=N0, harmonics=HARMONICS)
    over = read_uncertain(TWO, problem.variables, {"half_axes": half_axes, "relative": True})
    values = {"damper.N0": 105.0}
    aspect = Aspect(quantity=PEAK, limited=False)
    found = pessimise(lambda scenario: outcome(problem, values, scenario), over, aspect, ())
    around = [
        peak_at({"damper.N0": 105.0, "damper.kt": 30.0 * (1 + 0.2 * x), "damper.mu": 0.3 * (1 + 0.3 * y)})
        for x, y in ((math.cos(t), math.sin(t)) for t in np.linspace(0.0, 2.0 * math.pi, 24))
    ]
    assert max(around) <= found.value <= max(around) * (1.0 + 4e-3)
    assert np.linalg.norm(found.worst.scenario.xi) == pytest.approx(1.0, abs=1e-6)


def test_the_worst_of_samples_is_the_worst_of_them() -> None:
    samples = [
        {"damper.mu": mu, "damper.N0": {"deviation": d}} for mu, d in ((0.2, 0.1), (0.3, 0.0), (0.4, -0.1))
    ]
    result = optim.robust_design(TWO, uncertain=samples, variables=N0, harmonics=HARMONICS)
    assert result.status is RobustStatus.OPTIMAL
    each = [
        peak_at({"damper.mu": mu, "damper.N0": result.optimum["damper.N0"] * (1.0 + d)})
        for mu, d in ((0.2, 0.1), (0.3, 0.0), (0.4, -0.1))
    ]
    assert result.objective == pytest.approx(max(each), rel=1e-9)
    assert result.robust is not None
    assert result.robust.spread.peaks == pytest.approx(each, rel=1e-9)


@pytest.mark.few(2)
@pytest.mark.parametrize("aim", ["mean", "quantile"])
def test_mean_and_quantile_are_those_of_the_samples_and_least(aim: str) -> None:
    result = optim.robust_design(
        TWO, uncertain=KT_AND_MU, variables=N0, aim=aim, quantile=0.75, samples=6, seed=3, harmonics=HARMONICS
    )
    assert result.status is RobustStatus.OPTIMAL
    problem = pose(TWO, variables=N0)
    drawn = read_uncertain(TWO, problem.variables, KT_AND_MU).draw(6, 3)

    def direct(load: float) -> float:
        peaks = []
        for scenario in drawn:
            (kt, by_kt), (mu, value) = scenario.settings
            values = {"damper.N0": load, "damper.kt": 30.0 * (1.0 + by_kt), "damper.mu": value}
            peaks.append(peak_at(values))
            assert (kt.name, mu.name) == ("damper.kt", "damper.mu")
        return float(np.mean(peaks)) if aim == "mean" else sorted(peaks)[4]

    best = direct(result.optimum["damper.N0"])
    assert result.objective == pytest.approx(best, rel=1e-9)
    assert all(
        direct(f * result.optimum["damper.N0"]) >= best * (1.0 - 1e-9) for f in (0.98, 0.999, 1.001, 1.02)
    )


def test_slopes_by_design_and_by_uncertainty_are_those_of_differences() -> None:
    variables = {"damper.N0": (60.0, 300.0), "structure.k2": (30.0, 50.0)}
    problem = pose(TWO, variables=variables)
    over = read_uncertain(
        TWO, problem.variables,
        {"damper.N0": {"deviation": 0.1}, "damper.mu": [0.2, 0.4],
         "structure.k2": {"absolute_deviation": 2.0}, "excitation.amplitude": {"deviation": 0.2}},
    )  # fmt: skip
    xi, values = np.array([0.3, -0.4, 0.5, 0.2]), {"damper.N0": 140.0, "structure.k2": 39.0}
    here = outcome(problem, values, over.scenario(xi))
    by_xi = over.by_xi(here.by_delta[0])

    def peak(values: dict[str, float], place: np.ndarray) -> float:
        return outcome(problem, values, over.scenario(place), gradients=False).rows[0].value

    for i in range(4):
        unit = np.eye(4)[i]
        central = difference(lambda h: peak(values, xi + h * unit), 2e-3)  # noqa: B023
        assert by_xi[i] == pytest.approx(central, rel=1e-6)
    for name, gradient in zip(variables, here.rows[0].gradient, strict=True):
        central = difference(lambda h: peak({**values, name: values[name] + h}, xi), 1e-3 * values[name])  # noqa: B023
        assert gradient == pytest.approx(central, rel=1e-6)


def test_slopes_by_the_factors_of_free_blades_are_those_of_differences() -> None:
    scene = friction_disk(sectors=3)
    problem = pose(scene, variables={"shroud.N0": (10.0, 80.0)}, harmonics=3)
    over = read_uncertain(
        scene, problem.variables,
        {"shroud.mu": [0.2, 0.4], "mistuning": {"of": ["root", "blade_mass"], "within": 0.05}},
    )  # fmt: skip
    xi, values = np.array([0.3, -0.4, 0.5, 0.2]), {"shroud.N0": 40.0}
    here = outcome(problem, values, over.scenario(xi))
    assert here.scenario.disk is not None
    assert here.scenario.disk.values == pytest.approx(1.0 + 0.05 * xi[1:])
    # Every blade is judged as it is in the same disk written out.
    written = solver.mistuned(
        scene.with_values({**values, "shroud.mu": 0.33}),
        of=["root", "blade_mass"],
        values=1.0 + 0.05 * xi[1:],
    )
    blades = solver.blade_peaks(written, dof="blade", harmonics=3)
    for j in range(3):
        mine = [row.value for row in here.rows if row.quantity is PEAK and f"blade@{j}" in row.case]
        assert max(mine) == pytest.approx(blades.value[j], rel=1e-9)

    def peak(place: np.ndarray, load: float = 40.0) -> float:
        rows = outcome(problem, {"shroud.N0": load}, over.scenario(place), gradients=False).rows
        return max(row.value for row in rows if row.quantity is PEAK)

    top = max((row for row in here.rows if row.quantity is PEAK), key=lambda row: row.value)
    slopes = over.by_xi(here.by_delta[here.rows.index(top)])
    along = np.array([0.4, -0.5, 0.3, 0.7])
    along_load = 4.0
    slope = slopes @ along + along_load * top.gradient[0]
    central = difference(lambda h: peak(xi + h * along, 40.0 + h * along_load), 4e-3)
    assert slope == pytest.approx(central, rel=1e-5)


@pytest.mark.parametrize("aim", ["worst-case", "mean"])
def test_a_search_begun_with_few_harmonics_ends_where_one_with_enough_does(aim: str) -> None:
    scene = solver.load_scene("bladed-disk")
    asked: dict[str, Any] = {
        "variables": {"shroud.N0": (50.0, 1500.0)}, "uncertain": {"shroud.mu": (0.2, 0.4)}, "aim": aim,
        "samples": 4,
    }  # fmt: skip
    few = optim.robust_design(scene, harmonics=1, **asked)
    enough = optim.robust_design(scene, harmonics=few.problem.harmonics, **asked)
    assert few.problem.harmonics > 1
    assert few.status is enough.status is RobustStatus.OPTIMAL
    assert few.optimum == pytest.approx(enough.optimum, rel=1e-8)
    assert few.objective == pytest.approx(enough.objective, rel=1e-9)
    assert few.robust is not None
    assert enough.robust is not None
    assert few.robust.worst_peak == pytest.approx(enough.robust.worst_peak, rel=1e-8)


@pytest.mark.long
def test_no_mistuning_of_a_grid_is_worse_than_the_worst_case() -> None:
    scene, bounds = friction_disk(sectors=3), {"shroud.N0": (40.0, 400.0)}
    result = optim.robust_design(
        scene,
        uncertain={"mistuning": {"of": "root", "within": 0.03}},
        variables=bounds,
        harmonics=3,
        samples=4,
    )
    assert result.status is RobustStatus.OPTIMAL
    assert result.gap <= 1e-6
    assert result.robust is not None
    load = result.optimum["shroud.N0"]

    def worst(load: float, factors: np.ndarray) -> float:
        # By the measure it is judged by: the mean of this disk is free.
        there = result.problem.cases[0].scene.with_values({"shroud.N0": load})
        disks = (
            solver.mistuned(there, of="root", values=one) for one in itertools.product(factors, repeat=3)
        )
        return max(
            solver.blade_peaks(one, dof="blade", harmonics=3, every_branch=False).largest for one in disks
        )

    assert worst(load, np.linspace(0.97, 1.03, 5)) <= result.robust.worst_peak * (1.0 + 1e-6)
    for factor in (0.9, 0.97, 1.03, 1.1):
        assert worst(factor * load, np.array([0.97, 1.0, 1.03])) >= result.robust.worst_peak * (1.0 - 1e-6)
    # The worst scenario in time, with more than three harmonics: the march of the whole annulus.
    row = result.robust.worst
    assert row is not None
    assert row.scenario.disk is not None
    written = solver.mistuned(
        scene.with_values({"shroud.N0": load}), of="root", values=row.scenario.disk.values
    )
    peak = row.highest(PEAK)
    assert peak is not None
    raw = written.to_dict()
    raw["observe"]["dof"] = peak.case.rpartition(" ")[2]  # type: ignore[index]
    marched = solver.march(solver.Scene.from_dict(raw), frequency_hz=peak.at_hz)
    assert marched.half_peak_to_peak == pytest.approx(peak.value, rel=0.01)


def difference(f: Callable[[float], float], h: float) -> float:
    """The derivative at 0 by central differences of fourth order."""
    return (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h)


def made_up(value: float, slope: np.ndarray, scenario: Scenario) -> Outcome:
    row = CriterionRow(
        quantity=PEAK, case="a", what="peak", value=value, gradient=np.zeros(1), at_hz=1.0,
        weight=1.0, bound=None,
    )  # fmt: skip
    return Outcome(scenario=scenario, rows=(row,), by_delta=slope[None, :], responses=1)


@pytest.mark.parametrize("shape", [UncertaintyShape.BOX, UncertaintyShape.BALL])
def test_a_worst_case_inside_the_set_is_found(shape: UncertaintyShape) -> None:
    given = {"damper.mu": [0.2, 0.4], "damper.kt": [20.0, 40.0]}
    if shape is UncertaintyShape.BALL:
        given = {
            "centre": {"damper.mu": 0.3, "damper.kt": 30.0},
            "half_axes": {"damper.mu": 0.1, "damper.kt": 10.0},
        }  # type: ignore[dict-item]
    over = read_uncertain(TWO, (), given)
    top, curved = np.array([0.31, 27.0]), np.array([100.0, 0.01])

    def hill(scenario: Scenario) -> Outcome:
        place = np.array([delta for _, delta in scenario.settings])
        off = place - top
        return made_up(5.0 - float(curved @ off**2), -2.0 * curved * off, scenario)

    found = pessimise(hill, over, Aspect(quantity=PEAK, limited=False), ())
    assert found.value == pytest.approx(5.0, rel=1e-9)
    assert [delta for _, delta in found.worst.scenario.settings] == pytest.approx(top, rel=1e-4)


def test_a_scenario_without_response_is_never_a_value() -> None:
    over = read_uncertain(TWO, (), {"damper.mu": [0.2, 0.4]})

    def broken(scenario: Scenario) -> Outcome:
        if scenario.xi == (1.0,):
            return Outcome(scenario=scenario, rows=(), by_delta=np.zeros((0, 1)), responses=1)
        return made_up(1.0, np.ones(1), scenario)

    with pytest.raises(UnknownScenarioError, match=r"damper\.mu = 0\.4"):
        pessimise(broken, over, Aspect(quantity=PEAK, limited=False), ())


@pytest.mark.long
def test_a_limit_is_kept_in_every_scenario() -> None:
    result = optim.robust_design(
        TWO, uncertain={"damper.mu": [0.25, 0.35]}, variables=N0, limit=1.5, max_band_hz=0.30, samples=4
    )
    assert result.status in (RobustStatus.OPTIMAL, RobustStatus.INFEASIBLE)
    problem = pose(TWO, variables=N0, limit=1.5, max_band_hz=0.30)
    bands = [
        solver.sweep(TWO.with_values({**result.optimum, "damper.mu": mu}), limit=1.5).band.width  # type: ignore[union-attr]
        for mu in np.linspace(0.25, 0.35, 11)
    ]
    assert problem.limits.get(BAND) == 0.30
    assert (max(bands) <= 0.30 * (1.0 + 1e-5)) == (result.status is RobustStatus.OPTIMAL)


@pytest.mark.long
def test_a_limit_that_no_design_keeps_says_so() -> None:
    result = optim.robust_design(
        TWO,
        uncertain={"damper.mu": [0.25, 0.35]},
        variables=N0,
        limit=1.0,
        max_band_hz=0.01,
        samples=2,
        harmonics=3,
    )
    assert result.status is RobustStatus.INFEASIBLE
    assert result.robust is not None
    assert not result.robust.feasible


@pytest.mark.long
def test_without_friction_it_is_flat() -> None:
    result = optim.robust_design(
        TWO.with_values({"damper.mu": 0.0}), uncertain={"structure.k1": {"deviation": 0.1}}, variables=N0
    )
    assert result.status is RobustStatus.FLAT
    assert not result.reached


def test_a_scenario_that_can_not_be_computed_is_named() -> None:
    samples = [{"damper.mu": 0.3}, {"structure.k2": 0.0}]
    result = optim.robust_design(TWO, uncertain=samples, variables=N0, harmonics=3)
    assert result.status is RobustStatus.UNKNOWN_SCENARIO
    assert result.unknown is not None
    assert result.unknown.words() == "structure.k2 = 0"
    answer = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert answer["reached"] is False
    assert answer["unknown"]["words"] == "structure.k2 = 0"


def test_without_any_response_it_says_so() -> None:
    raw = TWO.to_dict()
    for damper in raw["structure"]["springs"]:  # type: ignore[index]
        damper["c"] = 0.0
    scene = solver.Scene.from_dict(raw).with_values({"damper.mu": 0.01})
    result = optim.robust_design(
        scene, uncertain={"damper.mu": [0.01, 0.02]}, variables={"damper.N0": (0.5, 1.0)}, harmonics=1
    )
    assert result.status is RobustStatus.UNDAMPED
    assert result.robust is None
    json.dumps(result.to_json(), allow_nan=False)


@pytest.mark.long
def test_a_search_that_runs_out_says_how_far_it_came(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("optim.robust.robust_search.MOST_CUTS", 1)
    open_gap = optim.robust_design(
        TWO, uncertain={"half_axes": {"damper.mu": 0.3, "damper.kt": 0.2}, "relative": True}, variables=N0,
        samples=2, harmonics=3,
    )  # fmt: skip
    monkeypatch.setattr("optim.robust.robust_search.MOST_RESPONSES", 40)
    spent = optim.robust_design(TWO, uncertain=KT_AND_MU, variables=N0, harmonics=3)
    assert open_gap.status is RobustStatus.NOT_CLOSED
    assert open_gap.gap > 1e-6
    assert open_gap.robust is not None
    assert open_gap.robust.worst_peak == pytest.approx(open_gap.objective * (1.0 + open_gap.gap), rel=1e-6)
    assert spent.status is RobustStatus.TOO_MANY
    assert not spent.reached


def test_a_single_nominal_scenario_gives_the_nominal_optimum() -> None:
    result = optim.robust_design(TWO, uncertain=[{"damper.mu": 0.3}], variables=N0)
    assert result.status is RobustStatus.OPTIMAL
    assert result.optimum["damper.N0"] == pytest.approx(result.design.optimum["damper.N0"], rel=1e-5)
    assert result.gain == pytest.approx(0.0, abs=1e-9)


def test_it_can_be_stopped_at_any_time() -> None:
    for after in (3, 60):
        asked = itertools.count()
        result = optim.robust_design(
            TWO, uncertain=KT_AND_MU, variables=N0, should_stop=lambda: next(asked) > after  # noqa: B023
        )  # fmt: skip
        assert result.status is RobustStatus.STOPPED
        assert json.loads(json.dumps(result.to_json(), allow_nan=False))["reached"] is False


def test_the_json_is_strict_and_progress_ends_at_one() -> None:
    seen: list[float] = []
    result = optim.robust_design(
        TWO, uncertain=[{"damper.mu": 0.3}], variables=N0, on_progress=lambda share, _: seen.append(share)
    )
    assert seen[-1] == 1.0
    assert seen == sorted(seen)
    answer = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert answer["robust"]["worst"]["peak"] == pytest.approx(answer["nominal"]["worst"]["peak"], rel=1e-6)
    assert {"optimum", "nominal", "robust", "cuts", "gap", "status", "seconds", "responses"} <= set(answer)


def small_disk() -> solver.Scene:
    raw = solver.load_scene("bladed-disk").to_dict()
    raw["structure"]["sectors"] = 3  # type: ignore[index]
    raw["observe"]["band"] = [700.0, 820.0]  # type: ignore[index]
    return solver.Scene.from_dict(raw)


def test_the_worst_blade_of_a_mistuned_disk_counts() -> None:
    scene, values = small_disk(), [1.0, 1.02, 0.97]
    variables = {"shroud.N0": (100.0, 400.0)}
    problem = pose(scene, variables=variables, harmonics=3)
    over = read_uncertain(scene, problem.variables, {"mistuning": {"of": "tip", "values": [values]}})
    found = outcome(problem, {"shroud.N0": 200.0}, over.all()[0])
    written = solver.mistuned(scene, of="tip", values=values)
    blades = solver.blade_peaks(written, dof="tip", harmonics=3)
    for sector in range(3):
        mine = [r.value for r in found.rows if r.quantity is PEAK and f"tip@{sector}" in r.case]
        assert max(mine) == pytest.approx(blades.value[sector], rel=1e-9)


def test_another_blade_observed_on_a_branch_is_that_of_its_own_sweep() -> None:
    written = solver.mistuned(small_disk(), of="tip", values=[1.0, 1.02, 0.97])
    branch = solver.sweep(written, harmonics=3)
    seen = observing(branch, "tip@2")
    raw = written.to_dict()
    raw["observe"]["dof"] = "tip@2"  # type: ignore[index]
    own = solver.sweep(solver.Scene.from_dict(raw), harmonics=3)
    # The points between those of the continuation are put where each DOF needs them.
    assert seen.peaks[0].value == pytest.approx(own.peaks[0].value, rel=1e-9)
    assert seen.peaks[0].at == pytest.approx(own.peaks[0].at, rel=1e-7)
    for value, frequency_hz in zip(seen.amplitude[::8], seen.values[::8], strict=True):
        point = solver.solve(own.balance.scene, frequency_hz=float(frequency_hz), harmonics=3)
        assert value == pytest.approx(point.max_abs, rel=1e-7)
    assert seen.band is not None
    assert own.band is not None
    assert seen.band.width == pytest.approx(own.band.width, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"aim": "luck"}, ["aim", "worst-case", "luck"]),
        ({"quantile": 1.0}, ["quantile", "1.0"]),
        ({"samples": 1}, ["samples", ">= 2"]),
        ({"seed": -1}, ["seed", "-1"]),
        ({"max_peak": -1.0}, ["max_peak", "-1.0"]),
    ],
)
def test_bad_arguments_are_named(arguments: dict[str, object], words: list[str]) -> None:
    with pytest.raises(optim.DesignError) as caught:
        optim.robust_design(TWO, uncertain=KT_AND_MU, variables=N0, **arguments)  # type: ignore[arg-type]
    for word in words:
        assert word in str(caught.value)


@pytest.mark.long
def test_the_worst_case_of_the_bladed_disk_is_that_of_a_grid_over_design_and_uncertainty() -> None:
    scene = solver.load_scene("bladed-disk")
    uncertain = {"shroud.kt": {"deviation": 0.2}, "shroud.mu": [0.2, 0.4]}
    result = optim.robust_design(scene, uncertain=uncertain, variables={"shroud.N0": (20.0, 3000.0)})
    assert result.status is RobustStatus.OPTIMAL

    def worst(load: float) -> float:
        grid = itertools.product(5.53e6 * np.linspace(0.8, 1.2, 5), np.linspace(0.2, 0.4, 9))
        branches = [
            solver.sweep(scene.with_values({"shroud.N0": load, "shroud.kt": kt, "shroud.mu": mu}))
            for kt, mu in grid
        ]
        return max(branch.peaks[0].value for branch in branches)

    here = worst(result.optimum["shroud.N0"])
    assert here <= result.objective * (1.0 + 1e-6)
    assert here == pytest.approx(result.objective, rel=2e-3)
    # Between 183 and 185 N the worst case does not depend on the load: it is a peak over mu N0.
    for load in (100.0, 150.0, 175.0, 182.0, 187.0, 200.0, 300.0, 600.0, 1500.0):
        assert worst(load) > result.objective
