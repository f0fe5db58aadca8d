"""The contacts of a scene as rows of the time march."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.contact_parts import Row
from solver.marching.kernels.march_state import Real, SparseRows, System, steady
from solver.scene.bodies.kinematics import Form


def rows(contacts: tuple[AnyContact, ...]) -> tuple[Row, ...]:
    """Return the rows of all contacts; a square limit in two directions is two of them.

    Raises
    ------
    SettingError
        A contact has a law that the march does not follow, such as a circular limit.
    """
    return tuple(row for contact in contacts for row in contact.rows())


def columns(placed: Sequence[tuple[Row, tuple[Form, ...]]], index: dict[str, int], n: int) -> dict[str, Any]:
    """Return the arrays of `solver.marching.kernels.march_state.System` that belong to the contacts.

    Parameters
    ----------
    placed : every row, and the relative motions of its contact.
    index : the coordinate of each DOF in use; n : how many coordinates there are.
    """
    found = [row for row, _ in placed]
    L = selection([own[row.port] for row, own in placed], index, n)
    normal = [() if row.normal_port is None else own[row.normal_port] for row, own in placed]
    degree = max((len(row.powers) for row in found), default=0)
    powers = np.zeros((len(found), max(degree, 1)))
    for i, row in enumerate(found):
        powers[i, : len(row.powers)] = row.powers
    waves = np.zeros((2, len(found), 1 + max((len(row.higher) for row in found), default=0)))
    for i, row in enumerate(found):
        waves[:, i, : 1 + len(row.higher)] = np.array([(row.N1, row.N1_phase), *row.higher]).T
    own = np.zeros((len(found), max((len(row.numbers) for row in found), default=0)))
    for i, row in enumerate(found):
        own[i, : len(row.numbers)] = row.numbers
    scalars = ("kt", "mu", "N0", "kn", "rest", "presses", "gap", "damping")
    whole = ("history", "in_steps", "states")
    counts = {name: np.array([getattr(row, name) for row in found], dtype=np.int64) for name in whole}
    numbers = {name: np.array([getattr(row, name) for row in found], dtype=np.float64) for name in scalars}
    laws = np.array([row.follows.value for row in found], dtype=np.int64)
    motions = {"L": sparse_rows(L), "normal": sparse_rows(selection(normal, index, n))}
    swings = {"waves": waves[0], "wave_phases": waves[1], **steady(waves[0])}
    return {**numbers, **counts, **motions, **swings, "law": laws, "powers": powers, "numbers": own}


def limit_of(system: System, load: Real) -> Real:
    """Return the limit of each row's friction for its load [N]."""
    return np.asarray(system.mu * load)


def selection(forms: Sequence[Form], index: dict[str, int], n: int) -> csr_array:
    """Return relative motions as rows over the coordinates."""
    terms = [(row, index[t.dof], t.factor) for row, form in enumerate(forms) for t in form]
    row, column, factor = np.array(terms, dtype=float).reshape(-1, 3).T
    return csr_array((factor, (row.astype(np.int64), column.astype(np.int64))), shape=(len(forms), n))


def sparse_rows(matrix: csr_array) -> SparseRows:
    """Return a matrix as the kernels read it."""
    return SparseRows(matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64), matrix.data)


def as_sparse(rows: SparseRows, n: int) -> csr_array:
    """Return it again, with n columns."""
    return csr_array((rows.value, rows.column, rows.start), shape=(rows.start.size - 1, n))
