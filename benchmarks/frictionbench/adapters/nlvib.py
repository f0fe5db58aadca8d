"""NLvib (M. Krack, J. Gross) under Octave: amplitudes under sliders of constant load and gaps."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from protocol import NotOfferedError, measured, serve, single_response

NEEDS = ("numpy",)  # besides octave-cli
RUNGS = [
    {"harmonics": 7, "samples": 256},
    {"harmonics": 21, "samples": 1024},
    {"harmonics": 61, "samples": 4096},
]
SCRIPT = """
warning("off", "all");
given = argv();
addpath(fullfile(given{1}, "SRC"), fullfile(given{1}, "SRC", "MechanicalSystems"));
task = jsondecode(fileread("task.json"));
elements = cell(1, rows(task.b));
for i = 1:rows(task.b)
  made = struct("force_direction", task.b(i, :)', "stiffness", task.stiffness(i));
  if isnan(task.gap(i))
    made.type = "elasticDryFriction";
    made.friction_limit_force = task.limit(i);
    made.ishysteretic = true;
  else
    made.type = "unilateralSpring";
    made.gap = task.gap(i);
  end
  elements{i} = made;
end
made = MechanicalSystem(task.M, task.C, task.K, elements, complex(task.cosine, -task.sine));
residual = @(x) HB_residual([x; task.omega], made, task.harmonics, task.samples, "frf");
% Its Jacobian has a column of the frequency, which is given.
function [R, J] = square(residual, x)
  [R, J] = residual(x);
  J = J(:, 1:end-1);
end
solving = optimset("Display", "off", "Jacobian", "on", "MaxIter", 200, "TolFun", 1e-12, "TolX", 1e-14);
[x, R, found] = fsolve(@(x) square(residual, x), task.start, solving);
file = fopen("answer.json", "w");
fputs(file, jsonencode(struct("x", x, "rest", max(abs(R)), "found", found)));
fclose(file);
"""


def solve(case: dict[str, Any], rung: dict[str, Any]) -> dict[str, Any]:
    """Solve at the frequency, by Octave's fsolve, from the linear response with all contacts stuck."""
    m = single_response(case)
    if len(m.M) == 1 and any(row.law == "gap" and row.b[0] < 0.0 for row in m.rows):
        raise NotOfferedError("in a system of one coordinate its forces have no direction")
    H, n, omega = rung["harmonics"], len(m.M), 2.0 * math.pi * case["asked"]["frequency_hz"]
    force = np.zeros(n, complex)
    for dof, amplitude, phase, _ in m.loads:
        force[dof] += amplitude * np.exp(1j * phase)
    sliders = [row for row in m.rows if row.law != "gap"]
    stuck = m.K + sum((row.kt * np.outer(row.b, row.b) for row in sliders), np.zeros((n, n)))
    X = np.linalg.solve(stuck - omega**2 * m.M + 1j * omega * m.C, force)
    start = np.zeros((2 * H + 1) * n)
    start[n : 2 * n], start[2 * n : 3 * n] = X.real, -X.imag
    gaps = [row.gap if row.law == "gap" else math.nan for row in m.rows]
    task = {
        "M": m.M.tolist(), "C": m.C.tolist(), "K": m.K.tolist(), "omega": omega, "harmonics": H,
        "samples": rung["samples"], "cosine": force.real.tolist(), "sine": (-force.imag).tolist(),
        "b": [row.b.tolist() for row in m.rows], "stiffness": [row.kt for row in m.rows],
        "limit": [row.mu * row.N0 for row in m.rows], "start": start.tolist(),
        "gap": [None if math.isnan(gap) else gap for gap in gaps],
    }  # fmt: skip
    told = _octave(task)
    if not told["rest"] < 1e-3 * max(1.0, float(np.abs(force).max())):
        raise ArithmeticError(f"did not converge: residual {told['rest']:.1e} (fsolve says {told['found']})")
    blocks = np.atleast_1d(told["x"]).reshape(2 * H + 1, n)[:, m.seen]
    return {"value": measured(case, blocks)}


def _octave(task: dict[str, Any]) -> dict[str, Any]:
    octave, source = shutil.which("octave-cli"), sys.argv[sys.argv.index("--source") + 1]
    if octave is None:
        raise NotOfferedError("octave-cli is not installed")
    Path("task.json").write_text(json.dumps(task))
    Path("run.m").write_text(SCRIPT)
    command = [octave, "--norc", "--quiet", "run.m", source]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise ArithmeticError((done.stderr.strip().splitlines() or ["Octave failed"])[-1])
    return dict(json.loads(Path("answer.json").read_text()))


if __name__ == "__main__":
    serve(solve)
