"""Griffin's blade with a flexible damper (J. Eng. Power 102 (1980) 329): the load that makes the peak least.

One harmonic of a slider of stiffness k_d and limit F on an undamped mass under P cos ωt: at resonance the
force works π P A a period and the slider takes 4F (A − F/k_d), so A = 4F² / (k_d (4F − πP)). That is least,
πP/k_d, at F = μN₀ = πP/2: A is twice the motion from which it slips, and m ω² = k + k_d/2.
"""

import math

import numpy as np
import pytest

import solver
from tests.cases.mode_cases import one_mass


@pytest.mark.parametrize("seed", range(6))
def test_the_least_peak_of_one_blade_is_griffins(seed: int) -> None:
    r = np.random.default_rng(seed)
    m, k, P = 10.0 ** r.uniform(-2.0, 1.0), 10.0 ** r.uniform(2.0, 6.0), 10.0 ** r.uniform(-1.0, 3.0)
    kd = k * 10.0 ** r.uniform(-1.5, 0.5)
    frequency = math.sqrt((k + 0.5 * kd) / m) / (2.0 * math.pi)
    raw = one_mass(m, k, 0.0, kd, 0.5 * math.pi * P).to_dict()
    raw["excitation"] = [{"dof": "x", "amplitude": P}]
    raw["observe"] = {"dof": "x", "band": [0.5 * frequency, 1.5 * frequency]}
    scene = solver.Scene.from_dict(raw)
    peak = solver.sweep(scene, harmonics=1).peak
    assert peak is not None
    assert peak.value == pytest.approx(math.pi * P / kd, rel=1e-12)
    assert peak.at == pytest.approx(frequency, rel=1e-8)
    load = scene.value("damper.N0")
    best = solver.least_peak(scene, "damper.N0", 0.55 * load, 3.0 * load, harmonics=1)
    assert best.peak == pytest.approx(math.pi * P / kd, rel=1e-12)
    assert best.at == pytest.approx(load, rel=1e-8)
