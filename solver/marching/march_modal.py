"""The equations of a march in the modes of its structure: full matrices become diagonal ones.

x = V q with Vᵀ M V = 1 makes of x'' = W (f − Lᵀ F) − A x − B x' the rows
q'' = Vᵀ f − (L V)ᵀ F − Λ q − D q'. A force acts on all modes: its DOF stays as a coordinate that never moves,
whose pull goes to the modes. What is observed is a sum of modes, one more coordinate.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import linalg
from scipy.sparse import csr_array

from solver.arrays import Real
from solver.marching.contacts import as_sparse, sparse_rows
from solver.marching.kernels import march_state as kernel
from solver.marching.march_base import with_sum
from solver.marching.march_equations import MarchEquations

_FEWEST = 6  # coordinates; below, full matrices cost no more
_ROUNDING = 1e-10  # relative: of what is to be symmetric or diagonal


def in_modes(equations: MarchEquations) -> MarchEquations:
    """Return the equations in modes; as they are where they are few, sparse, or modes do not part them."""
    system = equations.system
    n = system.A.start.size - 1
    if n < _FEWEST or 2 * system.A.value.size < n * n or system.A_course.size:
        return equations
    A, B, W, L, normal = (
        as_sparse(each, n).toarray() for each in (system.A, system.B, system.W, system.L, system.normal)
    )
    if not _is_small(W - W.T, W) or linalg.eigvalsh(W)[0] <= 0.0:
        return equations
    mass = linalg.inv(W)
    stiffness = mass @ A
    if not _is_small(stiffness - stiffness.T, stiffness):
        return equations
    squares, V = linalg.eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T))
    damping = V.T @ mass @ B @ V
    own = np.diag(damping)
    if not _is_small(damping - np.diag(own), damping):
        return equations
    pushed, places = np.unique(system.force_dof, return_inverse=True)
    still = np.zeros(pushed.size)
    spread = np.block([[np.eye(n), V[pushed].T], [np.zeros((pushed.size, n + pushed.size))]])
    seen = tuple((m, float(factor)) for m, factor in enumerate(V[equations.observed]))
    sparse = (csr_array(each) for each in (np.diag([*squares, *still]), np.diag([*own, *still]), spread))
    *moved, observed = with_sum(seen, *sparse)
    to, drive, inverse = (sparse_rows(each) for each in moved)
    wider = csr_array(np.pad(L @ V, ((0, 0), (0, pushed.size + 1))))
    pressing = csr_array(np.pad(normal @ V, ((0, 0), (0, pushed.size + 1))))
    changed = system._replace(
        A=to, B=drive, W=inverse, L=sparse_rows(wider), normal=sparse_rows(pressing), force_dof=n + places,
    )  # fmt: skip
    return replace(equations, system=changed, observed=observed, index={}, seen=seen, modes=V)


def moved_to(state: kernel.State, before: MarchEquations, now: MarchEquations) -> None:
    """Give a state of equations in modes the coordinates of others of the same scene."""
    if before.modes is None or now.modes is None:
        return
    n = len(now.modes)
    for vector in (state.x, state.v):
        vector[:n] = linalg.solve(now.modes, before.modes @ vector[:n])


def _is_small(rest: Real, whole: Real) -> bool:
    return bool(np.abs(rest).max() <= _ROUNDING * np.abs(whole).max())
