"""How far a response is from the least it could cost: for each iteration one factorisation and the contacts.

The factorisation is LAPACK's dgetrf, of the number of unknowns and of those that are left when the contacts
that stick or are separated through the period are linear. The contacts are the compiled contact law at the
motions found. Everything else (predictor, receptance, assembly, step control, Python) is what is added.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numba
import numpy as np
from scipy.linalg import lapack

from solver import Branch
from solver.contacts.kernels.coulomb.line_force import contact_force
from solver.contacts.kernels.stick_slip_events import LIFTING, SLIPPING, new_segments
from solver.jit.fourier import Integer, Real

SAMPLES = 12  # points of a branch at which its contacts are timed
LEAST_SECONDS = 2e-3  # a measurement is repeated until it lasts as long
REPEATS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Distance:
    """The parts of the least cost of a point, and the distance to it.

    Attributes
    ----------
    unknowns : int
        Of the condensed balance.
    factorised : float
        Unknowns of contacts that are not linear through the period, mean over the branch.
    lu, lu_factorised, kernel : float
        Seconds of dgetrf of both sizes, and of the contact law on all contacts.
    iterations : float
        Newton iterations a point.
    to_unknowns, to_factorised : float
        Time of a point over iterations x (dgetrf + kernel), for both sizes.
    """

    unknowns: int
    factorised: float
    lu: float
    lu_factorised: float
    kernel: float
    iterations: float
    to_unknowns: float
    to_factorised: float

    def cells(self) -> tuple[str, ...]:
        """Return the columns named in `HEADER`."""
        return (
            f"{self.iterations:.2f}", f"{self.unknowns}", f"{1e6 * self.lu:.1f}", f"{self.factorised:.1f}",
            f"{1e6 * self.lu_factorised:.1f}", f"{1e6 * self.kernel:.1f}", f"{self.to_unknowns:.2f}",
            f"{self.to_factorised:.2f}",
        )  # fmt: skip


HEADER = (
    "iterations a point", "unknowns", "LU µs", "not linear", "LU µs", "contacts µs", "time / least",
    "time / least of not linear",
)  # fmt: skip


def _repeated(call: object, least: float = LEAST_SECONDS) -> float:
    """Return the least process time of one call, each measurement lasting at least `least` seconds."""
    number, best = 1, np.inf
    for _ in range(REPEATS):
        while True:
            begun = time.process_time()
            for _ in range(number):
                call()  # type: ignore[operator]
            taken = time.process_time() - begun
            if taken >= least:
                break
            number = max(2 * number, int(1.2 * number * least / max(taken, 1e-7)))
        best = min(best, taken / number)
    return best


def lu_seconds(n: int) -> float:
    """Return the seconds LAPACK takes to factorise an n x n matrix, the copy it destroys included."""
    if n == 0:
        return 0.0
    matrix = np.asfortranarray(np.random.default_rng(n).standard_normal((n, n)))
    return _repeated(lambda: lapack.dgetrf(matrix, overwrite_a=False))


@numba.njit
def _contacts(
    number: int, motions: Real, ks: Integer, loads: Real, load_ks: Integer, table: Real, cosines: Real,
    sines: Real, segments: Real, dF_dU: Real, by_number: Real, dF_dN: Real, F: Real,
) -> None:  # fmt: skip
    """Evaluate the contact law on every contact `number` times."""
    for _ in range(number):
        for c in range(motions.shape[0]):
            contact_force(
                motions[c], ks, loads[c], load_ks, table[c, 0], table[c, 1], cosines, sines, segments, dF_dU,
                by_number[0], by_number[1], dF_dN, F,
            )  # fmt: skip


def kernel_seconds(branch: Branch, point: int) -> float:
    """Return the seconds of the contact law, with its derivatives, on every contact of a point."""
    system, scene = branch.balance.system, branch.balance.scene
    loads = np.array(
        [(c.N0, c.N1_value * np.cos(c.N1_phase), -c.N1_value * np.sin(c.N1_phase)) for c in scene.contacts]
    )
    table = np.array([(contact.kt, contact.mu) for contact in scene.contacts])
    motions = np.ascontiguousarray(branch.coefficients[point])
    n = motions.shape[1]
    segments = new_segments(max(int(system.ks[-1]), 1))
    scratch = (segments, np.zeros((n, n)), np.zeros((2, n)), np.zeros((n, 3)), np.zeros(n))
    fixed = (motions, system.ks, loads, np.arange(2), table, system.cos_table, system.sin_table, *scratch)
    number = max(1, int(LEAST_SECONDS / (2e-6 * len(scene.contacts))))
    return _repeated(lambda: _contacts(number, *fixed)) / number


def distance(branch: Branch, seconds: float) -> Distance:
    """Return how far a branch that took `seconds` is from the least it could have cost."""
    balance = branch.balance
    points, n, unknowns = len(branch.values), balance.n_coefficients, balance.n_unknowns
    moving = n * np.isin(branch.states, (SLIPPING, LIFTING)).sum(axis=1)
    sizes, counts = np.unique(moving, return_counts=True)
    lu_factorised = sum(lu_seconds(int(s)) * int(c) for s, c in zip(sizes, counts, strict=True)) / points
    sample = np.unique(np.linspace(0, points - 1, SAMPLES).round().astype(int))
    kernel = float(np.mean([kernel_seconds(branch, int(i)) for i in sample]))
    iterations, lu = branch.newton_iterations / points, lu_seconds(unknowns)
    each = seconds / points / iterations
    return Distance(
        unknowns=unknowns, factorised=float(moving.mean()), lu=lu, lu_factorised=lu_factorised,
        kernel=kernel, iterations=iterations, to_unknowns=each / (lu + kernel),
        to_factorised=each / (lu_factorised + kernel),
    )  # fmt: skip
