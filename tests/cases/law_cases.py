"""Elements of every contact law for the kernel's tests: a way to call them, and to judge derivatives."""

from dataclasses import dataclass, field, replace

import numpy as np
from contact_cases import central_difference, tables

from solver.contacts.kernels import columns
from solver.contacts.kernels.laws import law_force, law_number
from solver.contacts.kernels.stick_slip_events import new_segments
from solver.jit import fourier

COULOMB_LINE, GAP_SPRING, POLYNOMIAL, COULOMB_CIRCLE, COULOMB_BOX, _ = columns.KERNELS
ELASTIC_NORMAL = COULOMB_LINE  # of two ports
LOAD_KS = fourier.all_harmonics(1)


@dataclass(frozen=True, kw_only=True)
class Element:
    """One element: motions (m, n) of the harmonics `ks`, given load, and a row of the contact table."""

    law: str | int
    U: np.ndarray
    row: np.ndarray
    load: np.ndarray = field(default_factory=lambda: np.zeros(3))
    ks: np.ndarray | None = None

    @property
    def harmonics(self) -> np.ndarray:
        return fourier.all_harmonics((self.U.shape[1] - 1) // 2) if self.ks is None else self.ks


@dataclass(frozen=True, kw_only=True)
class Force:
    """What a law gives."""

    F: np.ndarray
    dF_dU: np.ndarray
    dF_dp: np.ndarray
    state: int
    piece: int


def row_of(**values: float) -> np.ndarray:
    """Return a row of the contact table with the named columns of `solver.contacts.kernels.columns`."""
    row = np.zeros(columns.COLUMNS)
    for name, value in values.items():
        row[getattr(columns, name)] = value
    return row


def evaluate(element: Element, slope: np.ndarray | None = None, dload: np.ndarray | None = None) -> Force:
    """Call the kernel; `slope` and `dload` are the derivatives of row and load by λ."""
    m, n = element.U.shape
    top = max(int(element.harmonics[-1]), 1)
    segments = new_segments(top)
    F, dF_dU, dF_dp = np.full((m, n), np.nan), np.full((m * m, n, n), np.nan), np.full((m, n), np.nan)
    number = element.law if isinstance(element.law, int) else law_number(element.law)
    state, piece = law_force(
        number, element.U, element.harmonics, element.load, LOAD_KS, element.row,
        np.zeros(columns.COLUMNS) if slope is None else slope, np.zeros(3) if dload is None else dload,
        *tables(top), segments, F, dF_dU, dF_dp,
    )  # fmt: skip
    return Force(F=F, dF_dU=dF_dU, dF_dp=dF_dp, state=int(state), piece=int(piece))


def jacobian(force: Force) -> np.ndarray:
    """Return the Jacobian as one (m n, m n) matrix."""
    m, n = force.F.shape
    return force.dF_dU.reshape(m, m, n, n).transpose(0, 2, 1, 3).reshape(m * n, m * n)


def derivative_errors(
    element: Element, names: tuple[str, ...], step: float = 1e-5
) -> dict[str, float] | None:
    """Return the relative errors of the Jacobian and of the derivatives by columns and load.

    None if the law changes its smooth piece within the steps.
    """
    here = evaluate(element)
    size = here.F.size

    def along(**change: np.ndarray) -> np.ndarray | None:
        def force(x: float) -> np.ndarray | None:
            moved = evaluate(replace(element, **{k: getattr(element, k) + x * d for k, d in change.items()}))
            same = (moved.state, moved.piece) == (here.state, here.piece)
            return moved.F.reshape(-1) if same else None

        scale = max(np.nanmax(np.abs(getattr(element, k))) / np.abs(d).max() for k, d in change.items())
        return central_difference(force, step * scale)

    found: dict[str, tuple[np.ndarray, list[np.ndarray | None]]] = {}
    units = np.eye(size).reshape(size, *element.U.shape)
    found["U"] = (jacobian(here), [along(U=unit) for unit in units])
    for name in names:
        unit = row_of(**{name: 1.0})
        at = getattr(columns, name)
        change = unit * max(abs(element.row[at]), 1e-3) / max(np.nanmax(np.abs(element.row)), 1e-300)
        exact = evaluate(element, slope=change).dF_dp.reshape(-1, 1)
        found[name] = (exact, [along(row=change)])
    if np.any(element.load):
        given = np.column_stack([evaluate(element, dload=unit).dF_dp.reshape(-1) for unit in np.eye(3)])
        found["load"] = (given, [along(load=unit) for unit in np.eye(3)])
    errors = {}
    for name, (exact, differences) in found.items():
        if any(column is None for column in differences):
            return None
        difference = np.array(differences).T
        scale = np.abs(difference).max()
        errors[name] = float(np.abs(exact - difference).max() / scale) if scale > 0.0 else 0.0
    return errors
