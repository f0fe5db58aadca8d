"""Whether a half-wave symmetric response is the one that a structure shows, and the way to the other one.

Under constant loads and forces of odd harmonics x(τ + π) = −x(τ) is always a response of friction and of
springs with odd powers. Friction and linear springs never let two responses move apart, so it is the only one
(but for tractions left where parts stick). A spring whose stiffness changes with its motion has others: at a
pitchfork the symmetric response gives its stability to a pair of mirror images with a mean.

Newton's method from a symmetric start stays symmetric. At such a solution dr/du falls into a block of odd and
one of even harmonics; the sign of the determinant of the second changes at every pitchfork, as it is positive
where the springs are linear, a negative one says that an odd number of real perturbations grows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solver.balance.balance import Balance
from solver.balance.workspace import PointSolution, Workspace
from solver.jit.fourier import Integer, Real
from solver.scene.cyclic.annulus import sectors_needed
from solver.scene.scene_harmonics import breaks_symmetry, even_harmonics_reason, places

SYMMETRIC_UNSTABLE = "symmetric_unstable"
NOT_UNIQUE = "not_unique"
WAVE_ASSUMED = "travelling_wave_assumed"
# Of the largest coefficient: even harmonics below are zero but for rounding.
_ZERO = 1e-7
_SHARES = (0.05, 0.2, 0.5, 1.0)  # of the size of the motion that a start leans to one side by


def may_break(workspace: Workspace) -> bool:
    """Return whether a balance has symmetric responses that need not be the ones to be seen."""
    balance = workspace.balance
    ks = balance.system.ks
    scene, path = balance.scene, balance.parameter.path
    return ks[0] == 0 and not breaks_symmetry(scene, (path,)) and even_harmonics_reason(scene) is not None


def is_unstable(workspace: Workspace, u: Real, p: float) -> bool:
    """Return whether (u, λ = p) is symmetric and a perturbation by even harmonics grows."""
    even = _even(workspace)
    if not _is_symmetric(u, even):
        return False
    _, point = workspace.evaluate(u, p)
    return float(np.linalg.slogdet(point.jacobian[np.ix_(even, even)])[0]) < 0.0


def seen(workspace: Workspace, found: PointSolution, p: float) -> tuple[PointSolution, tuple[str, ...]]:
    """Return the response that is seen instead of an unstable symmetric one, with the flags it needs.

    Returns
    -------
    The solution itself without flags, where it is not symmetric or not shown to be unstable; one that leans
    to a side with ``not_unique``, since its mirror image is one too; or the unstable one with
    ``symmetric_unstable``, where no other was found.
    """
    if not found.converged or not may_break(workspace) or not is_unstable(workspace, found.u, p):
        return found, ()
    even = _even(workspace)
    _, point = workspace.evaluate(found.u, p)
    growing = np.zeros(found.u.size)
    growing[even] = np.linalg.svd(point.jacobian[np.ix_(even, even)])[2][-1]
    growing *= float(np.abs(found.u).max()) / float(np.abs(growing).max())
    spent = found.iterations
    for share in _SHARES:
        other = workspace.solve(p, found.u + share * growing)
        spent += other.iterations
        if not other.converged or _is_symmetric(other.u, even):
            continue
        _, point = workspace.evaluate(other.u, p)
        if float(np.linalg.slogdet(point.jacobian)[0]) > 0.0:
            return replace(other, iterations=spent), (NOT_UNIQUE,)
    return replace(found, iterations=spent), (SYMMETRIC_UNSTABLE,)


def assumed_flags(balance: Balance) -> tuple[str, ...]:
    """Return the flags of every response of a balance: what is assumed, and a unit that is not the metre."""
    assumed = (WAVE_ASSUMED,) if sectors_needed(balance.scene).assumed else ()
    unit = balance.scene.observed_unit
    return assumed if unit == "m" else (*assumed, f"amplitude_in_{unit}")


def branch_flags(workspace: Workspace, solutions: Real) -> tuple[str, ...]:
    """Return the flags of a branch: ``symmetric_unstable`` if a point of it is, and what is assumed.

    Parameters
    ----------
    solutions : (P, n_unknowns + 1) motions with λ last.
    """
    flags = assumed_flags(workspace.balance)
    if may_break(workspace) and any(is_unstable(workspace, row[:-1], float(row[-1])) for row in solutions):
        return (*flags, SYMMETRIC_UNSTABLE)
    return flags


def _even(workspace: Workspace) -> Integer:
    """Return where the coefficients of even harmonics and means stand among the unknowns."""
    balance = workspace.balance
    ks = balance.system.ks
    of_one = places(ks, ks[ks % 2 == 0])[0]
    ports = balance.n_coefficients * np.arange(balance.n_ports)
    return np.asarray((ports[:, None] + of_one).reshape(-1), np.int64)


def _is_symmetric(u: Real, even: Integer) -> bool:
    largest = float(np.abs(u).max(initial=0.0))
    return float(np.abs(u[even]).max(initial=0.0)) <= _ZERO * largest
