"""Contacts in space for the tests of their kernels: a way to call them, random ones, and a plain balance."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solver.contacts.kernels.circle.circle_hessian import circle_law_second
from solver.contacts.kernels.circle.circle_law import coulomb_circle
from solver.contacts.kernels.columns import COLUMNS, KN, KT, KT_SECOND, MU, PRESTRESSED
from solver.contacts.kernels.coulomb.line_law import coulomb_box
from solver.contacts.kernels.stick_slip_events import new_segments
from solver.jit import fourier
from solver.jit.trig_polynomial import grid_size, grid_tables

LOAD_KS = fourier.all_harmonics(1)
NUMBERS = (KT, KT_SECOND, MU, KN)  # columns the force depends on
Random = np.random.Generator


@dataclass(frozen=True, kw_only=True)
class Element:
    """Motions (2 or 3, n), coefficients of a given load, and a row of the contact table."""

    U: np.ndarray
    load: np.ndarray
    row: np.ndarray
    box: bool = False

    @property
    def tables(self) -> tuple[np.ndarray, np.ndarray]:
        return grid_tables(grid_size(self.top), self.top)

    @property
    def top(self) -> int:
        return max((self.U.shape[1] - 1) // 2, 1)

    @property
    def ks(self) -> np.ndarray:
        return fourier.all_harmonics((self.U.shape[1] - 1) // 2)

    def moved(self, step: float, direction: Element) -> Element:
        return replace(
            self, U=self.U + step * direction.U, load=self.load + step * direction.load,
            row=self.row + step * direction.row,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Force:
    """What a kernel gives."""

    F: np.ndarray
    jacobian: np.ndarray  # (m n, m n)
    dF_dp: np.ndarray
    state: int
    piece: int
    segments: np.ndarray


def row_of(kt: float, second: float, mu: float, kn: float = 0.0, prestressed: float = 0.0) -> np.ndarray:
    row = np.zeros(COLUMNS)
    row[[KT, KT_SECOND, MU, KN, PRESTRESSED]] = kt, second, mu, kn, prestressed
    return row


def evaluate(element: Element, slope: np.ndarray | None = None, dload: np.ndarray | None = None) -> Force:
    """Call the kernel; `slope` and `dload` are the derivatives of row and load by λ."""
    m, n = element.U.shape
    F, dF_dU, dF_dp = np.full((m, n), np.nan), np.full((m * m, n, n), np.nan), np.full((m, n), np.nan)
    segments = new_segments(element.top)
    kernel: Callable[..., tuple[int, int]] = coulomb_box if element.box else coulomb_circle
    state, piece = kernel(
        element.U, element.ks, element.load, LOAD_KS, element.row,
        np.zeros(COLUMNS) if slope is None else slope, np.zeros(3) if dload is None else dload,
        *element.tables, segments, F, dF_dU, dF_dp,
    )  # fmt: skip
    jacobian = dF_dU.reshape(m, m, n, n).transpose(0, 2, 1, 3).reshape(m * n, m * n)
    return Force(F=F, jacobian=jacobian, dF_dp=dF_dp, state=int(state), piece=int(piece), segments=segments)


def gradient(element: Element, w: np.ndarray) -> tuple[np.ndarray, int]:
    """Gradient of w·F by motions, the columns of NUMBERS and the load; and the piece."""
    here = evaluate(element)
    parts = [w.ravel() @ here.jacobian]
    for column in NUMBERS:
        slope = np.zeros(COLUMNS)
        slope[column] = 1.0
        parts.append(np.array([np.sum(w * evaluate(element, slope=slope).dF_dp)]))
    for j in range(3):
        parts.append(np.array([np.sum(w * evaluate(element, dload=np.eye(3)[j]).dF_dp)]))
    return np.concatenate(parts), here.piece


def second(element: Element, w: np.ndarray, direction: Element) -> np.ndarray:
    """Derivative of `gradient` along a direction, by the kernel."""
    by_U, by_row, by_load = np.empty(element.U.shape), np.empty(COLUMNS), np.empty(3)
    circle_law_second(
        element.U, element.ks, element.load, LOAD_KS, element.row, *element.tables, w, direction.U,
        direction.row, direction.load, by_U, by_row, by_load,
    )  # fmt: skip
    return np.concatenate([by_U.ravel(), by_row[list(NUMBERS)], by_load])


def random_direction(rng: Random, element: Element) -> Element:
    row = np.zeros(COLUMNS)
    row[list(NUMBERS)] = rng.normal(size=len(NUMBERS)) * element.row[list(NUMBERS)]
    size = np.abs(element.U).max(axis=1, keepdims=True)
    return replace(
        element, U=size * rng.normal(size=element.U.shape), row=row,
        load=rng.normal(size=3) * np.abs(element.load).max(),
    )  # fmt: skip


def random_elements(seed: int, count: int, top: int = 11) -> Iterator[Element]:
    """Motions of all three ports with means, loads that may open the contact, one stiffness or two."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        H = int(rng.integers(1, top + 1))
        decay = np.repeat(np.arange(1, H + 1.0) ** -rng.uniform(1.0, 3.0), 2)
        U = np.concatenate([rng.normal(size=(3, 1)), rng.normal(size=(3, 2 * H)) * decay], axis=1)
        size = 10.0 ** rng.uniform(-0.3, 1.3)
        U *= np.array([[size], [size * 10.0 ** rng.uniform(-1.0, 0.3)], [0.3]])
        load = np.array([1.0 + rng.uniform(), *(rng.uniform() * rng.normal(size=2))])
        kt = 10.0 ** rng.uniform(-1.0, 1.0)
        both = kt if rng.uniform() < 0.5 else kt * 10.0 ** rng.uniform(-0.7, 0.7)
        row = row_of(kt, both, rng.uniform(0.1, 1.0), 10.0 ** rng.uniform(-1.0, 0.5))
        yield Element(U=U, load=load, row=row)


