"""A crude time march for contacts that slide in two directions under one circular limit.

Newmark's average acceleration with a return of the force to its limit in every step; it shares nothing with
the solver but the matrices of the scene. Its error is of first order in the step where the force turns.
"""

import math

import numba
import numpy as np

from solver import Scene
from solver.linear.assembly import linear_model
from solver.scene.scene import FrictionContact


@numba.njit
def _steps(inverse, M, C, K, L, kt, group, box, mu, N0, N1, phase, pull, omega, x, v, T, periods, tolerance):  # type: ignore[no-untyped-def]
    n, count, h = x.size, pull.shape[0], 2.0 * math.pi / omega / pull.shape[0]
    a = np.linalg.solve(M, pull[0] - C @ v - K @ x - L.T @ T)
    record = np.empty((count, n))
    now, before = T.copy(), T.copy()
    for period in range(periods):
        at_begin, x_begin = T.copy(), x.copy()
        for j in range(count):
            to = (j + 1) % count
            u = L @ x
            known = M @ (4.0 / h**2 * x + 4.0 / h * v + a) + C @ (2.0 / h * x + v) + pull[to]
            limit = np.maximum(mu * (N0 + N1 * np.cos(2.0 * math.pi * to / count + phase)), 0.0)
            now[:] = T
            for _ in range(60):
                before[:] = now
                beyond = inverse @ (known - L.T @ now)
                trial = T + kt * (L @ beyond - u)
                i = 0
                while i < T.size:
                    if group[i] == 2 and not box[i]:
                        size = math.hypot(trial[i], trial[i + 1])
                        share = min(1.0, limit[i] / size) if size > 0.0 else 1.0
                        now[i], now[i + 1] = share * trial[i], share * trial[i + 1]
                        i += 2
                    else:
                        now[i] = min(max(trial[i], -limit[i]), limit[i])
                        i += 1
                if np.abs(now - before).max() <= 1e-13 * (1e-300 + np.abs(now).max()):
                    break
            beyond = inverse @ (known - L.T @ now)
            speed = 2.0 / h * (beyond - x) - v
            a = 4.0 / h**2 * (beyond - x) - 4.0 / h * v - a
            x[:], v[:], T[:] = beyond, speed, now
            record[to] = x
        # A force at its limit repeats long before the motion does.
        repeats = np.abs(T - at_begin).max() <= tolerance * np.abs(T).max()
        if repeats and np.abs(x - x_begin).max() <= tolerance * np.abs(record).max() and period > 5:
            return record, True
    return record, False


def crude_march(
    scene: Scene, frequency_hz: float, *, count: int = 3000, periods: int = 400
) -> tuple[np.ndarray, bool]:
    """Observed displacement [m] over the last period from rest, contacts without force; and if it repeats."""
    model = linear_model(scene)
    M, C, K, L = model.M, model.C0, model.K0, model.contact_here
    omega = 2.0 * math.pi * frequency_hz
    h = 2.0 * math.pi / omega / count
    rows: list[tuple[float, ...]] = []
    for contact in scene.contacts:
        assert isinstance(contact, FrictionContact)
        two, box = len(contact.pairs), getattr(contact, "limit", None) == "box"
        rows += [(contact.kt, two, box, contact.mu, contact.N0, contact.N1_value, contact.N1_phase)] * two
    kt, group, box, mu, N0, N1, phase = np.array(rows).T
    tau = 2.0 * math.pi / count * np.arange(count)
    pull = np.zeros((count, M.shape[0]))
    for force in model.forces:
        turn = np.cos(force.harmonic * tau + force.phase) if force.harmonic else np.ones(count)
        pull += force.amplitude * turn[:, None] * force.vector
    nothing, n_ports = np.zeros(M.shape[0]), kt.size
    inverse = np.linalg.inv(4.0 / h**2 * M + 2.0 / h * C + K)
    record, repeats = _steps(
        inverse, M.copy(), C.copy(), K.copy(), L.copy(), kt, group, box, mu, N0, N1, phase, pull, omega,
        nothing.copy(), nothing.copy(), np.zeros(n_ports), periods, 1e-9,
    )  # fmt: skip
    return np.asarray(record @ model.observe), bool(repeats)
