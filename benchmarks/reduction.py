"""A hundred thousand rows reduced onto nine DOFs, in a process of its own, with what it takes in memory."""

from __future__ import annotations

import json
import math
import resource
import subprocess
import sys
import time
from typing import Any

import numpy as np

from benchmarks.harness import check, expect, table

NODES = (165, 49, 4)  # of a brick clamped at one end, three DOFs a node
LENGTHS = (0.1, 0.03, 0.004)  # m
COUPLING = np.array([[1.0, 0.2, 0.1], [0.2, 1.5, 0.3], [0.1, 0.3, 3.0]])
SPEED = 3000.0  # m/s
DOFS, MODES = 9, 40
MIB = 1024.0  # ru_maxrss is in KiB


def reduction() -> None:
    """Matrices of 96 432 rows, filled as those of solid bricks are, onto 9 DOFs and 40 modes."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.reduction"], capture_output=True, text=True, check=False
    )
    expect(f"the process ended with {done.returncode}: {done.stderr[-500:]}", done.returncode == 0)
    answer = json.loads(done.stdout)
    expect(f"static residual {answer['static_residual']:.1e}", answer["static_residual"] < 1e-9)
    found, known = np.array(answer["found"]), np.array(answer["known"])
    good = found <= answer["good_to_hz"]
    worst = float(np.abs(found[good] / known[good] - 1.0).max())
    expect(f"a frequency called good is off by {worst:.1e}", worst <= 1e-3)
    row = (
        str(answer["rows"]), str(answer["entries"]),
        f"{answer['cpu_seconds']:.1f}", f"{answer['seconds']:.1f}",
        f"{answer['mib'] / MIB:.2f}", f"{answer['good_to_hz']:.0f} Hz", f"{worst:.1e}",
        check("first frequency", found[0], known[0], 1e-4),
    )  # fmt: skip
    header = ("rows", "entries", "s (process)", "s (wall)", "GiB", "good to", "off by there", "first, Hz")
    table(f"Reduction onto {DOFS} DOFs and {MODES} modes, one thread", header, [row])


def _line(nodes: int, length: float) -> tuple[Any, Any]:
    """Mass and stiffness of linear elements along a line."""
    from scipy.sparse import diags_array

    h = length / (nodes - 1)
    ends = np.r_[0.5, np.ones(nodes - 2), 0.5]
    side = np.ones(nodes - 1)
    mass = diags_array([h / 6 * side, 2 * h / 3 * ends, h / 6 * side], offsets=[-1, 0, 1])
    return mass, diags_array([-side / h, 2 / h * ends, -side / h], offsets=[-1, 0, 1])


def brick() -> tuple[Any, Any, np.ndarray]:
    """M and K of a brick whose exact discrete frequencies [Hz] are products of those along its edges."""
    from scipy.linalg import eigh
    from scipy.sparse import coo_array, csr_array, kron

    lines = [_line(n, length) for n, length in zip(NODES, LENGTHS, strict=True)]
    lines[0] = tuple(csr_array(matrix)[1:, 1:] for matrix in lines[0])  # clamped
    (mx, kx), (my, ky), (mz, kz) = lines
    mass = kron(kron(mx, my), mz)
    stiffness = kron(kron(kx, my), mz) + kron(kron(mx, ky), mz) + kron(kron(mx, my), kz)
    edges = [eigh(k.toarray(), m.toarray(), eigvals_only=True) for m, k in lines]
    sums = np.add.outer(np.add.outer(edges[0], edges[1]), edges[2])
    omega2 = SPEED**2 * np.multiply.outer(np.linalg.eigvalsh(COUPLING), sums).ravel()
    exact = np.sqrt(np.sort(omega2)) / (2.0 * math.pi)
    return coo_array(kron(mass, np.eye(3))), coo_array(SPEED**2 * kron(stiffness, COUPLING)), exact


def _child() -> None:
    """Reduce, and print what it took."""
    from solver.matrices.craig_bampton import craig_bampton
    from solver.matrices.values import DofTable

    M, K, exact = brick()
    rows = np.linspace(10, M.shape[0] - 5, DOFS).astype(int)
    begun, cpu = time.perf_counter(), time.process_time()
    found = craig_bampton(M, K, None, DofTable({f"d{i}": int(row) for i, row in enumerate(rows)}), MODES)
    seconds, cpu = time.perf_counter() - begun, time.process_time() - cpu
    quality = found.quality
    print(
        json.dumps(
            {
                "rows": M.shape[0], "entries": K.nnz, "seconds": seconds, "cpu_seconds": cpu,
                "mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MIB,
                "good_to_hz": quality.good_to_hz, "static_residual": quality.static_residual,
                "found": quality.system_hz.tolist(), "known": exact[: quality.system_hz.size].tolist(),
            }
        )
    )  # fmt: skip


if __name__ == "__main__":
    _child()
