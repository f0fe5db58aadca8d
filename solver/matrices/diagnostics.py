"""What is wrong, or looks wrong, with matrices of a finite-element model; each message says what to do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.linalg import ArpackNoConvergence, eigsh

from solver.arrays import Real
from solver.errors import FieldError
from solver.matrices.load_set import MatrixSet
from solver.matrices.sectors.elimination import Elimination
from solver.matrices.values import ASYMMETRY, one_triangle
from solver.results import units

_RIGID = 1e-3  # a frequency below this share of the next one counts as zero
_BODY = 6
_SLOW, _FAST = 0.1, 3e5  # Hz; a first elastic frequency outside is hardly that of a machine part
_LIGHT = 1e-3  # kg; less than a gram is more likely tonnes
_HEAVY = 1e7  # kg; more is more likely a stiffness, or another unit
_PENALTY = 1e30  # a stiffness that stands for a boundary condition
_INDEFINITE = 1e-6  # smallest eigenvalue of M scaled to a unit diagonal, negative beyond rounding


def refuse(found: MatrixSet, *, reduced: bool, gone: Elimination | None = None) -> None:
    """Raise for matrices that are no structure.

    Parameters
    ----------
    reduced : whether rows without mass will be condensed out.
    gone : how the high boundary of a sector follows the low one, which joins their masses.

    Raises
    ------
    FieldError
        Sizes that differ, matrices that are not symmetric, empty rows, negative or missing masses, negative
        stiffness on the diagonal; a ValueError with the matrix as its subject.
    """
    sizes = {key: matrix.shape[0] for key, matrix in found.matrices.items()}
    if len(set(sizes.values())) > 1:
        told = ", ".join(f"{key} has {size} rows" for key, size in sizes.items())
        said = f"{told}: export all of them from one analysis, with the same boundary conditions"
        raise FieldError((), said, named=False)
    for key, matrix in found.matrices.items():
        _symmetric(key, csr_array(matrix), found)
    M, K = (csr_array(found.matrices[key]) for key in "MK")
    if M.nnz and abs(M - K).max() == 0.0:
        raise FieldError(
            ("M",), "and `K` are the same matrix: give the mass and the stiffness, in the order M K C"
        )
    empty = np.flatnonzero((abs(M).sum(axis=1) == 0.0) & (abs(K).sum(axis=1) == 0.0))
    if empty.size:
        raise FieldError(
            (),
            f"{_rows(found, empty)} empty in M and K: these DOFs belong to no element; take them out of the "
            "export, or hold them by a boundary condition",
            named=False,
        )
    mass, stiffness = M.diagonal(), K.diagonal()
    _diagonals(found, mass, stiffness)
    bare = np.flatnonzero(mass == 0.0)
    if gone is not None:
        bare = gone.kept[gone.of(M).own.diagonal() == 0.0]
    if bare.size and not reduced:
        raise FieldError(
            ("M",),
            f"must be positive definite, but {_rows(found, bare)} without mass: reduce the model "
            "onto the DOFs in use, which condenses such DOFs out, and do not name them",
        )
    least = _least(M)
    if least < -_INDEFINITE:
        raise FieldError(
            ("M",),
            f"must be positive definite, got {least:.3g} as its least eigenvalue when scaled to a unit "
            "diagonal: is a triangle missing, or the file not M?",
        )


def _diagonals(found: MatrixSet, mass: Real, stiffness: Real) -> None:
    """Raise for masses and stiffnesses on the diagonal that cannot be."""
    at = int(mass.argmin())
    if mass[at] < 0.0:
        where = f"has {mass[at]:g} on the diagonal of {found.name(at)}, where a mass must be"
        raise FieldError(("M",), f"{where}: are the files in the order M K C?")
    at = int(stiffness.argmin())
    if stiffness[at] < 0.0:
        where = f"has {stiffness[at]:g} on the diagonal of {found.name(at)}: a stiffness must be >= 0 there"
        raise FieldError(("K",), f"{where}; export K at a state of equilibrium, before it buckles")
    penalties = np.flatnonzero(stiffness >= _PENALTY)
    if penalties.size:
        raise FieldError(
            ("K",),
            f"has {stiffness[penalties[0]]:g} on the diagonal, {_rows(found, penalties)} held by a "
            "penalty: leave such DOFs out of the export (Abaqus: FORMAT=MATRIX INPUT, which tells them)",
        )


def _symmetric(key: str, matrix: Any, found: MatrixSet) -> None:
    difference = coo_array(abs(matrix - matrix.T))
    largest = float(abs(matrix).max())
    if difference.nnz and float(difference.data.max()) > ASYMMETRY * largest:
        at = int(difference.data.argmax())
        i, j = sorted((int(difference.row[at]), int(difference.col[at])))
        dense = csr_array(matrix)
        triangle = one_triangle(matrix)
        if triangle is not None:
            raise FieldError((key,), f"must be symmetric: {triangle}")
        raise FieldError(
            (key,),
            f"must be symmetric to {ASYMMETRY:g} of its largest entry {largest:g}, got "
            f"{dense[i, j]:.10g} in {found.name(i)}, column {j} and {dense[j, i]:.10g} on the other side: "
            "leave out gyroscopic terms, follower loads and unsymmetric contact before the export",
        )


def _rows(found: MatrixSet, rows: NDArray[np.int64]) -> str:
    names = ", ".join(found.name(int(row)) for row in rows[:4])
    return (
        f"{names}{f' and {rows.size - 4} more' if rows.size > 4 else ''} {'is' if rows.size == 1 else 'are'}"
    )


def _least(M: Any) -> float:
    """The least eigenvalue of M scaled to a unit diagonal, roughly; 0 if rows without mass are among them."""
    diagonal = M.diagonal()
    scale = diags_array(1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)))
    scaled = scale @ M @ scale
    if M.shape[0] <= 400:
        return float(np.linalg.eigvalsh(scaled.toarray())[0])
    start = np.linspace(1.0, 2.0, M.shape[0])
    try:
        return float(eigsh(scaled, k=1, which="SA", tol=1e-2, maxiter=300, v0=start)[0][0])
    except ArpackNoConvergence as error:
        return float(min(error.eigenvalues, default=0.0))


def rigid_body_modes(omega2: Real) -> int:
    """How many of the lowest ω² are zero but for rounding: those below a wide gap."""
    size = np.sort(np.abs(omega2))
    for count in range(min(_BODY, size.size - 1), 0, -1):
        if size[count - 1] < _RIGID**2 * size[count]:
            return count
    return 0


def notes(found: MatrixSet, omega2: Real) -> list[str]:
    """What looks wrong, or should be known, about a structure with the natural frequencies √ω².

    Parameters
    ----------
    omega2 : of the model without contacts [rad²/s²].
    """
    said = list(found.remarks)
    if found.held:
        said.append(f"{found.held} rows that a boundary condition holds were left out")
    rigid = rigid_body_modes(omega2)
    if found.inner.any():
        said.append(f"{found.counted}: their nodes are none of the deck's; they follow, and need no names")
    if rigid:
        said.append(
            f"{rigid} rigid-body mode{'s' if rigid > 1 else ''}: the body is not held. If it should be, its "
            "boundary conditions were missing at the export"
        )
    elastic = np.sort(omega2)[rigid:]
    negative = int(np.count_nonzero(elastic < 0.0))
    if negative:
        said.append(
            f"K is not positive semidefinite: {negative} negative ω², the lowest {elastic[0]:.3g} rad²/s²; "
            "export it at a stable state"
        )
    first = (
        math.sqrt(max(float(elastic[negative]), 0.0)) / (2.0 * math.pi) if negative < elastic.size else 0.0
    )
    if first and not _SLOW <= first <= _FAST:
        said.append(
            f"the first elastic frequency is {units.hertz(first)}: are M and K in units that go together? K "
            "in N/mm goes with M in t, `units` mm, K in N/m with M in kg; N/mm with kg is a factor 32 too "
            "low, N/m with t a factor 32 too high. Or are M and K swapped?"
        )
    mass = total_mass(found)
    if mass is not None and 0.0 < mass[1] < _LIGHT:
        said.append(
            f"the mass is {units.quantity(mass[1], 'kg')} in {mass[0]}: if that is in tonnes (a model in mm, "
            "t, N, s), its `units` are mm"
        )
    if mass is not None and mass[1] > _HEAVY:
        said.append(
            f"the mass is {units.quantity(mass[1], 'kg')} in {mass[0]}: is M in kg, and not the stiffness? "
            "Files are taken in the order M K C unless their names say otherwise"
        )
    return said


def total_mass(found: MatrixSet) -> tuple[str, float] | None:
    """The mass that moves in one direction [kg], with its name; None if the rows are not labelled."""
    masses = {direction: float(moved @ force) for direction, moved, force in _moved(found)}
    return max(masses.items(), key=lambda one: one[1], default=None)


def mass_carried(found: MatrixSet, motions: Real) -> dict[str, float]:
    """The share of the mass in each direction that M-orthonormal motions of the rows carry, (n, r)."""
    return {
        direction: float(np.sum((force @ motions) ** 2) / (moved @ force))
        for direction, moved, force in _moved(found)
    }


def _moved(found: MatrixSet) -> Iterator[tuple[str, Real, Real]]:
    """Each direction in which rows are labelled, with that motion of all nodes and the inertia against it."""
    for direction in ("UX", "UY", "UZ") if "M" in found.matrices else ():
        here = [label.component == direction for label in found.labels or ()]
        moved = np.array(here, dtype=np.float64) * ~found.inner
        if moved.any():
            yield direction, moved, found.matrices["M"] @ moved
