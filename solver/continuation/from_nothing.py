"""A solution from nothing: Newton's method, and where it finds none the arc of the excitation's level."""

from __future__ import annotations

from dataclasses import replace

from solver.balance.workspace import PointSolution, Workspace
from solver.jit.fourier import Real


def solve_from_nothing(workspace: Workspace, p: float, guess: Real | None = None) -> PointSolution:
    """Solve at λ = `p` (inside unit) as `Workspace.solve` does, and where that fails along the level.

    Parameters
    ----------
    guess : (n_unknowns,) slip motions to start from [m].

    Returns
    -------
    The solution, or the attempt without one of `Workspace.solve`; its iterations are those of both ways. A
    motion that ratchets is not looked for further: there is no periodic one. Nor is one where a contact has
    no force at the stuck response: the arc creeps towards the level from which on it has none.
    """
    found = workspace.solve(p, guess)
    if found.converged or found.ratchets or workspace.law_fails(p):
        return found
    # Loaded here: hardly any point needs the kernels of the arc, and a command starts sooner without them.
    from solver.continuation.along_level import solve_along_level

    solution, spent = solve_along_level(workspace, p)
    return replace(found if solution is None else solution, iterations=found.iterations + spent)