def largest_pull(element: Element) -> float:
    """Largest elastic force of the unloaded slider."""
    basis = fourier.basis(np.linspace(0.0, 2.0 * math.pi, 4001), (element.U.shape[1] - 1) // 2)
    x, y = element.row[KT] * basis @ element.U[0], element.row[KT_SECOND] * basis @ element.U[1]
    return float(np.hypot(x, y).max())


def extreme_elements(seed: int, count: int) -> Iterator[tuple[str, Element]]:
    """Elements at the edges of the law, each with a word for what is extreme about it."""
    rng = np.random.default_rng(seed)
    for i, element in enumerate(random_elements(seed, count)):
        U, load, row = element.U.copy(), element.load.copy(), element.row.copy()
        kind = ("stiff", "line", "touch", "open", "barely", "soft", "eight")[i % 7]
        if kind == "stiff":
            row[[KT, KT_SECOND]] *= 1e3
        elif kind == "line":
            U[1] *= 1e-9
        elif kind == "touch":
            load[0], row[KN] = math.hypot(load[1], load[2]), 0.0
        elif kind == "open":
            load[0] = 0.3 * math.hypot(load[1], load[2])
            row[[KT, KT_SECOND]] *= 100.0
        elif kind == "barely":
            U[2], load[1:], U[:2, 0] = 0.0, 0.0, 0.0
            load[0] = largest_pull(replace(element, U=U)) / row[MU] * (1.0 - 10.0 ** rng.uniform(-9.0, -2.0))
        elif kind == "soft":
            row[[KT, KT_SECOND]] *= 1e-3
        elif U.shape[1] > 4:
            U[:2] = 0.0
            U[0, 1], U[1, 4] = 3.0, 3.0
        yield kind, replace(element, U=U, load=load, row=row)


def balanced(matrices: tuple[np.ndarray, np.ndarray, np.ndarray], omega: float, scene: dict[str, Any],
             harmonics: int) -> np.ndarray:  # fmt: skip
    """Harmonic balance of three DOFs on one contact in space by Newton's method: coefficients (3, n)."""
    M, C, K = matrices
    contact, n = scene["contacts"][0], 2 * harmonics + 1
    Z = np.zeros((3, n, 3, n))
    f = np.zeros((3, n))
    Z[:, 0, :, 0] = K
    for k in range(1, harmonics + 1):
        c, s = 2 * k - 1, 2 * k
        Z[:, c, :, c] = Z[:, s, :, s] = K - (k * omega) ** 2 * M
        Z[:, c, :, s], Z[:, s, :, c] = k * omega * C, -k * omega * C
    for force in scene["excitation"]:
        at = "xyz".index(force["dof"])
        f[at, 1] += force["amplitude"] * math.cos(force["phase"])
        f[at, 2] -= force["amplitude"] * math.sin(force["phase"])
    Z = Z.reshape(3 * n, 3 * n)
    stiffness = contact["kt"], contact.get("kt_second", contact["kt"])
    row = row_of(*stiffness, contact["mu"], contact["kn"], float(contact["prestressed"]))
    U = np.linalg.solve(Z + np.kron(np.diag(row[[KT, KT_SECOND, KN]]), np.eye(n)), f.ravel())
    # From a load that holds it all, walked down to its value.
    for factor in (30.0, 10.0, 5.0, 3.0, 2.0, 1.5, 1.2, 1.0):
        for _ in range(40):
            load = np.array([factor * contact["N0"], 0.0, 0.0])
            element = Element(U=U.reshape(3, n), load=load, row=row, box=contact["limit"] == "box")
            force_here = evaluate(element)
            residual = Z @ U + force_here.F.ravel() - f.ravel()
            step = np.linalg.solve(Z + force_here.jacobian, residual)
            U = U - step
            if np.abs(step).max() < 1e-11 * np.abs(U).max():
                break
    assert np.abs(residual).max() < 1e-8 * np.abs(f).max()
    return U.reshape(3, n)
