"""Nonlinear modes against the extended periodic motion by samples in time, which shares no code with them."""

import math

import numpy as np
import pytest

import solver
from tests.cases.sampled_modes import SampledMode, beam_matrices


def _friction_beam(
    elements: int, *, kt: float, limit: float, ratio: float
) -> tuple[solver.Scene, SampledMode]:
    M, K = beam_matrices(elements)
    C = 2.0 * ratio / 300.0 * K
    n = len(M)
    place = n // 2 - n // 2 % 2
    scene = solver.Scene.from_dict(
        {
            "name": "friction-beam",
            "structure": {
                "kind": "matrices", "M": M.tolist(), "K": K.tolist(), "C": C.tolist(),
                "dofs": [f"x{i}" for i in range(n)],
            },
            "contacts": [
                {"name": "damper", "between": [f"x{place}", "ground"], "kt": kt, "mu": 0.5, "N0": 2.0 * limit}
            ],
            "excitation": {"dof": f"x{n - 2}", "amplitude": 1.0},
            "observe": {"dof": f"x{n - 2}", "band": [1.0, 1000.0]},
        }
    )  # fmt: skip
    return scene, SampledMode(M, C, K, place, kt, limit, harmonics=11)


@pytest.mark.parametrize("mode", [1, 2])
def test_a_friction_beam_is_that_of_samples(mode: int) -> None:
    scene, sampled = _friction_beam(5, kt=2e4, limit=1.0, ratio=1e-3)
    found = solver.nonlinear_mode(scene, mode, amplitudes=(1e-7, 1e-2))
    assert found.reached, found.status
    slipping = np.flatnonzero(found.damping_ratio > 1.05 * found.damping_ratio[0])
    assert len(slipping) > 8
    for i in slipping[:: len(slipping) // 4]:
        start = found.dof_motions[i]
        omega, zeta = sampled.solve(
            float(found.amplitude[i]), start, 2.0 * math.pi * found.frequency_hz[i], found.damping_ratio[i]
        )
        assert 2.0 * math.pi * found.frequency_hz[i] == pytest.approx(omega, rel=1e-4)
        assert found.damping_ratio[i] == pytest.approx(zeta, rel=1e-4)
