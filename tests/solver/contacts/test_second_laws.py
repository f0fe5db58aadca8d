"""Second derivatives of every law that has them, against central differences of its own gradient."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
import pytest
from each import each
from law_cases import (
    COULOMB_BOX,
    COULOMB_CIRCLE,
    COULOMB_LINE,
    ELASTIC_NORMAL,
    GAP_SPRING,
    POLYNOMIAL,
)
from space_elements import random_elements

from solver.contacts.kernels.columns import A_1, COLUMNS, GAP, K_GAP, KN, KT, KT_SECOND, MU
from solver.contacts.kernels.laws import law_force, law_number, law_second, second_number
from solver.contacts.kernels.stick_slip_events import FAILED, new_segments
from solver.jit import fourier
from solver.jit.trig_polynomial import grid_size, grid_tables

LOAD_KS = fourier.all_harmonics(1)


@dataclass(frozen=True, kw_only=True)
class Law:
    """A law's kernels, its ports among those of a random contact in space, and the columns it knows."""

    force: str
    second: str
    ports: tuple[int, ...]
    columns: tuple[int, ...]
    tied: bool = False


_RUBBING = "solver.contacts.kernels.coulomb.second_law:"
_SPACE = (KT, KT_SECOND, MU, KN)
LAWS = {
    "coulomb": Law(force=COULOMB_LINE, second=_RUBBING + "line_second", ports=(0,), columns=(KT, MU)),
    "coulomb-2d, box": Law(
        force=COULOMB_BOX, second=_RUBBING + "box_second", ports=(0, 1), columns=(KT, MU), tied=True
    ),
    "elastic-normal": Law(
        force=ELASTIC_NORMAL, second=_RUBBING + "line_second", ports=(0, 2), columns=(KT, MU, KN)
    ),
    "coulomb-3d, box": Law(
        force=COULOMB_BOX, second=_RUBBING + "box_second", ports=(0, 1, 2), columns=_SPACE
    ),
    "coulomb-3d, box, one stiffness": Law(
        force=COULOMB_BOX, second=_RUBBING + "box_second", ports=(0, 1, 2), columns=(KT, MU, KN),
        tied=True,
    ),
    "coulomb-3d, box, given load": Law(
        force=COULOMB_BOX, second=_RUBBING + "box_second", ports=(0, 1), columns=(KT, KT_SECOND, MU)
    ),
    "coulomb-3d": Law(
        force=COULOMB_CIRCLE, second="solver.contacts.kernels.circle.circle_hessian:circle_law_second",
        ports=(0, 1, 2), columns=_SPACE,
    ),
    "coulomb-3d, one stiffness": Law(
        force=COULOMB_CIRCLE, second="solver.contacts.kernels.circle.circle_hessian:circle_law_second",
        ports=(0, 1, 2), columns=(KT, MU, KN), tied=True,
    ),
    "gap": Law(
        force=GAP_SPRING, second="solver.contacts.kernels.springs:gap_second", ports=(0,),
        columns=(K_GAP, GAP),
    ),
    "polynomial": Law(
        force=POLYNOMIAL, second="solver.contacts.kernels.springs:polynomial_second",
        ports=(0,), columns=tuple(range(A_1, A_1 + 5)),
    ),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Point:
    """Motions (m, n), a row of the contact table, coefficients of the given load."""

    U: np.ndarray
    row: np.ndarray
    load: np.ndarray

    def moved(self, x: float, way: Point) -> Point:
        return replace(self, U=self.U + x * way.U, row=self.row + x * way.row, load=self.load + x * way.load)

    @property
    def top(self) -> int:
        return (self.U.shape[1] - 1) // 2


def gradient(law: Law, at: Point, w: np.ndarray) -> tuple[np.ndarray, tuple[int, int]]:
    """Gradient of w·F by motions, columns and load, by the law's own kernel; state and piece."""
    (m, n), tables = at.U.shape, grid_tables(grid_size(at.top), at.top)
    segments = new_segments(at.top)
    F, dF_dU, dF_dp = np.empty((m, n)), np.empty((m * m, n, n)), np.empty((m, n))
    parts, here = [], (0, 0)
    ways = [(np.eye(COLUMNS)[c], np.zeros(3)) for c in law.columns]
    ways += [(np.zeros(COLUMNS), np.eye(3)[j]) for j in range(3)]
    for slope, dload in ways:
        here = law_force(
            law_number(law.force), at.U, fourier.all_harmonics(at.top), at.load, LOAD_KS, at.row, slope,
            dload, *tables, segments, F, dF_dU, dF_dp,
        )  # fmt: skip
        assert here[0] != FAILED
        parts.append(np.sum(w * dF_dp))
    by_U = np.einsum("ai,abij->bj", w, dF_dU.reshape(m, m, n, n))
    return np.concatenate([by_U.ravel(), parts]), (int(here[0]), int(here[1]))


def second(law: Law, at: Point, w: np.ndarray, way: Point) -> np.ndarray:
    """Derivative of `gradient` along a way, by the kernel of second derivatives."""
    out_U, out_row, out_load = np.empty_like(at.U), np.empty(COLUMNS), np.empty(3)
    state = law_second(
        second_number(law.second), at.U, fourier.all_harmonics(at.top), at.load, LOAD_KS, at.row,
        *grid_tables(grid_size(at.top), at.top), w, way.U, way.row, way.load, out_U, out_row, out_load,
    )  # fmt: skip
    assert state != FAILED
    return np.concatenate([out_U.ravel(), out_row[list(law.columns)], out_load])


def random_points(name: str, count: int) -> list[Point]:
    """Points of a law, from contacts that stick, slip and open."""
    law, found = LAWS[name], []
    rng = np.random.default_rng(31)
    for element in random_elements(8, count):
        U, row = element.U[list(law.ports)].copy(), element.row.copy()
        if name == "gap":
            row[:] = 0.0
            row[K_GAP], row[GAP] = 10.0 ** rng.uniform(-1.0, 1.0), rng.normal() * np.abs(U).max()
        elif name == "polynomial":
            row[:] = 0.0
            row[A_1 : A_1 + 5] = rng.normal(size=5) * np.abs(U).max() ** -np.arange(5.0)
        if law.tied:
            row[KT_SECOND] = math.nan
        found.append(Point(U=U, row=row, load=element.load))
    return found


def random_way(rng: np.random.Generator, law: Law, at: Point) -> Point:
    row = np.zeros(COLUMNS)
    row[list(law.columns)] = rng.normal(size=len(law.columns)) * at.row[list(law.columns)]
    size = np.abs(at.U).max(axis=1, keepdims=True)
    return Point(
        U=size * rng.normal(size=at.U.shape), row=row, load=rng.normal(size=3) * np.abs(at.load).max()
    )


def error_of(law: Law, at: Point, w: np.ndarray, way: Point) -> float:
    """Largest error in the sizes of the numbers, at the best step that stays on the smooth piece."""
    exact, (_, here) = second(law, at, w, way), gradient(law, at, w)
    assert np.isfinite(exact).all()
    sizes = np.concatenate([
        np.broadcast_to(np.abs(at.U).max(axis=1, keepdims=True), at.U.shape).ravel(),
        np.abs(at.row[list(law.columns)]), np.full(3, np.abs(at.load).max()),
    ])  # fmt: skip
    best = math.inf
    for step in 10.0 ** -np.arange(2.0, 7.5, 0.5):
        ends = [gradient(law, at.moved(side * step, way), w) for side in (-1.0, 1.0)]
        if any(piece != here for _, piece in ends):
            continue
        difference = (ends[1][0] - ends[0][0]) / (2.0 * step)
        scale = np.abs(difference * sizes).max()
        error = np.abs((exact - difference) * sizes).max()
        best = min(best, error / scale if scale > 0.0 else error)
    return best


@pytest.mark.parametrize("count", [10, pytest.param(40, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", LAWS)
def test_second_derivatives_equal_differences_of_the_gradient(name: str, count: int) -> None:
    """To 1e-5 in every state, along the motions, the numbers and the load at once."""
    law, rng, seen, errors = LAWS[name], np.random.default_rng(4), Counter[int](), []
    for at in random_points(name, count):
        w = rng.normal(size=at.U.shape)
        errors.append(error_of(law, at, w, random_way(rng, law, at)))
        seen[gradient(law, at, w)[1][0]] += 1
    assert max(errors) < 1e-5, sorted(errors)[-5:]
    assert len(seen) >= (1 if name == "polynomial" else 2)


@each("name", LAWS)
def test_second_derivatives_of_laws_are_symmetric(name: str) -> None:
    """aᵀ ∂²(w·F) b = bᵀ ∂²(w·F) a over motions, numbers and load."""
    law, rng = LAWS[name], np.random.default_rng(6)
    for at in random_points(name, 12):
        w, one, other = rng.normal(size=at.U.shape), random_way(rng, law, at), random_way(rng, law, at)
        by_one, by_other = second(law, at, w, one), second(law, at, w, other)

        def flat(way: Point) -> np.ndarray:
            return np.concatenate([way.U.ravel(), way.row[list(law.columns)], way.load])

        size = np.abs(by_one * flat(other)).sum() + np.abs(by_other * flat(one)).sum()
        assert abs(by_one @ flat(other) - by_other @ flat(one)) <= 1e-8 * size
