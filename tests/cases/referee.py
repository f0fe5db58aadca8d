"""An independent look at a solution: the friction law followed sample by sample, and the whole structure.

Nothing of the compiled loops is used: the force comes from the incremental law on a fine grid of instants,
the motion from the matrices of all degrees of freedom.
"""

import math

import numba
import numpy as np

from solver import Solution, power_balance
from solver.jit.fourier import to_complex, to_real
from solver.linear.assembly import linear_model
from solver.linear.condensation import force_amplitudes
from solver.response.time_history import matrices

SAMPLES = 1 << 15
PERIODS = 4


@numba.njit
def _follow(u, limit, kt, periods):  # type: ignore[no-untyped-def]
    """Force of one contact on the grid, the last of some periods, from no force at no slip."""
    force = np.empty_like(u)
    before, f = 0.0, 0.0
    for _ in range(periods):
        for i in range(u.size):
            f = min(max(f + kt * (u[i] - before), -limit[i]), limit[i])
            before, force[i] = u[i], f
    return force


def sampled_force(solution: Solution, which: int) -> np.ndarray:
    """Coefficients of a contact's force by sampling; relative error about 1e-4 where it lifts, else less."""
    contact, law = solution.contacts[which], solution.scene.contacts[which]
    tau = np.linspace(0.0, 2.0 * math.pi, SAMPLES, endpoint=False)
    harmonics = (contact.slip.size - 1) // 2
    spectrum = np.zeros(SAMPLES // 2 + 1, complex)
    spectrum[: harmonics + 1] = 0.5 * to_complex(contact.slip)
    spectrum[0] *= 2.0
    u = np.fft.irfft(spectrum, SAMPLES) * SAMPLES
    limit = law.mu * np.maximum(law.N0 + law.N1_value * np.cos(tau + law.N1_phase), 0.0)
    force = _follow(u, limit, law.kt, PERIODS)
    amplitudes = np.fft.rfft(force)[: harmonics + 1] * (2.0 / SAMPLES)
    amplitudes[0] *= 0.5
    return to_real(amplitudes)


def law_error(solution: Solution) -> float:
    """Largest difference of a contact's force from the sampled law, over the largest it may carry."""
    errors = [0.0]
    for i, contact in enumerate(solution.contacts):
        law = solution.scene.contacts[i]
        reach = min(law.mu * (law.N0 + abs(law.N1_value)), law.kt * float(np.abs(contact.slip).sum()))
        if reach > 0.0:
            errors.append(float(np.abs(contact.force - sampled_force(solution, i)).max()) / reach)
    return max(errors)


def motion_error(solution: Solution) -> float:
    """Largest difference of the slips from those of the structure under the contact forces, relative."""
    model = linear_model(solution.scene)
    slips = np.array([to_complex(contact.slip) for contact in solution.contacts])
    forces = np.array([to_complex(contact.force) for contact in solution.contacts])
    worst, scale = 0.0, 0.0
    for k in range(1, solution.highest_harmonic + 1):
        omega = 2.0 * math.pi * solution.frequency_hz * k
        K, C, L = matrices(model, k)
        Z = K - omega**2 * model.M + 1j * omega * C
        free = np.linalg.solve(Z, force_amplitudes(model, np.array([k], dtype=np.int64))[0])
        held = np.linalg.solve(Z, L.conj().T @ forces[:, k])
        scale = max(scale, np.abs(L @ free).max(), np.abs(L @ held).max(), np.abs(slips[:, k]).max())
        worst = max(worst, np.abs(L @ (free - held) - slips[:, k]).max())
    return float(worst / scale) if scale > 0.0 else float(worst)


def lost_power(solution: Solution) -> float:
    """Power that is unaccounted for, over what forces and motion could carry at most."""
    power, contacts = power_balance(solution), solution.contacts
    omega = 2.0 * math.pi * solution.frequency_hz
    if solution.highest_harmonic == 0:
        return 0.0
    carried = [float(np.abs(one.force[1:]).max() * np.abs(one.slip[1:]).max()) for one in contacts]
    pushed = sum(force.amplitude for force in solution.scene.excitation if force.harmonic > 0)
    apparent = omega * (pushed * float(np.abs(solution.observed[1:]).max()) + sum(carried))
    unaccounted = abs(power.input_w - power.viscous_w - power.friction_w)
    return unaccounted / max(apparent, abs(power.input_w)) if unaccounted > 0.0 else 0.0
