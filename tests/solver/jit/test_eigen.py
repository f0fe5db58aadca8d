"""Eigenvalues by NumPy where small: held against SciPy's LAPACK, with rows of very different size."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import linalg

from solver.jit import eigen

SIZES = [1, 2, 3, 7, 20, eigen.SMALL, eigen.SMALL + 1]


def hermitian(rng: np.random.Generator, n: int, *, turning: bool) -> np.ndarray:
    """A positive definite matrix whose rows have units of their own."""
    X = rng.normal(size=(n, n)) + (1j * rng.normal(size=(n, n)) if turning else 0.0)
    size = 10.0 ** rng.uniform(-3.0, 3.0, n)
    return (X @ X.conj().T + 0.1 * np.eye(n)) * size[:, None] * size


@pytest.mark.parametrize("turning", [False, True], ids=["real", "complex"])
@pytest.mark.parametrize("n", SIZES)
def test_a_pencil_is_solved_as_by_lapack(n: int, turning: bool) -> None:
    rng = np.random.default_rng(n)
    A, B = (hermitian(rng, n, turning=turning) for _ in range(2))
    values, vectors = eigen.pencil(A, B)
    known = linalg.eigh(A, B, eigvals_only=True)
    assert np.abs(values - known).max() <= 1e-10 * np.abs(known).max()
    scale = 1.0 / np.sqrt(np.diag(B).real)
    inside = np.linalg.cond(B * scale[:, None] * scale) * np.finfo(float).eps
    assert np.abs(vectors.conj().T @ B @ vectors - np.eye(n)).max() <= 100.0 * n * inside


def test_a_pencil_needs_a_positive_definite_matrix() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        eigen.pencil(np.eye(2), np.diag([1.0, -1.0]))


def residuals(A: np.ndarray) -> tuple[float, float]:
    """Errors of the eigenvectors from the right and from the left, relative to |A| and to theirs."""
    values, left, right = eigen.two_sided(A)
    size = np.linalg.norm(A)
    after = np.linalg.norm(A @ right - right * values, axis=0) / np.linalg.norm(right, axis=0)
    before = np.linalg.norm(left.conj().T @ A - values[:, None] * left.conj().T, axis=1)
    return float(after.max() / size), float((before / np.linalg.norm(left, axis=0)).max() / size)


@pytest.mark.parametrize("n", SIZES)
def test_eigenvectors_from_both_sides(n: int) -> None:
    A = np.random.default_rng(n).normal(size=(n, n))
    assert max(residuals(A)) <= 1e-13
    values, _, _ = eigen.two_sided(A)
    near = np.abs(values[:, None] - linalg.eigvals(A)[None, :]).min(axis=1)
    assert near.max() <= 1e-12 * np.linalg.norm(A)


@pytest.mark.parametrize("apart", [0.0, 1e-15, 1e-12, 1e-8])
def test_eigenvectors_that_nearly_coincide(apart: float) -> None:
    """V⁻¹ is useless there, or missing: LAPACK's own left eigenvectors take its place."""
    assert max(residuals(np.array([[1.0, 1.0, 0.0], [0.0, 1.0 + apart, 1.0], [0.0, 0.0, 2.0]]))) <= 1e-14


def test_a_free_body_has_a_double_eigenvalue() -> None:
    """Position and speed of a mass nothing holds: V⁻¹ would be as large as numbers get."""
    assert max(residuals(np.array([[0.0, 1.0], [0.0, 0.0]]))) <= 1e-14


def test_small_problems_import_no_scipy() -> None:
    code = (
        "import sys, numpy as np; from solver.jit import eigen; A = np.diag([2.0, 3.0]) + 0.1\n"
        "eigen.pencil(A, A); eigen.two_sided(A); sys.exit('scipy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
