"""The Fourier basis and the order of its coefficients."""

import numpy as np
import pytest

from solver.jit import fourier

RNG = np.random.default_rng(0)
SUBSETS = [np.array(ks) for ks in ([0], [1], [0, 1, 2, 3], [1, 3, 5], [0, 2, 4, 6])]


@pytest.mark.parametrize("ks", SUBSETS, ids=str)
def test_positions_follow_each_other(ks: np.ndarray):
    places = [fourier.cosine_position(ks, i) for i in range(ks.size)]
    sizes = [1 if k == 0 else 2 for k in ks]
    assert places == [sum(sizes[:i]) for i in range(ks.size)]
    assert fourier.coefficient_count(ks) == sum(sizes)


def test_all_harmonics():
    np.testing.assert_array_equal(fourier.all_harmonics(3), [0, 1, 2, 3])
    np.testing.assert_array_equal(fourier.all_harmonics(0), [0])


@pytest.mark.parametrize("ks", SUBSETS, ids=str)
def test_spread_over_all_harmonics(ks: np.ndarray):
    q = RNG.normal(size=(2, fourier.coefficient_count(ks)))
    full = fourier.to_full(q, ks, 7)
    assert full.shape == (2, 15)
    tau = np.linspace(0.0, 6.0, 11)
    expected = np.zeros((2, tau.size))
    for i, k in enumerate(ks):
        here = fourier.cosine_position(ks, i)
        expected += np.outer(q[:, here], np.cos(k * tau))
        if k:
            expected += np.outer(q[:, here + 1], np.sin(k * tau))
    np.testing.assert_allclose(full @ fourier.basis(tau, 7).T, expected, atol=1e-14)


def test_basis_is_orthogonal():
    tau = 2.0 * np.pi / 32 * np.arange(32)
    gram = fourier.basis(tau, 6).T @ fourier.basis(tau, 6) / 16.0
    np.testing.assert_allclose(gram, np.diag([2.0] + [1.0] * 12), atol=1e-14)


def test_complex_amplitudes():
    q = RNG.normal(size=(3, 9))
    amplitudes = fourier.to_complex(q)
    np.testing.assert_array_equal(fourier.to_real(amplitudes), q)
    tau = np.linspace(-3.0, 3.0, 7)
    turning = np.exp(1j * np.outer(np.arange(5), tau))
    np.testing.assert_allclose((amplitudes @ turning).real, q @ fourier.basis(tau, 4).T, atol=1e-14)


def test_derivative():
    q = RNG.normal(size=(2, 11))
    tau, h = np.linspace(0.0, 6.0, 9), 1e-5
    difference = q @ (fourier.basis(tau + h, 5) - fourier.basis(tau - h, 5)).T / (2.0 * h)
    np.testing.assert_allclose(fourier.derivative(q) @ fourier.basis(tau, 5).T, difference, atol=1e-8)
