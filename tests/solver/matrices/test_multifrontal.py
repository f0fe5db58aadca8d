"""The factor of a large matrix against the dense solution of the same equations."""

from typing import Any

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, random_array

from solver.matrices.reduction import multifrontal
from solver.matrices.reduction.fixed_interface_modes import factor
from solver.matrices.reduction.multifrontal import Cholesky, nested_dissection


def positive_definite(n: int, density: float, seed: int, *, complex_: bool) -> csc_array:
    """A random sparse matrix with eigenvalues over five decades."""
    draw = np.random.default_rng(seed)
    pattern = random_array((n, n), density=density, rng=draw)
    if complex_:
        pattern = pattern * np.exp(1j)
        pattern.data *= np.exp(2j * np.pi * draw.random(pattern.data.size))
    scale = np.diag(10.0 ** draw.uniform(-2.5, 2.5, n))
    dense = pattern.toarray()
    return csc_array(scale @ (dense @ dense.conj().T + 0.1 * np.eye(n)) @ scale)


def chain(n: int) -> csc_array:
    """A clamped chain of n masses: the matrix whose dissection is known."""
    return csc_array(2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))


@pytest.mark.parametrize("complex_", [False, True])
@pytest.mark.parametrize("leaf", [1, 3, 20])
def test_solves_as_the_dense_matrix(monkeypatch: pytest.MonkeyPatch, leaf: int, complex_: bool) -> None:
    """Sparse and nearly full, one row, loose parts, chains."""
    monkeypatch.setattr(multifrontal, "LEAF", leaf)
    sizes = ((1, 1.0), (2, 0.5), (40, 0.02), (90, 0.03), (60, 0.5))
    cases: list[Any] = [positive_definite(n, density, n, complex_=complex_) for n, density in sizes]
    cases += [chain(200), csc_array(np.diag(np.arange(1.0, 50.0))), csc_array(block_diag(cases))]
    for matrix in cases:
        n = matrix.shape[0]
        blocks = nested_dissection(matrix)
        assert sorted(np.concatenate(blocks).tolist()) == list(range(n))
        draw = np.random.default_rng(3)
        forces = draw.normal(size=(n, 5)) + (1j * draw.normal(size=(n, 5)) if complex_ else 0.0)
        found = Cholesky(matrix, blocks)
        for right in (forces, forces[:, 0]):
            x = found.solve(right)
            assert x.shape == right.shape
            left_over = np.abs(matrix @ x - right).max()
            assert left_over <= 1e-13 * n * abs(matrix).max() * np.abs(x).max()
        exact = np.linalg.solve(matrix.toarray(), forces)
        bound = 1e-14 * n * np.linalg.cond(matrix.toarray())
        np.testing.assert_allclose(found.solve(forces), exact, rtol=0, atol=bound * np.abs(exact).max())


def test_a_real_factor_takes_complex_forces() -> None:
    matrix = chain(50)
    forces = np.linspace(0.0, 1.0, 50) + 1j
    found = Cholesky(matrix, nested_dissection(matrix)).solve(forces)
    np.testing.assert_allclose(matrix @ found, forces, atol=1e-12)


def test_shifts_among_the_eigenvalues_are_factorised_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is not positive definite has no Cholesky factor, and is still solved; what is singular is said."""
    monkeypatch.setattr("solver.matrices.reduction.fixed_interface_modes.LARGE", 10)
    monkeypatch.setattr(multifrontal, "LEAF", 10)
    shifted = csc_array(chain(300) - 0.5 * np.eye(300))
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        Cholesky(shifted, nested_dissection(shifted))
    forces = np.linspace(-1.0, 1.0, 300)
    np.testing.assert_allclose(shifted @ factor(shifted)(forces), forces, atol=1e-10)
    singular = csc_array(np.diag([*np.ones(40), 0.0]))
    with pytest.raises(RuntimeError, match="singular"):
        factor(singular)
