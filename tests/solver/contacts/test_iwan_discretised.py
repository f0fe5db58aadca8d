"""The sliders of an Iwan element are in the estimate, beside the closed form of Segalman's density."""

import numpy as np
import pytest
from scipy.optimize import brentq

from solver import Scene, solve

SPRING = 10.0  # N/m


def backbone(u: float, limit: float, k: float, chi: float, beta: float) -> float:
    """The force of first loading [N]: the density R φ^χ up to φ_max, and S there, integrated by hand."""
    mean = (chi + 1.0) / (chi + 2.0)
    top = limit * (1.0 + beta) / (k * (beta + mean))
    x = min(u / top, 1.0)
    return k / (1.0 + beta) * top * (mean * x ** (chi + 2.0) + x * (1.0 - x ** (chi + 1.0)) + beta * x)


@pytest.mark.parametrize("seeds", [range(12), pytest.param(range(12, 200), marks=pytest.mark.long)])
def test_errors_of_the_sliders_are_below_the_estimate(seeds: range) -> None:
    """Slowly, so that the amplitude is that of first loading, as Masing's rule has it."""
    ratios = []
    for seed in seeds:
        rng = np.random.default_rng(56_000 + seed)
        limit, k = 10.0 ** rng.uniform(-2.0, 3.0), SPRING * 10.0 ** rng.uniform(-1.0, 1.5)
        chi, beta = rng.uniform(-0.9, 1.0), 10.0 ** rng.uniform(-2.0, 1.0)
        force = limit * 10.0 ** rng.uniform(-1.2, 0.3)
        contact = {
            "name": "c", "law": "iwan", "between": ["a", "ground"], "limit": limit, "k": k, "chi": chi,
            "beta": beta,
        }  # fmt: skip
        raw = {
            "name": "joint",
            "structure": {
                "kind": "lumped",
                "masses": {"a": 1e-6},
                "springs": [{"between": ["a", "ground"], "k": SPRING}],
            },
            "contacts": [contact],
            "excitation": {"dof": "a", "amplitude": force},
            "observe": {"dof": "a", "band": [0.01, 1.0]},
        }
        known = float(
            brentq(
                lambda u, own=(limit, k, chi, beta), force=force: SPRING * u + backbone(u, *own) - force,
                0.0, 1.1 * force / SPRING, xtol=1e-14 * force / SPRING,
            )
        )  # fmt: skip
        solution = solve(Scene.from_dict(raw), frequency_hz=0.01, harmonics=21)
        assert solution.converged
        ratios.append(solution.error_estimate / abs(solution.max_abs - known))
    assert np.mean(np.array(ratios) >= 1.0) >= 0.98
    assert np.median(ratios) <= 100.0
