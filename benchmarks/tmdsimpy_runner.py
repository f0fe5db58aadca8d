"""A nonlinear mode or a response by tmdsimpy, a process of its own: JSON on stdin, the answer on stdout.

It imports nothing of this project, so that the interpreter tmdsimpy is installed for needs nothing else.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np
import tmdsimpy.utils.harmonic as harmonic
from tmdsimpy.continuation import Continuation
from tmdsimpy.nlforces.vector_jenkins import VectorJenkins
from tmdsimpy.solvers import NonlinearSolver
from tmdsimpy.vibration_system import VibrationSystem

INSTANTS = 1024  # of a period at which the largest displacement is looked for


def system(task: dict) -> VibrationSystem:
    """Return the structure with a Jenkins element from each slider's DOF to the ground."""
    M, C, K = (np.array(task[name]) for name in "MCK")
    made = VibrationSystem(M, K, C=C)
    for dof in task["sliders"]:
        selected = np.zeros((1, len(M)))
        selected[0, dof] = 1.0
        made.add_nl_force(VectorJenkins(selected, selected.T, task["kt"], task["limit"]))
    return made


def mode(task: dict) -> dict:
    """Follow the mode once; seconds, and ω, ζ and the amplitude of all harmonics at every point."""
    begun, cpu = time.perf_counter(), time.process_time()
    made, solver = system(task), NonlinearSolver()
    h = np.array(task["kept"])
    shape, first = np.array(task["shape"]), int(h[0] == 0)
    n = shape.size
    unknown = np.zeros(n * harmonic.Nhc(h))
    unknown[first * n : (first + 1) * n] = shape
    # The sines of harmonic 1 have no part of the linear mode: that fixes the phase.
    phase = np.zeros(unknown.size)
    phase[(first + 1) * n : (first + 2) * n] = made.M @ shape
    low, high = task["log10"]
    guess = np.hstack((unknown, task["omega"], 2.0 * task["omega"] * task["zeta"]))

    def residual(point: np.ndarray) -> tuple:
        return made.epmc_res(point, phase, h, Nt=task["samples"])

    start, *_ = solver.nsolve(lambda x: residual(np.hstack((x, low)))[:2], guess, verbose=False)
    start = np.hstack((start, low))
    config = {
        "DynamicCtoP": True, "MaxSteps": 4000, "verbose": -1, "dsmin": 1e-6, "dsmax": task["step"],
        "TargetFeval": 10,
    }  # fmt: skip
    scales = harmonic.harmonic_wise_conditioning(start, n, h, delta=1e-3)
    following = Continuation(solver, ds0=task["step"], CtoP=scales, config=config)
    points = following.continuation(residual, start, low, high)
    seconds, cpu = time.perf_counter() - begun, time.process_time() - cpu
    # Its amplitude is that of harmonic 1.
    moving = points[:, first * n : -3].reshape(len(points), -1, n)
    whole = np.sqrt(np.einsum("pki,ij,pkj->p", moving, made.M, moving))
    return {
        "seconds": seconds, "cpu_seconds": cpu, "amplitude": (10.0 ** points[:, -1] * whole).tolist(),
        "omega": points[:, -3].tolist(), "zeta": (0.5 * points[:, -2] / points[:, -3]).tolist(),
    }  # fmt: skip


def rubbing(task: dict) -> VibrationSystem:
    """Return the structure with a contact from each pair of DOFs to the ground; N0 is a negative gap."""
    # It needs JAX, which modes do without.
    from tmdsimpy.jax.nlforces.elastic_dry_fric_2d import ElasticDryFriction2D

    M, C, K = (np.array(task[name]) for name in "MCK")
    made = VibrationSystem(M, K, C=C)
    for one in task["contacts"]:
        selected = np.zeros((2, len(M)))
        selected[0, one["tangential"]] = selected[1, one["normal"]] = 1.0
        gap = -one["N0"] / one["kn"]
        made.add_nl_force(
            ElasticDryFriction2D(selected, selected.T, one["kt"], one["kn"], one["mu"], u0=0.0, meso_gap=gap)
        )
    return made


def response(task: dict) -> dict:
    """Follow the branch once; seconds, points, and the largest displacement of the observed DOF."""
    cpu = time.process_time()
    made, solver = rubbing(task), NonlinearSolver()
    h, n = np.arange(task["harmonics"] + 1), len(task["M"])
    force = np.zeros(n * harmonic.Nhc(h))
    force[n : 2 * n], force[2 * n : 3 * n] = task["cosine"], task["sine"]
    low, high = task["omega"]

    def residual(point: np.ndarray) -> tuple:
        return made.hbm_res(point, force, h, Nt=task["samples"])

    at_low = lambda x: residual(np.hstack((x, low)))[:2]  # noqa: E731
    start, _, slope, *_ = solver.nsolve(at_low, np.zeros_like(force), verbose=False)
    start = np.hstack((start, low))
    scales = harmonic.harmonic_wise_conditioning(start, n, h, delta=1e-3)
    scales[-1] = high
    config = {
        "DynamicCtoP": True, "MaxSteps": 4000, "verbose": -1, "dsmin": 1e-6, "dsmax": task["step"],
        "TargetFeval": 10, "corrector": "Ortho",
    }  # fmt: skip
    of_rows = 1.0 / np.abs(np.diag(slope * scales[:-1])).max()
    following = Continuation(solver, ds0=task["step"], CtoP=scales, RPtoC=of_rows, config=config)
    points = following.continuation(residual, start, low, high)
    cpu = time.process_time() - cpu
    moved = harmonic.time_series_deriv(INSTANTS, h, points[:, task["observed"] : -1 : n].T, 0)
    return {"cpu_seconds": cpu, "points": len(points), "peak": float(np.abs(moved).max())}


def main() -> None:
    """Run the task once to warm up, then as often as asked; print the fastest."""
    task = json.load(sys.stdin)
    run = {"mode": mode, "response": response}[task["what"]]
    answers = [run(task) for _ in range(1 + task["runs"])][1:]
    print(json.dumps(min(answers, key=lambda answer: answer["cpu_seconds"])))


if __name__ == "__main__":
    main()
