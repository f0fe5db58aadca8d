"""How far off an answer is: the error by the harmonics left out."""

from __future__ import annotations

import math

import numpy as np

from solver import fourier
from solver.balance import build
from solver.fourier import Real
from solver.kernels.observe import MAX_ABS
from solver.workspace import Workspace

# Harmonics looked at beyond those kept, for a solution with H of them: H + max(H, 8).
_LEAST_BEYOND = 8


def truncation_error(workspace: Workspace, u: Real, omega: float) -> float:
    """Estimate the error of max|x| by the harmonics left out [m].

    The closed-form contact force of the solution has coefficients beyond H. Put into the balance with about
    twice the harmonics, they are its residual; one Newton step there is the first-order change of the
    solution, feedback on the kept harmonics included, and the change of max|x| is the estimate.

    Parameters
    ----------
    workspace : of a balance in the frequency.
    u : (n_unknowns,) a converged solution.
    omega : its frequency [rad/s].

    Returns
    -------
    The estimate [m]; NaN if the larger system is singular there.
    """
    balance = workspace.balance
    if balance.n_unknowns == 0:
        return 0.0
    top = balance.n_harmonics + max(balance.n_harmonics, _LEAST_BEYOND)
    larger = Workspace.of(build(balance.scene, harmonics=top))
    n_contacts = len(balance.scene.contacts)
    kept = u.reshape(n_contacts, balance.n_coefficients)
    padded = fourier.to_full(kept, balance.system.ks, top).reshape(-1)
    before = larger.measure(padded, omega)
    _, point = larger.evaluate(padded, omega)
    try:
        step = np.linalg.solve(point.jacobian, point.residual)
    except np.linalg.LinAlgError:
        return math.nan
    after = larger.measure(padded - step, omega)
    here = workspace.measure(u, omega)
    if before is None or after is None or here is None:
        return math.nan
    # Two contributions: what the new harmonics add directly to the motion, and the change they cause.
    direct = abs(before.values[MAX_ABS] - here.values[MAX_ABS])
    return float(max(abs(after.values[MAX_ABS] - here.values[MAX_ABS]), direct))
