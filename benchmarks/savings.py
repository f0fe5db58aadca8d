"""What each saving of the plan saves: the same answer with it and without."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import solver
from benchmarks.harness import check, expect, table, timed
from benchmarks.problems import case_a, chain, graded_chain
from solver import Scene
from solver.balance.simplifications import Effects


@dataclass(frozen=True, slots=True, kw_only=True)
class Saving:
    """A saving, the scene it is shown on, and the settings that leave it out."""

    name: str
    scene: Callable[[], Scene]
    without: Effects
    harmonics: int = 11
    band: tuple[float, float] | None = None


def _apart() -> Scene:
    """Bladed disk with a shroud that never touches."""
    return solver.load_scene("bladed-disk").with_values({"shroud.N0": 0.0})


SAVINGS = (
    Saving(name="odd harmonics only", scene=case_a, without=Effects(even_harmonics=True)),
    Saving(name="odd harmonics only, 8 sliders", scene=lambda: chain(8, sliders=True),
           without=Effects(even_harmonics=True)),
    Saving(name="stuck contacts are springs", scene=lambda: graded_chain(16),
           without=Effects(every_contact=True), harmonics=7),
    Saving(name="separated contacts are nothing", scene=_apart, without=Effects(every_contact=True)),
    Saving(name="one sector for the annulus", scene=lambda: solver.load_scene("bladed-disk"),
           without=Effects(every_sector=True), harmonics=3, band=(700.0, 800.0)),
    Saving(name="modes for matrices", scene=lambda: chain(32, sliders=False),
           without=Effects(whole_matrices=True)),
)  # fmt: skip


def savings() -> None:
    """What each saving saves: a response with and without it."""
    rows = []
    for saving in SAVINGS:
        scene = saving.scene()
        start, stop = saving.band or scene.observe.band
        branches, seconds = [], []
        for effects in (Effects(), saving.without):
            branch, timing = timed(
                lambda scene=scene, ends=(start, stop), saving=saving, effects=effects: solver.sweep(
                    scene, start=ends[0], stop=ends[1], harmonics=saving.harmonics, effects=effects
                ),
                runs=2,
            )
            expect(f"{saving.name}: {branch.status.value}", branch.reached)
            branches.append(branch)
            seconds.append(timing.cpu / len(branch.values))
        with_it, without = branches
        expect(f"{saving.name}: both have a peak", with_it.peak is not None and without.peak is not None)
        peak = check(saving.name, with_it.peak.value, without.peak.value, 1e-7)
        rows.append(
            (saving.name, scene.name, str(with_it.balance.n_unknowns), str(without.balance.n_unknowns),
             f"{1e3 * seconds[0]:.4f}", f"{1e3 * seconds[1]:.4f}", f"{seconds[1] / seconds[0]:.2f}", peak)
        )  # fmt: skip
    header = ("saving", "scene", "unknowns", "without", "ms a point", "without", "saves, times", "same peak")
    table("What each saving saves", header, rows)
