"""NLvib (M. Krack, J. Gross) in Octave: amplitudes of masses with sliders of constant load and stops."""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from protocol import case_model, serve

NEEDS = ("numpy", "scipy")
PROGRAM = "octave"
RUNGS = [
    {"harmonics": 7, "samples": 256},
    {"harmonics": 21, "samples": 1024},
    {"harmonics": 61, "samples": 4096},
]
SOURCE = Path(sys.argv[sys.argv.index("--source") + 1]) if "--source" in sys.argv else Path("NLvib")


def solve(case: dict[str, Any], rung: dict[str, Any]) -> dict[str, Any]:
    """Write the problem for Octave and read the motion back; the time is that of the whole program."""
    from scipy.io import loadmat, savemat

    what = case["asked"]["what"]
    if what not in ("amplitude", "half-peak-to-peak") or "which" in case["asked"]:
        raise NotImplementedError("the adapter asks it for one response alone")
    m = case_model(case)
    if any(row.N1 or row.kn or math.isinf(row.kt) for row in m.rows) or any(k != 1 for *_, k in m.loads):
        raise NotImplementedError(
            "its elastic dry friction element has a constant limit; forces are of order 1"
        )
    force = np.zeros(len(m.M), complex)
    for dof, amplitude, phase, _ in m.loads:
        force[dof] += amplitude * np.exp(1j * phase)
    rows = {
        "kinds": [float(row.law == "gap") for row in m.rows],
        "directions": np.array([row.b for row in m.rows]).T,
        "stiffness": [row.kt for row in m.rows],
        "limits": [row.gap if row.law == "gap" else row.mu * row.N0 for row in m.rows],
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        told = {
            "M": m.M,
            "D": m.C,
            "K": m.K,
            "force": force,
            "omega": 2.0 * math.pi * case["asked"]["frequency_hz"],
            **rows,
        }
        savemat(Path(folder) / "in.mat", told | {"H": float(rung["harmonics"]), "N": float(rung["samples"])})
        program = str(Path(__file__).with_name("nlvib_case.m"))
        done = subprocess.run(
            [shutil.which(PROGRAM) or PROGRAM, "--quiet", "--eval", f"source('{program}')"], cwd=folder,
            capture_output=True, text=True, check=False,
            env={"NLVIB": str(SOURCE), "PATH": "/usr/bin:/bin:/usr/local/bin", "HOME": folder},
        )  # fmt: skip
        if done.returncode != 0:
            raise ArithmeticError((done.stderr.strip().splitlines() or ["Octave ended"])[-1])
        Q = loadmat(Path(folder) / "out.mat")["Q"].ravel()
    blocks, H = Q.reshape(-1, len(m.M))[:, m.seen], rung["harmonics"]
    spectrum = np.zeros(8193, complex)
    spectrum[0], spectrum[1 : H + 1] = blocks[0], 0.5 * (blocks[1::2] - 1j * blocks[2::2])
    moved = np.fft.irfft(spectrum, 16384) * 16384
    high, low = float(moved.max()), float(moved.min())
    return {"value": max(abs(high), abs(low)) if what == "amplitude" else 0.5 * (high - low)}


if __name__ == "__main__":
    serve(solve)
