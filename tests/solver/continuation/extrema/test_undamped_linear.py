"""Linear scenes without damping, or hardly any: a word, or a number with an estimate that holds."""

import math
from typing import Any

import flint
import numpy as np
import pytest
from exact_linear import Exact, chain, natural_hz

import solver
from solver import Effects, Scene
from solver.balance.rounding import _sharpened
from solver.continuation.branch import BranchStatus
from solver.linear.assembly import linear_model
from solver.linear.condensation import force_amplitudes
from solver.response.solution import SolutionStatus
from solver.studies.blades import blade_peaks
from stickslip.lab.worst_mistuning.worst import WorstSearch, worst_mistuning
from stickslip.lab.worst_mistuning.worst_result import WorstMistuningStatus

RATIOS = (0.0, 1e-12)


def near_a_mode(seed: int, ratio: float) -> tuple[dict[str, Any], float]:
    """A chain with a band about one of its modes, of this damping ratio, and its natural frequency [Hz]."""
    rng = np.random.default_rng(55_000 + seed)
    raw = chain(rng, 0.0)
    natural = natural_hz(raw)
    mode = float(rng.choice(natural))
    for spring in raw["structure"]["springs"]:
        spring["c"] = 2.0 * ratio / (2.0 * math.pi * mode) * spring["k"]
    raw["observe"]["band"] = [0.9 * mode, 1.1 * mode]
    return raw, mode


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("seeds", [range(6), pytest.param(range(6, 100), marks=pytest.mark.long)])
def test_a_peak_has_no_number_or_one_that_is_known(ratio: float, seeds: range) -> None:
    told = 0
    for seed in seeds:
        raw, mode = near_a_mode(seed, ratio)
        branch = solver.sweep(Scene.from_dict(raw))
        if branch.status is BranchStatus.UNDAMPED:
            assert branch.peaks == ()
            assert branch.band is None
            continue
        assert ratio > 0.0, seed
        assert branch.reached
        assert branch.peak is not None
        exact, at = Exact(raw), branch.peak.at
        top = exact.peak(at, ratio * mode) if branch.peak.interior else float(exact.amplitude(at))
        assert abs(branch.peak.value - top) <= branch.error_estimate
        told += branch.error_estimate < 0.1 * top
    assert ratio == 0.0 or told >= 0.3 * len(seeds)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("seeds", [range(20), pytest.param(range(20, 100), marks=pytest.mark.long)])
def test_at_a_resonance_a_number_is_known_as_well_as_it_says(ratio: float, seeds: range) -> None:
    for seed in seeds:
        raw, mode = near_a_mode(seed, ratio)
        off = 10.0 ** np.random.default_rng(seed).uniform(-17.0, -8.0)
        hertz = mode * (1.0 + off)
        solution = solver.solve(Scene.from_dict(raw), frequency_hz=hertz)
        if solution.status is not SolutionStatus.UNDAMPED:
            error = abs(float(flint.arb(solution.max_abs) - Exact(raw).amplitude(hertz)))
            assert error <= solution.error_estimate or solution.error_estimate > 0.3 * solution.max_abs


def test_a_mode_that_hardly_moves_at_the_force_is_driven() -> None:
    """Of a chain with springs of 2 to 2400 N/m: 6e-15 of what drives the first mode, and not nothing."""
    raw, mode = near_a_mode(50, 0.0)
    assert solver.sweep(Scene.from_dict(raw)).status is BranchStatus.UNDAMPED
    model = linear_model(Scene.from_dict(raw))
    K, M, force = model.K0, model.M, force_amplitudes(model, np.array([1]))[0]
    found = _sharpened(K, M, np.array([2.0 * math.pi * mode]), force)[0]
    assert abs(found) == pytest.approx(exact_drive(K, M, force.real), rel=1e-3)


