"""One response by pyHarm, run as a process of its own: the problem as JSON on stdin, the answer on stdout.

It imports nothing of this project, so that the interpreter pyHarm is installed for needs nothing else.
"""

from __future__ import annotations

import json
import logging
import math
import sys
import time

import numpy as np
from pyHarm.Maestro import Maestro

SAMPLES = 4096  # instants at which max|x| is read off a point


def problem(task: dict) -> dict:
    """Return pyHarm's input for masses in a chain with Jenkins elements to the ground."""
    connectors = {
        f"slider{dof}": {
            "type": "Jenkins", "connect": {"chain": [dof]}, "dirs": [0],
            "mu": task["mu"], "N0": task["N0"], "k": task["kt"],
        }
        for dof in task["sliders"]
    }  # fmt: skip
    for dof in task["forced"]:
        connectors[f"force{dof}"] = {
            "type": "CosinusForcing", "connect": {"chain": [dof]}, "dirs": [0], "amp": task["amplitude"],
        }  # fmt: skip
    low, high = (2.0 * math.pi * hertz for hertz in task["band"])
    return {
        "analysis": {
            "response": {
                "study": "frf", "puls_inf": low, "puls_sup": high, "puls_start": low, "verbose": False,
                "ds_min": 1e-8, "ds_max": task["step"], "ds0": min(task["step"], 0.1),
                "solver": "NewtonRaphson",
                "solver_options": {"tol_residual": 1e-8, "tol_delta_x": 1e-8, "max_iter": 15},
            }
        },
        "system": {"type": "Base", "nh": task["harmonics"], "nti": task["samples"]},
        "substructures": {
            "chain": {"matrix": {name: np.array(task[name]) for name in "MCK"}, "ndofs": 1},
        },
        "connectors": connectors,
    }  # fmt: skip


def largest(x: np.ndarray, dofs: int, observed: int, harmonics: int) -> float:
    """Return max|x| over a period; the coefficients are ordered harmonic by harmonic, cosine then sine."""
    blocks = x[:-1].reshape(2 * harmonics + 1, dofs)[:, observed]
    spectrum = np.zeros(SAMPLES // 2 + 1, complex)
    spectrum[0] = blocks[0]
    spectrum[1 : harmonics + 1] = 0.5 * (blocks[1::2] - 1j * blocks[2::2])
    return float(np.abs(np.fft.irfft(spectrum, SAMPLES) * SAMPLES).max())


def run(task: dict) -> dict:
    """Solve once and return seconds, points, failed points and the highest point."""
    begun, cpu = time.perf_counter(), time.process_time()
    maestro = Maestro(problem(task))
    maestro.operate()
    seconds, cpu = time.perf_counter() - begun, time.process_time() - cpu
    points = [point for point in maestro.nls["response"].SolList if point.flag_accepted]
    tried = len(maestro.nls["response"].SolList)
    dofs = len(task["M"])
    heights = [largest(point.x, dofs, task["observed"], task["harmonics"]) for point in points]
    best = int(np.argmax(heights))
    return {
        "seconds": seconds, "cpu_seconds": cpu, "points": len(points), "failed": tried - len(points),
        "peak": heights[best], "at_hz": float(points[best].x[-1]) / (2.0 * math.pi),
        "last_hz": float(points[-1].x[-1]) / (2.0 * math.pi),
    }  # fmt: skip


def optimum(task: dict) -> dict:
    """Choose the load of least peak by SciPy's bounded search over whole responses."""
    from scipy.optimize import minimize_scalar

    low, high = task["loads"]
    answers = []

    def height(load: float) -> float:
        answers.append(run({**task, "N0": load}))
        return answers[-1]["peak"]

    begun, cpu = time.perf_counter(), time.process_time()
    found = minimize_scalar(height, bounds=(low, high), method="bounded", options={"xatol": task["accuracy"]})
    return {
        "seconds": time.perf_counter() - begun, "cpu_seconds": time.process_time() - cpu,
        "points": sum(answer["points"] for answer in answers),
        "failed": sum(answer["failed"] for answer in answers), "peak": float(found.fun), "at": float(found.x),
        "responses": len(answers), "last_hz": min(answer["last_hz"] for answer in answers),
    }  # fmt: skip


def main() -> None:
    """Run the task once to warm up where it is short, then as often as asked; print the fastest."""
    logging.disable(logging.CRITICAL)
    task = json.load(sys.stdin)
    if "loads" in task:
        run(task)
        print(json.dumps(optimum(task)))
        return
    answers = [run(task) for _ in range(task["warm_up"] + task["runs"])][task["warm_up"] :]
    print(json.dumps(min(answers, key=lambda answer: answer["cpu_seconds"])))


if __name__ == "__main__":
    main()
