"""What a frequency response costs, stage by stage, and beside another checkout of the project.

`python -m benchmarks.sweep_costs` prints the stages, `--against FOLDER` the ratio to the checkout there: each
runs in a process of its own, the two in turn, so that what else the machine does meets both alike.
"""

from __future__ import annotations

import argparse
import importlib
import json
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.harness import Checkout, expect, table
from benchmarks.problems import chain

REPEATS = 21
AGREE = 1e-8  # relative difference of the highest peak of two checkouts

# Stage: where it is looked up when a sweep calls it (module and attribute; a dot leads into a class). What a
# stage calls of another one counts there.
STAGES = {
    "set-up": (("solver.continuation.branches.sweep", "build"),),
    "walk": (("solver.continuation.branches.sweep", "_covering"),),
    "loose parts": (("solver.continuation.stretches", "balanced_part"),),
    "changes": (("solver.continuation.extrema.extrema", "settle_changes"),),
    "resonances": (("solver.continuation.extrema.extrema", "ResonanceSearch.run"),),
    "peaks": (("solver.continuation.extrema.extrema", "find_peaks"),),
    "band": (("solver.continuation.extrema.extrema", "Survey.band"),),
    "error": (("solver.continuation.branches.sweep", "branch_error"),),
    "flags": (("solver.continuation.branches.sweep", "branch_flags"),),
    "certificate": (("solver.continuation.extrema.extrema", "Survey.certificate"),),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A response that is timed."""

    name: str
    scene: Callable[[], Any]
    harmonics: int = 11
    band: tuple[float, float] | None = None
    every_sector: bool = False
    repeats: int = REPEATS


def _annulus(sectors: int) -> Any:
    """The bladed disk with so many sectors."""
    import solver

    raw = solver.load_scene("bladed-disk").to_dict()
    raw["structure"]["sectors"] = sectors
    return solver.Scene.from_dict(raw)


def _shipped(name: str) -> Any:
    import solver

    return solver.load_scene(name)


CASES = (
    Case(name="two-dof", scene=lambda: _shipped("two-dof")),
    Case(name="bladed-disk", scene=lambda: _shipped("bladed-disk")),
    Case(
        name="annulus-8",
        scene=lambda: _annulus(8),
        harmonics=3,
        band=(700.0, 800.0),
        every_sector=True,
    ),
    Case(
        name="annulus-24",
        scene=lambda: _annulus(24),
        harmonics=3,
        band=(700.0, 800.0),
        every_sector=True,
        repeats=5,
    ),
    Case(name="chain-32", scene=lambda: chain(32, sliders=True), harmonics=3, repeats=9),
    Case(name="chain-32, one slider", scene=lambda: chain(32, sliders=False)),
)


def _call(case: Case) -> Callable[[], Any]:
    import solver
    from solver.balance.simplifications import Effects

    scene, effects = case.scene(), Effects(every_sector=case.every_sector)
    start, stop = case.band or scene.observe.band
    return lambda: solver.sweep(scene, start=start, stop=stop, harmonics=case.harmonics, effects=effects)


class Clock:
    """Milliseconds of each stage, those of the stages it calls left out."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = {}
        self._open: list[float] = []  # spent by stages inside those that run

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count what runs inside."""
        begun = time.thread_time()
        self._open.append(0.0)
        try:
            yield
        finally:
            took = time.thread_time() - begun
            self.spent[name] = self.spent.get(name, 0.0) + 1e3 * (took - self._open.pop())
            if self._open:
                self._open[-1] += took

    def around(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function, or what yields a sequence, that counts as a stage."""

        def counted(*arguments: Any, **named: Any) -> Any:
            with self.stage(name):
                found = function(*arguments, **named)
            return self._each(name, found) if isinstance(found, Iterator) else found

        return counted

    def _each(self, name: str, sequence: Iterator[Any]) -> Iterator[Any]:
        while True:
            with self.stage(name):
                each = next(sequence, None)
            if each is None:
                return
            yield each


@contextmanager
def _counted(clock: Clock) -> Iterator[None]:
    """Count stages until the block ends; those that this checkout does not have are left out."""
    before = []
    for name, places in STAGES.items():
        for module, path in places:
            owner: Any = importlib.import_module(module)
            *classes, attribute = path.split(".")
            for each in classes:
                owner = getattr(owner, each)
            before.append((owner, attribute, getattr(owner, attribute)))
            setattr(owner, attribute, clock.around(name, before[-1][2]))
    try:
        yield
    finally:
        for owner, attribute, function in before:
            setattr(owner, attribute, function)


def stages(cases: tuple[Case, ...] = CASES) -> None:
    """What the stages of a response cost."""
    rows = []
    for case in cases:
        call = _call(case)
        call()
        found = []
        for _ in range(case.repeats):
            clock = Clock()
            with _counted(clock), clock.stage("rest"):
                call()
            found.append(clock.spent)
        median = {
            name: statistics.median(each.get(name, 0.0) for each in found) for name in (*STAGES, "rest")
        }
        total = statistics.median(sum(each.values()) for each in found)
        rows.append((case.name, f"{total:.2f}", *(f"{each:.2f}" for each in median.values())))
    table("Stages of a response [ms of the process]", ("scene", "whole", *STAGES, "rest"), rows)


def serve() -> None:
    """Answer with the cost of one response for each name of a case."""
    cases = {case.name: _call(case) for case in CASES}
    for line in sys.stdin:
        begun = time.thread_time()
        branch = cases[line.rstrip("\n")]()
        spent = 1e3 * (time.thread_time() - begun)
        answer = {"ms": spent, "peak": branch.peak.value, "points": len(branch.values)}
        print(json.dumps(answer), flush=True)


def against(folders: list[Path], cases: tuple[Case, ...] = CASES) -> None:
    """What a response costs in checkouts, each beside the first."""
    sides = [Checkout(folder, "benchmarks.sweep_costs") for folder in folders]
    rows = []
    for case in cases:
        first = [side.ask(case.name) for side in sides]
        for other in first[1:]:
            off = abs(other["peak"] - first[0]["peak"]) / first[0]["peak"]
            expect(f"{case.name}: peaks are {off:.1e} apart", off <= AGREE)
        times: list[list[float]] = [[] for _ in sides]
        for _ in range(case.repeats):
            for side, spent in zip(sides, times, strict=True):
                spent.append(side.ask(case.name)["ms"])
        medians = [statistics.median(spent) for spent in times]
        ratios = [f"{median / medians[0]:.2f}" for median in medians[1:]]
        rows.append((case.name, *(f"{median:.2f}" for median in medians), *ratios))
    for side in sides:
        side.close()
    names = [folder.name for folder in folders]
    ratios = [f"{name} / {names[0]}" for name in names[1:]]
    table("A response [ms of the process, medians]", ("scene", *names, *ratios), rows)


def main() -> None:
    """Print the stages, or the ratio to other checkouts."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sweep_costs", description=__doc__)
    parser.add_argument("--against", nargs="+", type=Path, metavar="FOLDER", help="the first is the measure")
    parser.add_argument("--case", nargs="+", metavar="NAME", help=", ".join(case.name for case in CASES))
    asked = parser.parse_args()
    cases = tuple(case for case in CASES if asked.case is None or case.name in asked.case)
    if asked.against:
        against([*(folder.resolve() for folder in asked.against), Path(__file__).resolve().parents[1]], cases)
    else:
        stages(cases)


if __name__ == "__main__":
    main()
