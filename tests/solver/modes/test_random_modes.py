"""Nonlinear modes of random scenes against the march in time.

With the damping −2ζωM of a point added as dashpots, the point is a motion of a structure that nothing drives:
the march, which shares no code with the balance, has to repeat it.
"""

import math

import numpy as np
import pytest

import solver
from tests.cases.random_scenes import random_scene

HARMONICS = 31


def _fed(found: solver.NonlinearMode, i: int) -> solver.Scene:
    """The scene with dashpots −2ζωM and nothing that drives it."""
    raw = found.scene.to_dict()
    omega = 2.0 * math.pi * found.frequency_hz[i]
    raw["couplings"] = [
        {"on": mass.dof, "of": mass.dof, "c": float(-2.0 * found.damping_ratio[i] * omega * mass.m)}
        for mass in found.scene.structure.masses
    ]
    return solver.Scene.from_dict(raw).with_values({"excitation.amplitude": 0.0})


def _start(found: solver.NonlinearMode, i: int) -> solver.MarchStart:
    """Displacements, velocities and friction forces of a point at the angle 0."""
    motion, omega = found.dof_motions[i], 2.0 * math.pi * found.frequency_hz[i]
    speeds = omega * motion[:, 2::2] @ np.arange(1, HARMONICS + 1)
    places = motion[:, 0] + motion[:, 1::2].sum(axis=1)
    return solver.MarchStart(
        displacements=dict(zip(found.scene.dofs, places.tolist(), strict=True)),
        velocities=dict(zip(found.scene.dofs, speeds.tolist(), strict=True)),
        tractions={name: float(found.loop(i, name)[1][0]) for name in found.contact_names},
    )


def _sampled(coefficients: np.ndarray, count: int) -> np.ndarray:
    """A row of coefficients at `count` instants of a period."""
    turns = 2.0 * math.pi / count * np.outer(np.arange(1, HARMONICS + 1), np.arange(count))
    waves = coefficients[1::2] @ np.cos(turns) + coefficients[2::2] @ np.sin(turns)
    return np.asarray(coefficients[0] + waves)


def _followed(seed: int) -> solver.NonlinearMode:
    """Mode 1 of a random scene, from stuck to thirty times where the last contact begins to slip."""
    scene, _, _ = random_scene(seed)
    limits = [scene.value(f"{c.name}.mu") * scene.value(f"{c.name}.N0") / c.kt for c in scene.contacts]
    amplitudes = (1e-2 * max(limits), 30.0 * max(limits))
    return solver.nonlinear_mode(scene, amplitudes=amplitudes, harmonics=HARMONICS, errors=False)


def _departure(found: solver.NonlinearMode, i: int) -> float:
    """How far the march is from a point in its second period, relative to the largest motion."""
    frequency = float(found.frequency_hz[i])
    start = _start(found, i)
    marched = solver.march(_fed(found, i), frequency_hz=frequency, start=start, max_periods=1)
    motions = [_sampled(each, marched.time.size) for each in found.contact_motions[i]]
    return float(np.abs(marched.slip - motions).max() / np.abs(found.contact_motions[i]).max())


def _check(found: solver.NonlinearMode) -> int:
    """Compare points that slip; return how many."""
    # Dashpots that feed let what the harmonics leave out grow by exp(4πζ) a period.
    zeta = found.damping_ratio
    slipping = np.flatnonzero((zeta > 1.01 * zeta[0]) & (zeta < 0.2))
    chosen = slipping[:: max(1, len(slipping) // 4)]
    for i in chosen:
        # A hundredth part of ω or of ζ would make an eighth.
        assert _departure(found, int(i)) < 5e-3, (i, found.amplitude[i])
    return len(chosen)


@pytest.mark.few(3)
@pytest.mark.parametrize("seed", [6, 7, 11, 12, 18, 20, 23])
def test_the_march_repeats_a_mode_of_a_random_scene(seed: int) -> None:
    found = _followed(seed)
    assert found.reached, found.status
    assert _check(found) >= 2


@pytest.mark.long
def test_the_march_repeats_modes_of_many_random_scenes() -> None:
    ended, compared = [], 0
    for seed in range(1, 61):
        found = _followed(seed)
        ended.append(found.status)
        if found.points:
            compared += _check(found)
    assert compared > 80
    assert ended.count(solver.NonlinearModeStatus.COMPLETED) >= 48
