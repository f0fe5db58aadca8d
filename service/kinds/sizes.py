"""How much one job may ask for; what is larger is several jobs, or a script of one's own."""

from __future__ import annotations

from service.kinds.scenes import refusal
from solver.errors import Issue
from solver.scene import CyclicStructure, Scene

MOST_POINTS = 500_000
"""Of a map: its result is text, some 40 bytes a point."""
MOST_WORK = 1_000_000_000
"""Points × harmonics × DOFs: hours of one processor."""
POINTS_OF_A_SWEEP = 20
"""Fewer a frequency response seldom has."""


def size_issues(where: str, words: str, points: int, harmonics: int, dofs: int) -> list[Issue]:
    """Refuse what would take longer than a job should, at the pointer `where`.

    Parameters
    ----------
    where : of the field that makes it large.
    words : what is counted, for people.
    points : periodic responses to be solved.
    harmonics : kept in each.
    dofs : of the structure that is solved.
    """
    work = points * max(harmonics, 1) * dofs
    if work <= MOST_WORK:
        return []
    return [refusal(where, f"{words} × harmonics × DOFs must be at most {MOST_WORK}, got {work}")]


def dofs_solved(scene: Scene) -> int:
    """The DOFs of the structure as it is solved: of one sector, or of the whole disk."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from solver.sectors import sectors_needed

    return len(scene.structure.dofs) * sectors_needed(scene).sectors


def whole_disk_dofs(scene: Scene) -> int:
    """The DOFs of all sectors."""
    structure = scene.structure
    return len(structure.dofs) * (structure.sectors if isinstance(structure, CyclicStructure) else 1)
