"""How much one job may ask for; what is larger is several jobs, or a script of one's own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

from solver.errors import Issue, Shown

if TYPE_CHECKING:
    from solver.scene.scene import Scene

MOST_POINTS = 500_000
"""Of a map: its result is text, some 40 bytes a point."""
MOST_WORK = 1_000_000_000
"""Points × harmonics × DOFs: hours of one processor."""
MOST_UNKNOWNS = 8_000
"""Of the balance: its matrix, of which a worker holds some, is then 0.5 GB."""
MOST_STEPS = 100_000_000_000
"""Time steps × DOFs of a march: hours of one processor."""
QUICK_DOFS = 500
"""Of the whole disk: of so many it is quickly known how fast they move."""
FEWEST_STEPS = 256
"""Of a period, where the solver chooses them."""
MOST_COUPLED = 250  # motions of full matrices; of more a hundred periods take half an hour
MOST_MOTIONS = 40
"""Points of the curve of a mode with loops and shapes."""
POINTS_OF_A_SWEEP = 20
"""Fewer a frequency response seldom has."""

_most_work: ContextVar[int] = ContextVar("most_work", default=MOST_WORK)
_most_memory: ContextVar[int | None] = ContextVar("most_memory", default=None)


@contextmanager
def work_limited(most: int | None) -> Iterator[None]:
    """Inside, jobs may ask for no more work than `most`, the limit of a key; None for no such limit."""
    token = _most_work.set(MOST_WORK if most is None else min(most, MOST_WORK))
    try:
        yield
    finally:
        _most_work.reset(token)


@contextmanager
def memory_limited(most: int | None) -> Iterator[None]:
    """Inside, jobs may ask for dense matrices of at most so many bytes; None for no such limit."""
    token = _most_memory.set(most)
    try:
        yield
    finally:
        _most_memory.reset(token)


def memory_issues(scene: Scene, harmonics: int, *, every_sector: bool = False) -> list[Issue]:
    """Refuse a response whose dense matrices take more memory than a job may, before any is made."""
    from solver.studies.memory import dense_bytes

    needed = dense_bytes(scene, harmonics, every_sector=every_sector).total
    if _fits(needed):
        return []
    fewer = harmonics > 1 and _fits(dense_bytes(scene, 1, every_sector=every_sector).total)
    return [_too_much("harmonics" if fewer else "scene", needed)]


def _fits(needed: int) -> bool:
    most = _most_memory.get()
    return most is None or needed <= most


def _too_much(key: str, needed: int) -> Issue:
    most = (_most_memory.get() or 0) / 1e6
    words = f"must need at most {most:.0f} MB for its dense matrices" if key == "scene" else (
        f"must be so few that the dense matrices need at most {most:.0f} MB"
    )  # fmt: skip
    return Issue((key,), words, Shown(f"{needed / 1e6:.0f} MB"))


def size_issues(key: str, words: str, points: int, harmonics: int, dofs: int) -> list[Issue]:
    """Refuse what would take longer than a job should, as what is wrong with `key`.

    Parameters
    ----------
    key : the field that makes it large.
    words : what is counted, for people.
    points : periodic responses to be solved.
    harmonics : kept in each.
    dofs : of the structure that is solved.
    """
    work = points * max(harmonics, 1) * dofs
    most = _most_work.get()
    if work <= most:
        return []
    return [Issue((key,), f"{words} × harmonics × DOFs must be at most {most}", work, named=False)]


def balance_issues(
    key: str, scene: Scene, harmonics: int, points: int = 1, words: str = "points", *,
    every_sector: bool = False,
) -> list[Issue]:  # fmt: skip
    """Refuse responses whose balance is too large, or too many of them, as what is wrong with `key`.

    Parameters
    ----------
    key : the field that makes it large, if it is not the scene itself.
    harmonics : highest one kept.
    points : periodic responses to be solved.
    words : what is counted, for people.
    every_sector : the whole annulus is solved, even of a tuned disk under a travelling wave.
    """
    sectors = scene.structure.sector_count if every_sector else _sectors(scene)
    return (
        _unknown_issues(scene, harmonics, sectors)
        or memory_issues(scene, harmonics, every_sector=every_sector)
        or size_issues(key, words, points, harmonics, len(scene.dofs) * sectors)
    )


def contact_motions(scene: Scene) -> int:
    """Motions of the contacts, those of all sectors where one does not stand for them."""
    return _motions(scene, _sectors(scene))


def coefficients(scene: Scene, harmonics: int) -> int:
    """Coefficients of a motion, those that forces of higher harmonics call for included."""
    from solver.scene.scene_harmonics import kept_harmonics

    return 2 * len(kept_harmonics(scene, (), harmonics, odd=False)) - 1


def _sectors(scene: Scene) -> int:
    from solver.scene.cyclic.annulus import sectors_needed

    return sectors_needed(scene).sectors


def _motions(scene: Scene, sectors: int) -> int:
    return sum(scene.port_counts) * sectors


def _unknown_issues(scene: Scene, harmonics: int, sectors: int) -> list[Issue]:
    motions = _motions(scene, sectors)
    kept = coefficients(scene, harmonics)
    unknowns = motions * kept
    if unknowns <= MOST_UNKNOWNS:
        return []
    plain = kept == 2 * harmonics + 1
    of_each = f"(2 × {harmonics} harmonics + 1)" if plain else f"{kept} coefficients"
    fitting = (MOST_UNKNOWNS // motions - 1) // 2
    got = Shown(f"{motions} motions of contacts × {of_each} = {unknowns}")
    if fitting >= 1:
        words = f"must be at most {fitting} for this scene, {MOST_UNKNOWNS} unknowns"
        return [Issue(("harmonics",), words, got)]
    return [Issue(("scene",), f"must have contacts for at most {MOST_UNKNOWNS} unknowns", got)]


def march_issues(
    scene: Scene, steps_per_period: int | None, periods: int, of_periods: str = "max_periods"
) -> list[Issue]:
    """Refuse a march of more steps than one job should make, or of too large matrices.

    `of_periods` is the key that says how many periods there are.
    """
    from solver.studies.memory import march_bytes

    if not _fits(needed := march_bytes(scene)):
        return [_too_much("scene", needed)]
    dofs = whole_disk_dofs(scene)
    steps = (steps_per_period or FEWEST_STEPS) * periods * dofs
    if steps <= MOST_STEPS:
        return []
    key = of_periods if steps_per_period is None else "steps_per_period"
    words = "steps of a period × periods × DOFs"
    return [Issue((key,), f"`{key}`: {words} must be at most {MOST_STEPS}", steps, named=False)]


def marched_for_hours(scene: Scene) -> str:
    """Return why a march of the scene is not proposed; empty where it takes minutes at most."""
    from solver.studies.memory import whole_coordinates

    count = whole_coordinates(scene) if scene.structure.kind == "matrices" else 0
    words = f"Each step couples all {count} motions of the matrices: a march takes hours, and wants its keys."
    return words if count > MOST_COUPLED else ""


def is_quick(scene: Scene) -> bool:
    """Whether what its frequencies allow may be looked at before a job is taken."""
    return whole_disk_dofs(scene) <= QUICK_DOFS


def dofs_solved(scene: Scene) -> int:
    """The DOFs of the structure as it is solved: of one sector, or of the whole disk."""
    return len(scene.dofs) * _sectors(scene)


def whole_disk_dofs(scene: Scene) -> int:
    """The DOFs of all sectors."""
    return len(scene.dofs) * scene.structure.sector_count
