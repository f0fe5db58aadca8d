"""Modes and limit cycles of random chains with tanh, Iwan and Bouc-Wen contacts against a march of our own.

Three questions of every point: whether it is the mode asked for, whether work and virial of its motion over a
period give its ω and ζ, and whether the motion, marched freely with −2ζωM, is back after a period. What the
harmonics miss may differ by what the result says of it.
"""

from itertools import pairwise

import numpy as np
import pytest

import solver
from tests.cases.history_modes import FreeMarch, Real, chain_of_history

HARMONICS, STEPS, POINTS = 15, 4000, 6
MOST_DAMPING = 0.25  # beyond, a march grows by more than exp(2πζ) = 5 a period
SHARE = 0.6  # of the most damping that gas feeds
LEAP = 1.6  # times the amplitude, more than a step along the curve makes
SMALLEST = 0.05  # amplitude in sizes of the motion at which contacts give way
# Below, a nearly rigid contact lets nothing swing: ζ is 10 with 5 harmonics and 33 with 15.
CREEPS_BELOW = {95: 0.5}


@pytest.mark.few(keep=(6,))
@pytest.mark.parametrize("seed", range(100))
def test_a_march_repeats_modes_and_cycles_of_a_random_chain(seed: int) -> None:
    body, mode, size = chain_of_history(seed)
    found = solver.nonlinear_mode(
        solver.Scene.from_dict(body), mode, harmonics=HARMONICS,
        amplitudes=(CREEPS_BELOW.get(seed, SMALLEST) * size, 30.0 * size),
    )  # fmt: skip
    assert found.reached, found.status
    light = np.flatnonzero(found.damping_ratio < MOST_DAMPING)
    chosen = light[np.unique(np.linspace(0, len(light) - 1, POINTS).astype(int))]
    assert len(chosen) > 1
    omega, zeta = 2.0 * np.pi * found.frequency_hz[chosen], found.damping_ratio[chosen]
    march = FreeMarch(body, found.dof_motions[chosen], omega, zeta, STEPS)
    if all(contact["law"] != "coulomb-tanh" for contact in body["contacts"]):
        free, stuck = march.natural()
        assert 0.98 * free[mode - 1] < 2.0 * np.pi * found.frequency_hz[0] < 1.02 * stuck[mode - 1]
    _check(march, found.frequency_error[chosen] / found.frequency_hz[chosen], found.damping_error[chosen])
    fed = SHARE * float(found.damping_ratio.max())
    held = solver.limit_cycles(found, -fed, stability=False)
    # A cycle where the curve leaps, over a kink or into another mode, is told and not found.
    leaps = [(0.999 * a, 1.001 * b) for a, b in pairwise(found.amplitude) if b > LEAP * a]
    assert all(any(low <= a and b <= high for low, high in leaps) for a, b in held.unsolved)
    cycles = held.cycles if fed < MOST_DAMPING else ()
    for cycle in cycles:
        omega = np.array([2.0 * np.pi * cycle.frequency_hz])
        march = FreeMarch(body, cycle.record.dofs[None], omega, np.array([fed]), STEPS)
        errors = cycle.frequency_error / cycle.frequency_hz, fed * cycle.amplitude_error / cycle.amplitude
        _check(march, *(np.array([each]) for each in errors))


def _check(march: FreeMarch, omega_error: Real, zeta_error: Real) -> None:
    """Judge motions, given what is said to be missing of ω, relative, and of ζ; NaN says not known."""
    missing = np.nan_to_num(omega_error, nan=np.inf), np.nan_to_num(zeta_error, nan=np.inf)
    omega, zeta = march.balances()
    # The march with 4000 steps is itself good to some 1e-5.
    assert np.all(np.abs(omega / march.omega - 1.0) < 3e-5 + 3.0 * missing[0])
    assert np.all(np.abs(zeta - march.zeta) < 3e-5 + 3.0 * missing[1])
    # A hundredth of ω or of ζ would make a sixteenth.
    # What is missing of ω and ζ turns and feeds the motion; its shape, of which they miss but the square,
    # lacks about as much as the last harmonics have.
    grown = 2.0 * np.pi * np.exp(2.0 * np.pi * march.zeta)
    assert np.all(march.departure() < 2e-3 + grown * sum(missing) + march.last_harmonics())