@pytest.mark.parametrize("whole", [False, True], ids=["modes", "matrices"])
def test_a_mode_that_rounding_alone_drives_is_not_driven(whole: bool) -> None:
    """Two masses on a third, pressed alike: of their motion against each other 5e-20 of the drive is left."""
    ends = {("c", "ground"): 3.1}
    for mass in ("a", "b"):
        ends |= {(mass, "c"): 7.3, (mass, "ground"): 1.7}
    raw: dict[str, Any] = {
        "name": "alike",
        "structure": {
            "kind": "lumped", "masses": {"a": 0.1, "b": 0.1, "c": 0.37},
            "springs": [{"between": list(each), "k": k} for each, k in ends.items()],
        },
        "contacts": [],
        "excitation": {"forces": {"a": 1.0, "b": 1.0}, "amplitude": 1.0},
        "observe": {"dof": "a", "band": [1.3, 1.65]},
    }  # fmt: skip
    effects = Effects(whole_matrices=whole)
    assert solver.sweep(Scene.from_dict(raw), effects=effects).status is BranchStatus.COMPLETED
    raw["excitation"]["forces"]["b"] = 1.001
    assert solver.sweep(Scene.from_dict(raw), effects=effects).status is BranchStatus.UNDAMPED


def exact_drive(K: Any, M: Any, force: Any) -> float:
    """What drives the highest mode, φᴴ f, by inverse iteration in 400 bits."""
    before, flint.ctx.prec = flint.ctx.prec, 400
    try:
        scale = [1 / flint.arb(float(m)).sqrt() for m in np.diag(M)]
        n = len(scale)
        A = flint.arb_mat(
            [[scale[i] * flint.arb(float(K[i, j])) * scale[j] for j in range(n)] for i in range(n)]
        )
        top = flint.arb(float(np.linalg.eigvalsh(np.array(A.tolist(), float))[-1]) * (1.0 + 1e-12))
        shifted = A - top * flint.arb_mat(np.eye(n).tolist())
        x = flint.arb_mat([[flint.arb(1)] for _ in range(n)])
        for _ in range(12):
            x = shifted.solve(x)
            size = sum((x[i, 0] ** 2 for i in range(n)), flint.arb(0)).sqrt()
            x = flint.arb_mat([[(x[i, 0] / size).mid()] for i in range(n)])
        return abs(
            float(sum((x[i, 0] * scale[i] * flint.arb(float(force[i])) for i in range(n)), flint.arb(0)))
        )
    finally:
        flint.ctx.prec = before


def test_a_mode_that_no_contact_moves_in() -> None:
    """Two equal masses, a damper between them: nothing damps the two in phase."""
    ends = [["a", "ground"], ["b", "ground"]]
    raw: dict[str, Any] = {
        "name": "in-phase",
        "structure": {
            "kind": "lumped", "masses": {"a": 1.0, "b": 1.0},
            "springs": [{"between": each, "k": 40.0} for each in ends],
        },
        "contacts": [{"name": "d", "between": ["a", "b"], "kt": 20.0, "mu": 0.3, "N0": 100.0}],
        "excitation": {"dof": "a", "amplitude": 1.0}, "observe": {"dof": "b", "band": [0.5, 1.05]},
    }  # fmt: skip
    assert solver.sweep(Scene.from_dict(raw)).status is BranchStatus.UNDAMPED
    raw["excitation"] = {"forces": {"a": 1.0, "b": -1.0}, "amplitude": 1.0}
    assert solver.sweep(Scene.from_dict(raw)).status is BranchStatus.COMPLETED, "it is not driven"
    raw["excitation"] = {"ground": {"a": 1.0, "b": 1.0}, "amplitude": 1.0}
    assert solver.sweep(Scene.from_dict(raw)).status is BranchStatus.UNDAMPED, "a base drives it"


def test_disks_without_damping_have_no_worst_mistuning_and_no_blade_peaks() -> None:
    raw = solver.load_scene("bladed-disk").to_dict()
    raw["structure"].pop("stiffness_proportional_damping", None)
    raw["contacts"] = []
    scene = Scene.from_dict(raw)
    found = worst_mistuning(scene, of="middle", search=WorstSearch(starts=2, climbs=1, climb=1, seed=1))
    assert found.status is WorstMistuningStatus.UNDAMPED
    assert found.worst is None
    assert math.isnan(found.tuned_peak)
    assert np.all(np.isnan(blade_peaks(scene).value))
