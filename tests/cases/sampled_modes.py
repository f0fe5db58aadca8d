"""The extended periodic motion by samples in time: full matrices, an incremental slider, numpy alone."""

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
SAMPLES = 4096
_RATIO = 1e-7  # of the differences the forces are differentiated by


def beam_matrices(elements: int) -> tuple[Real, Real]:
    """Mass and stiffness of a clamped steel beam (Euler, Bernoulli), 0.4 m long, 20 mm by 6 mm, bent flat.

    Deflection and slope of every node but the clamped one.
    """
    E, rho, width, height, length = 2.1e11, 7850.0, 0.02, 0.006, 0.4
    EI, mass, h = E * width * height**3 / 12.0, rho * width * height, length / elements
    k = EI / h**3 * np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
         [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    )  # fmt: skip
    m = mass * h / 420.0 * np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
    )  # fmt: skip
    n = 2 * (elements + 1)
    M, K = np.zeros((n, n)), np.zeros((n, n))
    for e in range(elements):
        at = slice(2 * e, 2 * e + 4)
        M[at, at] += m
        K[at, at] += k
    return M[2:, 2:], K[2:, 2:]


class SampledMode:
    """A structure with one slider between a DOF and the ground."""

    def __init__(
        self, M: Real, C: Real, K: Real, dof: int, kt: float, limit: float, *, harmonics: int
    ) -> None:
        self.M, self.C, self.K, self.dof, self.kt, self.limit = M, C, K, dof, kt, limit
        self.H = harmonics
        tau = 2.0 * np.pi / SAMPLES * np.arange(SAMPLES)
        k = np.arange(1, harmonics + 1)
        self.waves = np.concatenate(
            [np.ones((SAMPLES, 1)), np.cos(np.outer(tau, k)), np.sin(np.outer(tau, k))], 1
        )
        self.weights = np.where(np.arange(2 * harmonics + 1) == 0, 1.0, 2.0) / SAMPLES

    def forces(self, coefficients: Real) -> Real:
        """Coefficients [mean, cosines, sines] of the slider's force under many motions, (2H + 1, m)."""
        u = self.waves @ coefficients
        f = np.clip(self.kt * u[0], -self.limit, self.limit)
        history = np.empty_like(u)
        for period in range(2):
            for j in range(SAMPLES):
                f = np.clip(f + self.kt * (u[j] - u[j - 1]), -self.limit, self.limit) if period + j else f
                history[j] = f
        return self.weights[:, None] * (self.waves.T @ history)

    def solve(self, a: float, start: Real, omega: float, zeta: float) -> tuple[float, float]:
        """Solve at an amplitude from a motion (n, 2H + 1) in the order c0, c1, s1, …; return ω and ζ."""
        n, H = len(self.M), self.H
        q = np.concatenate([start[:, :1], start[:, 1::2], start[:, 2::2]], 1).T.reshape(-1)
        y = np.concatenate([q + 0.0, [omega, zeta]])
        for _ in range(20):
            r, J = self._equations(y, a, n, H)
            step = np.linalg.solve(J, -r)
            y = y + step
            if np.abs(step[:-2]).max() < 1e-10 * np.abs(y[:-2]).max() and abs(step[-1]) < 1e-11:
                return float(y[-2]), float(y[-1])
        raise AssertionError("the samples gave no solution")

    def _equations(self, y: Real, a: float, n: int, H: int) -> tuple[Real, Real]:
        """Residual and Jacobian; the phase by the sine of the slider's DOF, which is held at its start."""
        omega, zeta = y[-2:]
        q = y[:-2].reshape(2 * H + 1, n)
        scale = float(np.abs(q[:, self.dof]).max())
        near = q[:, self.dof][:, None] + _RATIO * scale * np.eye(2 * H + 1)
        every = self.forces(np.concatenate([q[:, self.dof][:, None], near], 1))
        F, dF = every[:, 0], (every[:, 1:] - every[:, :1]) / (_RATIO * scale)
        size = n * (2 * H + 1)
        r, J = np.zeros(size + 2), np.zeros((size + 2, size + 2))
        R, by_q = r[:size].reshape(2 * H + 1, n), J[:size, :size].reshape(2 * H + 1, n, 2 * H + 1, n)
        R[0], by_q[0, :, 0, :] = self.K @ q[0], self.K
        by_omega, by_zeta = np.zeros((2 * H + 1, n)), np.zeros((2 * H + 1, n))
        for k in range(1, H + 1):
            c, s = k, H + k
            stiff, drag = self.K - (k * omega) ** 2 * self.M, k * omega * (self.C - 2 * zeta * omega * self.M)
            R[c], R[s] = stiff @ q[c] + drag @ q[s], stiff @ q[s] - drag @ q[c]
            by_q[c, :, c, :] = by_q[s, :, s, :] = stiff
            by_q[c, :, s, :], by_q[s, :, c, :] = drag, -drag
            bent, dragged = -2 * k * k * omega * self.M, k * self.C - 4 * k * zeta * omega * self.M
            by_omega[c], by_omega[s] = bent @ q[c] + dragged @ q[s], bent @ q[s] - dragged @ q[c]
            less = -2 * k * omega**2 * self.M
            by_zeta[c], by_zeta[s] = less @ q[s], -less @ q[c]
        R[:, self.dof] += F
        by_q[:, self.dof, :, self.dof] += dF
        J[:size, -2], J[:size, -1] = by_omega.reshape(-1), by_zeta.reshape(-1)
        moving = q[1:]
        r[-2] = (np.einsum("ki,ij,kj->", moving, self.M, moving) - a * a) / (a * a)
        J[-2, n:size] = (2.0 * moving @ self.M / (a * a)).reshape(-1)
        held = H + 1 if abs(q[H + 1, self.dof]) < abs(q[1, self.dof]) else 1
        J[-1, held * n + self.dof] = 1.0
        return r, J
