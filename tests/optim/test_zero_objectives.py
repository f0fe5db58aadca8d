"""What is minimised may be 0: without a force, with a harmonic that vanishes in stick, without slip."""

import copy
from typing import Any

import pytest

import optim
import solver
from optim.results.design_result import DesignStatus
from solver.scene.scene import Scene

HARMONICS = 3
LOAD: dict[str, Any] = {"variables": {"damper.N0": (5.0, 2000.0)}, "harmonics": HARMONICS}
BOTH: dict[str, Any] = {"variables": {"damper.N0": (5.0, 2000.0), "damper.mu": (0.1, 0.5)}}
KEYS: dict[str, dict[str, Any]] = {
    "peak": {}, "limit": {"max_peak": 1.0}, "ipopt": {"method": "ipopt"}, "minimax": {"method": "minimax"},
    "band": {"weights": {"band": 1.0}}, "peak and band": {"weights": {"peak": 1.0, "band": 1e-3}},
    "work": {"max_friction_work": 1e-3}, "two variables": BOTH,
    "wear": {"weights": {"wear": 1e6}, "wear_coefficient": 1e-12},
    "wear and its limit": {
        "weights": {"peak": 1.0, "wear": 1e9}, "wear_coefficient": 1e-12, "max_wear_rate": 1e-14,
    },
}  # fmt: skip


def scene_of(which: str) -> Scene:
    raw: dict[str, Any] = copy.deepcopy(solver.load_scene("two-dof").to_dict())
    if which == "no force":
        raw["excitation"]["amplitude"] = 0.0
    elif which == "small force":
        raw["excitation"]["amplitude"] = 0.5
    else:
        raw["observe"] = {"dof": "m2", "band": [0.2, 0.7], "harmonic": 3}
    return Scene.from_dict(raw)


@pytest.mark.few(12)
@pytest.mark.parametrize("keys", KEYS.values(), ids=KEYS)
@pytest.mark.parametrize("which", ["no force", "small force", "third harmonic"])
def test_a_design_ends_with_a_status(which: str, keys: dict[str, Any]) -> None:
    scene = scene_of(which)
    found = optim.design(scene, **LOAD | keys)
    found.to_json()
    assert found.evaluation is not None
    if which == "no force":
        assert found.status is DesignStatus.FLAT
        assert found.evaluation.objective == 0.0
        return
    assert found.reached, found.status
    if which == "third harmonic" or keys.get("weights") == {"wear": 1e6}:
        # A contact that sticks makes no third harmonic, and nothing wears.
        assert found.evaluation.objective == pytest.approx(0.0, abs=1e-12)
        stuck = solver.sweep(scene.with_values(found.optimum), harmonics=HARMONICS)
        assert stuck.peak is not None
        assert which != "third harmonic" or stuck.peak.value == pytest.approx(0.0, abs=1e-12)


@pytest.mark.few(keep=["no force"])
@pytest.mark.parametrize("which", ["third harmonic", "no force"])
def test_so_does_a_front_and_a_robust_design(which: str) -> None:
    scene = scene_of(which)
    front = optim.pareto_front(scene, points=3, **LOAD)
    assert front.status.name in ("NO_TRADE_OFF", "NO_END")
    over = optim.robust_design(scene, uncertain={"damper.mu": [0.25, 0.35]}, samples=2, **LOAD)
    assert over.status.name in ("FLAT", "NOT_KNOWN", "OPTIMAL")
    assert repr(over)
    assert over.robust is None or over.robust.peak == pytest.approx(0.0, abs=1e-12)
