"""tmdsimpy (TMD lab, Rice University): amplitudes under sliders of constant load and gaps."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from protocol import measured, serve, single_response

NEEDS = ("numpy", "scipy", "matplotlib", "pyyaml")
RUNGS = [
    {"harmonics": 7, "samples": 256},
    {"harmonics": 21, "samples": 1024},
    {"harmonics": 61, "samples": 4096},
]


def solve(case: dict[str, Any], rung: dict[str, Any]) -> dict[str, Any]:
    """Solve at the frequency from the linear response with all contacts stuck."""
    import tmdsimpy.utils.harmonic as harmonic
    from tmdsimpy.nlforces.unilateral_spring import UnilateralSpring
    from tmdsimpy.nlforces.vector_jenkins import VectorJenkins
    from tmdsimpy.solvers import NonlinearSolver
    from tmdsimpy.vibration_system import VibrationSystem

    m = single_response(case, highest=7)
    made, stuck = VibrationSystem(m.M, m.K, C=m.C), m.K.copy()
    for row in m.rows:
        Q = row.b[None, :]
        if row.law == "gap":
            made.add_nl_force(UnilateralSpring(Q, Q.T, k=np.array([row.kt]), delta=np.array([row.gap])))
            continue
        made.add_nl_force(VectorJenkins(Q, Q.T, row.kt, row.mu * row.N0))
        stuck += row.kt * Q.T @ Q
    H, n, omega = rung["harmonics"], len(m.M), 2.0 * math.pi * case["asked"]["frequency_hz"]
    h = np.arange(H + 1)
    force = np.zeros(n * harmonic.Nhc(h))
    for dof, amplitude, phase, k in m.loads:
        force[(2 * k - 1) * n + dof] += amplitude * math.cos(phase)
        force[2 * k * n + dof] -= amplitude * math.sin(phase)
    start = np.zeros_like(force)
    first = force[n : 2 * n] - 1j * force[2 * n : 3 * n]
    X = np.linalg.solve(stuck - omega**2 * m.M + 1j * omega * m.C, first)
    start[n : 2 * n], start[2 * n : 3 * n] = X.real, -X.imag
    solver = NonlinearSolver()
    residual = lambda U: made.hbm_res(np.hstack((U, omega)), force, h, Nt=rung["samples"])[:2]  # noqa: E731
    U, _, _, converged, *_ = _padded(solver.nsolve(residual, start, verbose=False))
    rest = float(np.abs(residual(U)[0]).max())
    if not rest < 1e-3 * max(1.0, float(np.abs(force).max())):
        raise ArithmeticError(f"did not converge: residual {rest:.1e} ({converged})")
    return {"value": measured(case, U[m.seen :: n])}


def _padded(found: Any) -> tuple[Any, ...]:
    return (*found, None, None, None, None)


if __name__ == "__main__":
    if "--source" in sys.argv:
        sys.path.insert(0, str(Path(sys.argv[sys.argv.index("--source") + 1])))
    serve(solve)
