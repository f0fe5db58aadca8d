"""pyHarm (pyharm-os): amplitudes under sliders of constant load, by its own study of one frequency."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from protocol import case_model, serve

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

    what = case["asked"]["what"]
    if what not in ("amplitude", "half-peak-to-peak") or "which" in case["asked"]:
        raise NotImplementedError("the adapter asks it for one response alone")
    m = case_model(case)
    omega, n, H = 2.0 * math.pi * case["asked"]["frequency_hz"], len(m.M), rung["harmonics"]
    connectors: dict[str, Any] = {}
    for i, row in enumerate(m.rows):
        ends = [int(j) for j in np.flatnonzero(row.b)]
        connect = {"whole": [ends[0]]} if len(ends) == 1 else {"whole": [ends[0]], "INTERNAL": [ends[1]]}
        if row.law == "gap":
            raise NotImplementedError("the adapter knows no gap of it")
        if row.N1 or row.kn:
            raise NotImplementedError("its Jenkins element has no load that varies")
        if math.isinf(row.kt):
            raise NotImplementedError("it has no rigid friction")
        connectors[f"slider{i}"] = {
            "type": "Jenkins", "connect": connect, "dirs": [0], "mu": row.mu, "N0": row.N0, "k": row.kt,
        }  # fmt: skip
    for i, (dof, amplitude, phase, k) in enumerate(m.loads):
        if k != 1:
            raise NotImplementedError("the adapter knows forces of order 1 alone")
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
    blocks = points[0].x[:-1].reshape(2 * H + 1, n)[:, m.seen]
    spectrum = np.zeros(8193, complex)
    spectrum[0], spectrum[1 : H + 1] = blocks[0], 0.5 * (blocks[1::2] - 1j * blocks[2::2])
    moved = np.fft.irfft(spectrum, 16384) * 16384
    high, low = float(moved.max()), float(moved.min())
    return {"value": max(abs(high), abs(low)) if what == "amplitude" else 0.5 * (high - low)}


if __name__ == "__main__":
    # The script's folder holds a file of the package's name, on file systems that do not tell case apart.
    sys.path.pop(0)
    serve(solve)
