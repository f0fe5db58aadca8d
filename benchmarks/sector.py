"""A sector of a hundred thousand rows reduced at three nodal diameters, in a process of its own."""

from __future__ import annotations

import json
import math
import resource
import subprocess
import sys
import time
from typing import Any

import numpy as np

from benchmarks.harness import expect, table

SECTORS = 24
NODES = (120, 70, 4)  # along the radius, around, through the thickness
RADII, THICKNESS = (0.2, 0.4), 0.012  # m
DIAMETERS, DOFS, MODES = (0, 3, 8), 9, 20
MIB = 1024.0  # ru_maxrss is in KiB


def sector() -> None:
    """A sector of 99 960 rows of bricks, held inside, onto 9 DOFs and 20 modes at 3 nodal diameters."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.sector"], capture_output=True, text=True, check=False
    )
    expect(f"the process ended with {done.returncode}: {done.stderr[-500:]}", done.returncode == 0)
    answer = json.loads(done.stdout)
    expect(f"static residual {answer['static_residual']:.1e}", answer["static_residual"] < 1e-9)
    expect(f"a frequency is off by {answer['off']:.1e}", answer["off"] < 1e-3)
    row = (
        str(answer["rows"]), str(answer["entries"]), ", ".join(map(str, DIAMETERS)),
        ", ".join(f"{seconds:.1f}" for seconds in answer["each"]),
        f"{answer['cpu_seconds']:.1f}", f"{answer['seconds']:.1f}", f"{answer['mib'] / MIB:.2f}",
        f"{answer['good_to_hz']:.0f} Hz", f"{answer['off']:.1e}",
    )  # fmt: skip
    header = ("rows", "entries", "diameters", "s each", "s (process)", "s (wall)", "GiB", "good to", "off")
    table(f"A sector onto {DOFS} DOFs and {MODES} modes at each nodal diameter, one thread", header, [row])


def bricks() -> tuple[Any, Any, list[tuple[int, ...]], list[tuple[int, ...]]]:
    """M and K of the sector (scikit-fem), and the rows of its low and high boundary."""
    import skfem
    from scipy.sparse import csr_array
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    pitch = 2.0 * math.pi / SECTORS
    grid = skfem.MeshHex.init_tensor(
        np.linspace(*RADII, NODES[0]),
        np.linspace(0.0, pitch, NODES[1]),
        np.linspace(0.0, THICKNESS, NODES[2]),
    )
    r, angle, z = grid.p
    mesh = skfem.MeshHex(np.array([r * np.cos(angle), r * np.sin(angle), z]), grid.t)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=3)
    K = csr_array(linear_elasticity(*lame_parameters(2.1e11, 0.3)).assemble(basis))
    M = csr_array(skfem.BilinearForm(lambda u, v, _: 7850.0 * skfem.helpers.dot(u, v)).assemble(basis))
    free = r > RADII[0] + 1e-9
    order = basis.nodal_dofs[:, free].T.reshape(-1)
    place = np.full(r.size, -1)
    place[free] = np.arange(np.count_nonzero(free))

    def side(at: float) -> list[tuple[int, ...]]:
        nodes = np.flatnonzero(free & (np.abs(angle - at) < 1e-9))
        nodes = nodes[np.lexsort((z[nodes], np.round(r[nodes], 9)))]
        return [(3 * i, 3 * i + 1, 3 * i + 2) for i in place[nodes].tolist()]

    return M[order][:, order], K[order][:, order], side(0.0), side(pitch)


def _true(K: Any, M: Any, near: float) -> float:
    """The frequency [Hz] of the full sector nearest to one of the reduced, by inverse iteration."""
    from scipy.sparse import csc_array

    from solver.matrices.craig_bampton import factor

    shift = (2.0 * math.pi * near * 0.999) ** 2
    solve = factor(csc_array(K - shift * M))
    shape = np.linspace(1.0, 2.0, K.shape[0]).astype(K.dtype)
    for _ in range(4):
        shape = solve(M @ shape)
        shape /= np.abs(shape).max()
    square = np.vdot(shape, K @ shape).real / np.vdot(shape, M @ shape).real
    return math.sqrt(square) / (2.0 * math.pi)


def _child() -> None:
    """Reduce, and print what it took."""
    from solver.matrices.sectors.elimination import elimination
    from solver.matrices.sectors.sector_reduction import reduce_sector

    M, K, low, high = bricks()
    rows = {
        f"d{i}": int(row)
        for i, row in enumerate(np.linspace(40, M.shape[0] // 2, DOFS).astype(int) // 30 * 30)
    }
    outside = {row for group in high for row in group}
    rows = {name: row if row not in outside else row + 3 for name, row in rows.items()}
    begun, cpu = time.perf_counter(), time.process_time()
    gone = elimination(M.shape[0], low, high, (0.0, 0.0, 1.0), SECTORS)
    found = reduce_sector({"M": M, "K": K}, gone, rows, MODES, DIAMETERS, SECTORS)
    seconds, cpu = time.perf_counter() - begun, time.process_time() - cpu
    mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MIB
    first = float(found.quality[1].system_hz[0])
    true = _true(gone.of(K).at(DIAMETERS[1], SECTORS), gone.of(M).at(DIAMETERS[1], SECTORS), first)
    print(
        json.dumps(
            {
                "rows": M.shape[0], "entries": K.nnz, "seconds": seconds, "cpu_seconds": cpu, "mib": mib,
                "each": list(found.seconds), "good_to_hz": found.good_to_hz,
                "static_residual": max(quality.static_residual for quality in found.quality),
                "off": abs(first / true - 1.0),
            }
        )
    )  # fmt: skip


if __name__ == "__main__":
    _child()
