"""The march of scenes with rigid contacts, by Moreau's time stepping (`kernels.moreau_steps`)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from solver.errors import SettingError
from solver.marching.march_equations import as_sparse
from solver.marching.march_equations import MarchEquations
from stickslip.lab.proofs.kernels import moreau_steps as stepping
from solver.marching.kernels import march_state as kernel
from solver.marching.march_result import MarchStatus

FloatArray = NDArray[np.float64]
ORDER = 2  # of the steps; where a load is a mean over the step, 1
STEPS = 1024  # a period, of the finer run
REPEATS = 1e-9  # relative change over a period: where a step is halved is a jump of this size
_LAWS = {kernel.COULOMB: stepping.ELASTIC, kernel.ELASTIC_NORMAL: stepping.ELASTIC, kernel.GAP: stepping.GAP}
_STATUS = {stepping.OPENED: MarchStatus.RIGID_OPENS, stepping.UNSOLVED: MarchStatus.CHATTER}


def stepped(equations: MarchEquations, steps: int) -> stepping.Stepped:
    """Return the equations for steps of 2π / steps and their halves.

    Raises
    ------
    SettingError
        A contact of another law than coulomb, elastic-normal or gap.
    """
    system = equations.system
    n = system.A.start.size - 1
    A, B, W, along, across = (
        as_sparse(rows, n).toarray() for rows in (system.A, system.B, system.W, system.L, system.normal)
    )
    rows: list[FloatArray] = []
    numbers: list[tuple[int, float, float, float, float, int, FloatArray]] = []
    for c, law in enumerate(system.law):
        if int(law) not in _LAWS:
            raise SettingError(
                "scene", "a contact", "must be coulomb, elastic-normal or gap beside rigid ones"
            )
        load, normal = _load(system, c), -1
        if law == kernel.ELASTIC_NORMAL:
            normal, kn = len(rows), float(system.kn[c])
            what = stepping.HELD if np.isinf(kn) else stepping.PRESSED
            rows.append(across[c])
            numbers.append((what, kn, 0.0, 0.0, float(system.rest[c]), -1, load))
        rows.append(along[c])
        kt = float(system.kt[c])
        what = stepping.RIGID if np.isinf(kt) else _LAWS[int(law)]
        numbers.append((what, kt, float(system.mu[c]), float(system.gap[c]), 0.0, normal, load))
    laws, k, mu, gap, rest, normals, loads = (np.array(each) for each in zip(*numbers, strict=True))
    L = np.array(rows)
    halves = [2.0 * np.pi / steps / 2**level for level in range(stepping.LEVELS)]
    inverses = np.array([np.linalg.inv(np.eye(n) + 0.5 * h * B + 0.25 * h * h * A) for h in halves])
    pulls = np.array([h * each @ W @ L.T for h, each in zip(halves, inverses, strict=True)])
    top = int(np.max(system.force_harmonic, initial=0))
    waves = np.zeros((2, top + 1, n))
    for dof, size, phase, k_force in zip(
        system.force_dof, system.force_amplitude, system.force_phase, system.force_harmonic, strict=True
    ):
        waves[0, k_force] += size * np.cos(phase) * W[:, dof]
        waves[1, k_force] -= size * np.sin(phase) * W[:, dof]
    return stepping.Stepped(
        A=A, B=B, inverses=inverses, cosines=waves[0], sines=waves[1], rows=L, pulls=pulls,
        D=np.array([L @ each for each in pulls]), law=laws.astype(np.int64), k=k, mu=mu, gap=gap, rest=rest,
        normal=normals.astype(np.int64), load=loads,
    )  # fmt: skip


def run(
    equations: MarchEquations, x: FloatArray, v: FloatArray, steps: int, tolerance: float, max_periods: int,
    should_stop: Callable[[], bool] | None, on_period: Callable[[float], None] | None,
) -> tuple[FloatArray, FloatArray, kernel.Record, MarchStatus, FloatArray]:  # fmt: skip
    """March until the motion repeats; return x, v, the record of one more period, status and the changes."""
    it = stepped(equations, steps)
    m, n = it.law.size, x.size
    kept = np.eye(n)[equations.observed]
    force, doing = np.zeros(m), np.zeros(m, np.int64)
    changes: list[float] = []
    elastic = it.law == stepping.ELASTIC
    nothing, status = np.empty((2, 0)), MarchStatus.MAX_PERIODS
    while len(changes) < max_periods:
        before = np.concatenate([x, v]), force[elastic]
        code = stepping.run_period(it, steps, x, v, force, doing, nothing, kept)
        after = np.concatenate([x, v])
        largest = float(np.abs(after).max())
        change = float(np.abs(after - before[0]).max()) / largest if largest > 0.0 else 0.0
        pulled = float(np.abs(force[elastic]).max(initial=0.0))
        if pulled > 0.0:
            change = max(change, float(np.abs(force[elastic] - before[1]).max()) / pulled)
        changes.append(change)
        if code != stepping.RAN or not np.isfinite(largest):
            status = _STATUS.get(code, MarchStatus.NOT_FINITE)
            break
        if change < max(tolerance, REPEATS):
            status = MarchStatus.CONVERGED
            break
        if on_period is not None:
            on_period(change)
        if should_stop is not None and should_stop():
            status = MarchStatus.STOPPED
            break
    record = np.full((2 + 3 * m, steps), np.nan)
    if status in (MarchStatus.CONVERGED, MarchStatus.MAX_PERIODS, MarchStatus.STOPPED):
        stepping.run_period(it, steps, x, v, force, doing, record, kept)
    friction = np.flatnonzero(~np.isin(it.law, (stepping.PRESSED, stepping.HELD)))
    samples = kernel.Record(
        record[0], record[1], record[2 + friction], record[2 + m + friction], record[2 + 2 * m + friction]
    )
    return x, v, samples, status, np.array(changes)


def _load(system: kernel.System, c: int) -> FloatArray:
    """Return the Fourier coefficients of a given load."""
    found = np.zeros(2 * system.waves.shape[1] + 1)
    found[0] = system.N0[c]
    found[1::2] = system.waves[c] * np.cos(system.wave_phases[c])
    found[2::2] = -system.waves[c] * np.sin(system.wave_phases[c])
    return found
