"""Cosines and sines of several angles, against the C library and in the complex plane."""

import numpy as np
import pytest

from solver.jit.trig_polynomial import cosines_and_sines


@pytest.mark.parametrize("turns", [0.1, 1.0, 20.0])
def test_angles_agree_with_the_library(turns: float) -> None:
    edges = 0.25 * np.pi * np.arange(-16, 17)
    angles = np.concatenate([turns * np.linspace(-np.pi, np.pi, 4001), edges, np.nextafter(edges, 9.0)])
    cosines, sines = np.empty(angles.size), np.empty(angles.size)
    cosines_and_sines(angles, cosines, sines)
    off = 1e-15 + np.abs(angles) * 1e-16
    assert np.all(np.abs(cosines - np.cos(angles)) <= off)
    assert np.all(np.abs(sines - np.sin(angles)) <= off)


def test_an_imaginary_part_carries_the_derivative() -> None:
    angles = np.linspace(-10.0, 10.0, 999)
    cosines, sines = np.empty(angles.size, complex), np.empty(angles.size, complex)
    cosines_and_sines(angles + 1e-30j, cosines, sines)
    np.testing.assert_allclose(cosines.imag / 1e-30, -np.sin(angles), rtol=0.0, atol=3e-15)
    np.testing.assert_allclose(sines.imag / 1e-30, np.cos(angles), rtol=0.0, atol=3e-15)
