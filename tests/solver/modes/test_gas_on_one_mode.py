"""Gas that feeds one mode alone: its cycles move a structure that has 2ζω(Mφ)(Mφ)ᵀ in its damping."""

import math

import numpy as np
import pytest

import solver
from tests.cases.flutter_scenes import chain, chain_body
from tests.cases.mode_cases import one_mass

AERO, STEPS = 0.6, 20_000


def _cycle(seed: int, *, stability: bool) -> tuple[solver.NonlinearMode, float, solver.LimitCycle]:
    mode = solver.nonlinear_mode(chain(seed), amplitudes=(0.1, 100.0), harmonics=21, errors=False)
    aero = -AERO * float(mode.damping_ratio.max())
    found = solver.limit_cycles(mode, aero, mode_alone=True, stability=stability)
    assert found.mode_alone
    assert found.reached
    return mode, aero, found.cycles[0]


def _matrices(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K, the rows, stiffnesses and limits of the sliders."""
    raw = chain_body(seed)
    of = raw["structure"]
    rows = [
        [(dof == contact["between"][0]) - 1.0 * (dof == contact["between"][1]) for dof in of["dofs"]]
        for contact in raw["contacts"]
    ]
    kt, limits = (np.array([contact[key] for contact in raw["contacts"]]) for key in ("kt", "N0"))
    return *(np.array(of[key]) for key in "MCK"), np.array(rows), kt, limits


@pytest.mark.few(2)
@pytest.mark.parametrize("seed", [25, 23])
def test_a_march_by_small_steps_repeats_a_cycle(seed: int) -> None:
    _, aero, cycle = _cycle(seed, stability=False)
    M, C, K, rows, kt, limits = _matrices(seed)
    omega, masses = 2.0 * math.pi * cycle.frequency_hz, np.diag(M)
    root = np.diag(masses**-0.5)
    phi = root @ np.linalg.eigh(root @ (K + rows.T @ np.diag(kt) @ rows) @ root)[1][:, 0]
    C = C + 2.0 * aero * omega * np.outer(M @ phi, M @ phi)
    dofs = cycle.record.dofs
    x = dofs[:, 0] + dofs[:, 1::2].sum(axis=1)
    v = omega * dofs[:, 2::2] @ np.arange(1, (dofs.shape[1] - 1) // 2 + 1)
    forces = cycle.record.forces
    f = np.clip(forces[:, 0] + forces[:, 1::2].sum(axis=1), -limits, limits)
    first, dt = np.concatenate([x, v / omega]), 2.0 * math.pi / omega / STEPS
    for _ in range(STEPS):  # leapfrog with drag at mid-speed, sliders stepwise
        middle = x + 0.5 * dt * v
        f = np.clip(f + kt * (rows @ (middle - x)), -limits, limits)
        push = -(K @ middle + rows.T @ f) / masses
        half = v + 0.5 * dt * (push - C @ v / masses)
        v = v + dt * (push - C @ half / masses)
        x = middle + 0.5 * dt * v
        f = np.clip(f + kt * (rows @ (x - middle)), -limits, limits)
    assert np.abs(np.concatenate([x, v / omega]) - first).max() < 5e-3 * np.abs(first).max()


def test_of_one_mass_it_is_the_gas_on_all_modes() -> None:
    mode = solver.nonlinear_mode(
        one_mass(1.0, 39.478, 0.5, 30.0, 30.0), amplitudes=(0.3, 100.0), harmonics=7, errors=False
    )
    every, alone = (solver.limit_cycles(mode, -0.09, mode_alone=one) for one in (False, True))
    assert len(every.cycles) == len(alone.cycles) == 2
    for a, b in zip(every.cycles, alone.cycles, strict=True):
        assert b.amplitude == pytest.approx(a.amplitude, rel=1e-9)
        assert b.stable == a.stable
    assert alone.most_damping == pytest.approx(every.most_damping, rel=1e-9)


def test_modes_that_only_the_gas_on_all_feeds_no_longer_grow() -> None:
    mode, aero, alone = _cycle(20, stability=True)
    (every, *_) = solver.limit_cycles(mode, aero).cycles
    assert every.stable is False
    assert alone.multipliers is not None
    assert every.multipliers is not None
    assert np.abs(alone.multipliers).max() < np.abs(every.multipliers).max() - 0.05
