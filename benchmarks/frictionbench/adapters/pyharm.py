"""pyHarm (pyharm-os): amplitudes under sliders of constant load, by its own study of one frequency."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from protocol import measured, serve, single_response

NEEDS = ("pyharm-os",)
RUNGS = [
    {"harmonics": 7, "samples": 256},
    {"harmonics": 21, "samples": 1024},
    {"harmonics": 61, "samples": 4096},
]
NEAR = 1e-6  # of the frequency: its response studies go over a range


def solve(case: dict[str, Any], rung: dict[str, Any]) -> dict[str, Any]:
    """Follow a very short response from the frequency; its first point is the answer."""
    from pyHarm.Maestro import Maestro

    m = single_response(case, gaps=False)
    omega, n, H = 2.0 * math.pi * case["asked"]["frequency_hz"], len(m.M), rung["harmonics"]
    connectors: dict[str, Any] = {}
    for i, row in enumerate(m.rows):
        ends = [int(j) for j in np.flatnonzero(row.b)]
        connect = {"whole": [ends[0]]} if len(ends) == 1 else {"whole": [ends[0]], "INTERNAL": [ends[1]]}
        connectors[f"slider{i}"] = {
            "type": "Jenkins", "connect": connect, "dirs": [0], "mu": row.mu, "N0": row.N0, "k": row.kt,
        }  # fmt: skip
    for i, (dof, amplitude, phase, _) in enumerate(m.loads):
        for kind, part in (("CosinusForcing", math.cos(phase)), ("SinusForcing", -math.sin(phase))):
            if abs(part) > 1e-15:
                connectors[f"{kind}{i}"] = {
                    "type": kind,
                    "connect": {"whole": [dof]},
                    "dirs": [0],
                    "amp": amplitude * part,
                }
    problem = {
        "analysis": {"one": {
            "study": "frf", "puls_inf": omega, "puls_sup": omega * (1 + NEAR), "puls_start": omega,
            "verbose": False,
            "ds_min": 1e-12, "ds_max": NEAR * omega, "ds0": NEAR * omega, "solver": "NewtonRaphson",
            "solver_options": {"tol_residual": 1e-10, "tol_delta_x": 1e-10, "max_iter": 60},
        }},
        "system": {"type": "Base", "nh": H, "nti": rung["samples"]},
        "substructures": {"whole": {"matrix": {"M": m.M, "C": m.C, "K": m.K}, "ndofs": 1}},
        "connectors": connectors,
    }  # fmt: skip
    maestro = Maestro(problem)
    maestro.operate()
    points = [one for one in maestro.nls["one"].SolList if one.flag_accepted]
    if not points:
        raise ArithmeticError("no point converged")
    return {"value": measured(case, points[0].x[:-1].reshape(2 * H + 1, n)[:, m.seen])}


if __name__ == "__main__":
    serve(solve)
