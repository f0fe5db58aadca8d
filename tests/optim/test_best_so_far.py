"""The best design so far while a search goes on, judged by sweeps and by the end of the search."""

from __future__ import annotations

from typing import Any

import pytest

import optim
import solver
from optim.results.design_result import BestSoFar

TRACKED: dict[str, Any] = {"variables": {"damper.N0": (20, 500)}}
SEARCHED: dict[str, Any] = {
    "variables": {"damper.N0": (20, 500), "damper.kt": (20, 60)}, "harmonics": 5, "method": "minimax",
}  # fmt: skip
LIMITED: dict[str, Any] = {**TRACKED, "harmonics": 5, "limit": 2.0, "max_band_hz": 0.22}


@pytest.mark.parametrize("problem", [TRACKED, SEARCHED, LIMITED], ids=["tracked", "searched", "limited"])
def test_it_is_what_a_sweep_gives_and_ends_in_the_optimum(problem: dict[str, Any]) -> None:
    scene = solver.load_scene("two-dof")
    told: list[BestSoFar] = []
    shares: list[float] = []
    counts: list[int] = []

    def progress(share: float, count: int) -> None:
        shares.append(share)
        counts.append(count)

    found = optim.design(scene, **problem, on_best=told.append, on_progress=progress)
    verified = [one for one in told if one.verified]
    assert verified
    assert [one.verified for one in told] == sorted(one.verified for one in told), "ranked ones come first"
    feasible = [one.objective for one in verified if one.feasible]
    assert feasible == sorted(feasible, reverse=True)
    for one in (verified[0], verified[-1]):
        swept = solver.sweep(scene.with_values(one.values), harmonics=problem.get("harmonics", 11))
        assert swept.peak is not None
        assert one.peak == pytest.approx(swept.peak.value, rel=1e-6)
    assert found.peak is not None
    assert verified[-1].feasible
    assert verified[-1].peak == pytest.approx(found.peak.value, rel=1e-5)
    assert shares == sorted(shares)
    assert counts == sorted(counts), "neither the share nor the count falls back"
    assert shares[-1] == 1.0


def test_a_robust_design_says_what_its_best_is_worth() -> None:
    told: list[BestSoFar] = []
    found = optim.robust_design(
        solver.load_scene("two-dof"), **TRACKED, harmonics=5, uncertain={"damper.mu": (0.2, 0.4)}, samples=8,
        on_best=told.append,
    )  # fmt: skip
    assert "without the uncertainty" in told[0].words
    assert "scenarios so far" in told[-1].words
    assert not any(one.verified for one in told)
    assert found.robust is not None
    assert told[-1].values == dict(found.optimum)
    assert told[-1].peak == pytest.approx(found.robust.worst_peak, rel=1e-5)
