"""Three masses with an Iwan joint near a 3:1 superharmonic resonance, against tmdsimpy.

J. H. Porter, M. R. W. Brake, Efficient model reduction and prediction of superharmonic resonances in
frictional and hysteretic systems, arXiv:2405.15918; the parameters are those of `examples/vprnm_rom_iwan.py`
of tmd-lab/tmdsimpy (commit 17d5fc3). That repository states no numbers of this case: these are what its
residual of the balance with a held amplitude of 20 (harmonics 0 to 3, 1000 sliders) gives, solved to 1e-12.
"""

import math

import numpy as np
import pytest

import solver

# ω [rad/s]: the force for a first harmonic of 20, and the third harmonic of the first mass.
TMDSIMPY = {
    0.7: (8.717443942353734, 0.09322301687962678), 0.9: (4.498594425973678, 0.2984498794964626),
    1.0: (1.6565988467177064, 2.419870839107445), 1.01: (2.0037613124140545, 3.473035005307406),
    1.05: (1.9685593491308417, 1.1237504498362303), 1.2: (15.025396536384893, 0.541719090195603),
}  # fmt: skip


def three_masses(force: float) -> solver.Scene:
    """The modes 1, 3 and 7.5 rad/s with their shapes; half of the joint's stiffness is taken out of K."""
    shapes = np.linalg.inv(np.array([[1.0, 2.0, -2.0], [2.0, 1.0, 1.0], [3.0, -1.0, 1.0]]))
    between = np.array([[0.0], [1.0], [-1.0]])
    M = shapes.T @ shapes
    K = shapes.T @ np.diag([1.0, 9.0, 56.25]) @ shapes - 0.3 * between @ between.T
    return solver.Scene.from_dict({
        "name": "three-masses",
        "structure": {
            "kind": "matrices", "M": M.tolist(), "K": K.tolist(), "C": (0.01 * M).tolist(),
            "dofs": {"a": 0, "b": 1, "c": 2},
        },
        "contacts": [
            {
                "name": "j", "law": "iwan", "between": ["b", "c"], "limit": 10.0, "k": 0.6, "chi": -0.5,
                "beta": 0.0,
            }
        ],
        "excitation": {"dof": "a", "amplitude": force}, "observe": {"dof": "a", "band": [0.1, 0.22]},
    })  # fmt: skip


@pytest.mark.parametrize("omega", TMDSIMPY)
def test_the_response_is_that_of_tmdsimpy(omega: float) -> None:
    """Sliders stand for the density of strengths, 41 here: 6e-3 of the amplitude, 2e-2 of harmonic 3."""
    force, third = TMDSIMPY[omega]
    found = solver.solve(three_masses(force), frequency_hz=omega / (2.0 * math.pi), harmonics=3)
    assert found.converged
    assert np.hypot(*found.observed[1:3]) == pytest.approx(20.0, rel=6e-3)
    assert np.hypot(*found.observed[5:7]) == pytest.approx(third, rel=2e-2)
