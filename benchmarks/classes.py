"""Every class of work at its cost: what is to be reached, what is, and the ratio to other checkouts.

`python -m benchmarks.classes` prints the table, `--row NAME …` some of its rows, `--against FOLDER` the ratio
to the checkout there. Each checkout runs in a process of its own, the calls of a row in turn, so that what
else the machine does meets both alike.

A row is a function that prepares its work and returns the call to be timed; what the call gives back must
be equal in all checkouts. Modules of the solver are imported inside: each checkout has its own.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from benchmarks.harness import Checkout, expect, table

AGREE = 1e-9  # relative difference of a result of two checkouts
PATIENCE = 900.0  # s on the wall that an answer is waited for
WARM = 100.0  # s of a process: what takes longer, kernels compiled or not, is timed at its first call alone
ENOUGH = 6.0  # s of a branch, for the cost of its points
MIB = 1024.0  # ru_maxrss is in KiB


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a call found.

    Attributes
    ----------
    value : must be equal in all checkouts.
    parts : into so many points the time is divided.
    figure : stands in the table instead of the time.
    responses : that a design took.
    """

    value: float
    parts: int = 1
    figure: float | None = None
    responses: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A row of the table: what is done, the figure that is wanted in its unit, and how often it is timed."""

    name: str
    work: str
    goal: float
    unit: str
    runs: int
    prepare: Callable[[], Callable[[], Answer]]


ROWS: dict[str, Row] = {}


def row(
    name: str, work: str, goal: float, *, unit: str = "s", runs: int = 5
) -> Callable[[Callable[[], Callable[[], Answer]]], Callable[[], Callable[[], Answer]]]:
    """Enter a function into the table as the row `name`."""

    def entered(prepare: Callable[[], Callable[[], Answer]]) -> Callable[[], Callable[[], Answer]]:
        ROWS[name] = Row(name=name, work=work, goal=goal, unit=unit, runs=runs, prepare=prepare)
        return prepare

    return entered


def lap_joint(nodes: int, *, amplitude: float = 3.0) -> Any:
    """Two bars in space, pressed together at so many nodes that rub in two directions, a mass at the end.

    With an amplitude of 3 N all nodes stick.
    """
    from solver import Scene

    bars = [[f"{bar}{i}" for i in range(nodes)] for bar in "ab"]
    springs: list[dict[str, Any]] = [
        {"between": [f"{one}{axis}", f"{other}{axis}"], "k": 5e7, "c": 5.0}
        for bar in bars
        for one, other in pairwise(bar)
        for axis in "xyz"
    ]
    first, last = bars[0][0], bars[1][-1]
    springs += [{"between": [f"{first}{axis}", "ground"], "k": 1e7, "c": 5.0} for axis in "xyz"]
    springs.append({"between": ["tipz", f"{last}z"], "k": 3e5, "c": 2.0})
    springs.append({"between": [f"{last}z", f"{bars[0][-1]}z"], "k": 1e4, "c": 1.0})
    return Scene.from_dict(
        {
            "name": f"lap-joint-{nodes}",
            "structure": {
                "kind": "lumped",
                "masses": {f"{node}{axis}": 0.01 for bar in bars for node in bar for axis in "xyz"}
                | {"tipz": 0.5},
                "springs": springs,
            },
            "contacts": [
                {
                    "name": f"c{i}", "law": "coulomb-3d", "between": [f"{b}x", f"{a}x"],
                    "between_second": [f"{b}y", f"{a}y"], "normal_between": [f"{b}z", f"{a}z"],
                    "kt": 2e8 / nodes, "kn": 3e8 / nodes, "mu": 0.3, "N0": 2400.0 / nodes,
                    "prestressed": True,
                }
                for i, (a, b) in enumerate(zip(*bars, strict=True))
            ],
            "excitation": {"forces": {"tipz": 1.0, f"{last}x": 2.0}, "amplitude": amplitude},
            "observe": {"dof": "tipz", "band": [60.0, 140.0]},
        }
    )  # fmt: skip


def _solved(scene: Any, frequency_hz: float, harmonics: int, *, slips: bool = True) -> Callable[[], Answer]:
    """Return the call that solves at a frequency."""
    import solver

    def call() -> Answer:
        found = solver.solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
        expect(f"{scene.name}: {found.status.value}", found.converged)
        moving = any(one.state.value != "stuck" for one in found.contacts)
        expect(f"{scene.name}: some contact slips: {moving}", moving == slips)
        return Answer(value=found.max_abs)

    return call


def _swept(scene: Any) -> Callable[[], Answer]:
    """Return the call that sweeps a scene over its band with the default settings."""
    import solver

    def call() -> Answer:
        branch = solver.sweep(scene)
        expect(f"{scene.name}: {branch.status.value}", branch.reached)
        return Answer(value=branch.peak.value)

    return call


def _shipped_sweep(name: str) -> Callable[[], Callable[[], Answer]]:
    def prepare() -> Callable[[], Answer]:
        import solver

        return _swept(solver.load_scene(name))

    return prepare


def _masses_sweep(count: int, law: str) -> Callable[[], Callable[[], Answer]]:
    def prepare() -> Callable[[], Answer]:
        from benchmarks.space import masses

        return _swept(masses(count, law))

    return prepare


@row("case-a", "case A, a response", 0.0032, runs=41)
def _response_of_case_a() -> Callable[[], Answer]:
    from benchmarks.problems import case_a

    return _swept(case_a())


for _name, _goal, _runs in (
    ("two-dof", 0.006, 41), ("bladed-disk", 0.014, 41), ("platform-wedge", 0.4, 3), ("shroud-3d", 0.25, 3),
    ("platform-cylinder", 0.4, 3),
):  # fmt: skip
    row(_name, f"`{_name}`, a response", _goal, runs=_runs)(_shipped_sweep(_name))
for _law, _work, _goals in (
    ("elastic-normal", "moving load", (0.012, 0.15, 3.0)), ("coulomb-3d", "circle", (0.1, 1.2, 12.0)),
):  # fmt: skip
    for _count, _goal in zip((1, 4, 16), _goals, strict=True):
        row(f"{_law}-{_count}", f"{_work}, masses: {_count}, a branch", _goal, runs=21 if _count == 1 else 3)(
            _masses_sweep(_count, _law)
        )


@row("lap-16", "lap joint in space, 16 nodes, H = 3, all stuck, a solve", 0.05, runs=9)
def _lap_of_16() -> Callable[[], Answer]:
    return _solved(lap_joint(16), 100.0, 3, slips=False)


@row("lap-30", "the same, 30 nodes", 0.2, runs=9)
def _lap_of_30() -> Callable[[], Answer]:
    return _solved(lap_joint(30), 100.0, 3, slips=False)


@row("lap-122", "the same, 122 nodes: 366 ports, 733 DOFs (no more than 4 GiB)", 3.0, runs=3)
def _lap_of_122() -> Callable[[], Answer]:
    return _solved(lap_joint(122), 100.0, 3, slips=False)


@row("lap-122-slips", "the same, 30 N: some nodes slip, some open", 60.0, runs=1)
def _lap_that_slips() -> Callable[[], Answer]:
    return _solved(lap_joint(122, amplitude=30.0), 100.0, 3)


@row("lap-122-mode", "a nonlinear mode of 25 points of the same, H = 3, up to 0.0105 √kg m", 60.0, runs=1)
def _mode_of_the_lap() -> Callable[[], Answer]:
    import solver

    scene = lap_joint(122)

    def call() -> Answer:
        # Beyond 0.011 harmonic 1 has less than 0.9 of a², and the curve ends there.
        found = solver.nonlinear_mode(scene, 1, amplitudes=(3e-5, 1.05e-2), harmonics=3, errors=False)
        expect(f"a mode is {found.status.value} after {len(found.points)} points", found.reached)
        return Answer(value=float(found.frequency_hz[-1]))

    return call


@row("contacts-324", "324 contacts in space on 40 modes, H = 11, a solve", 5.0, runs=3)
def _many_contacts() -> Callable[[], Answer]:
    from benchmarks.space import plate

    return _solved(plate(324), 1.1, 11)


@row("rigid-damper", "rigid damper, 2 × 25 points, 2 blades of 20 modes, H = 7, a branch", 1.5, runs=3)
def _rigid_damper() -> Callable[[], Answer]:
    from benchmarks.space import damper
    from solver import ContinuationSettings
    from solver.balance.balance import build
    from solver.balance.workspace import Workspace
    from solver.continuation.branches.sweep import walk_branch

    scene = damper()
    balance, (low, high) = build(scene, harmonics=7), scene.observe.band

    def call() -> Answer:
        workspace = Workspace.of(balance)
        start = workspace.solve(balance.parameter.inside(low))
        expect("the start converges", start.converged)
        stretches = list(walk_branch(workspace, low, high, ContinuationSettings(), start.u))
        expect(f"the branch ends {stretches[-1].status}", stretches[-1].status.name == "COMPLETED")
        return Answer(value=float(abs(stretches[-1].solutions[-1][:-1]).max()))

    return call


def _of_the_mesh(day: str, step: str) -> Callable[[], Callable[[], Answer]]:
    """A step of the day with a mesh; what it finds is equal to three digits, however the mesh is reduced."""

    def prepare() -> Callable[[], Answer]:
        from benchmarks.mesh_day import steps

        call = steps(day)[step]

        def timed() -> Answer:
            found = call()
            size = found.peak.value if step == "sweep" else found.max_abs if step == "solve" else 1.0
            return Answer(value=float(f"{size:.3g}"))

        return timed

    return prepare


for _day, _step, _goal, _runs in (
    ("56", "import", 10.0, 1), ("56", "solve", 0.5, 5), ("56", "sweep", 8.0, 1),
    ("56", "design with report", 60.0, 1), ("100", "sweep", 25.0, 1), ("100", "design with report", 150.0, 1),
):  # fmt: skip
    row(f"mesh-{_day}-{_step.split()[0]}", f"mesh with {_day} pairs, H = 5: {_step}", _goal, runs=_runs)(
        _of_the_mesh(_day, _step)
    )


def _mistuned_fe_disk() -> Any:
    """Return the shipped disk of finite elements with loads that differ from blade to blade."""
    import numpy as np

    import solver
    from solver.scene.cyclic.annulus import annulus

    scene = annulus(solver.load_scene("fe-disk"))
    factors = 1.0 + 0.1 * np.random.default_rng(1).normal(size=len(scene.contacts))
    loads = {f"{one.name}.N0": 50.0 * float(by) for one, by in zip(scene.contacts, factors, strict=True)}
    return scene.with_values(loads)


@row(
    "fe-disk-solve", "`fe-disk` mistuned (48 contacts, 24 sectors), H = 5, a point from nothing", 1.0, runs=3
)
def _disk_from_nothing() -> Callable[[], Answer]:
    return _solved(_mistuned_fe_disk(), 172.0, 5)


@row("fe-disk-branch", "the same, a point along a branch", 0.2, runs=1)
def _disk_along_a_branch() -> Callable[[], Answer]:
    import solver

    scene = _mistuned_fe_disk()

    def call() -> Answer:
        branch = solver.sweep(scene, start=170.0, stop=174.0, harmonics=5)
        expect(f"the branch is {branch.status.value}", branch.reached)
        return Answer(value=branch.peak.value, parts=len(branch.values))

    return call


def _mistuned_disks(blades: int, disks: int, study: int) -> Callable[[], Callable[[], Answer]]:
    """Every blade's peak of some disks; the figure is the minutes of a study on two cores of these costs."""

    def prepare() -> Callable[[], Answer]:
        import solver
        from benchmarks.mistuned import HARMONICS, disk_of

        drawn = [disk_of(blades, seed=10 + k) for k in range(disks)]
        solver.blade_peaks(drawn[0], 600.0, 620.0, harmonics=HARMONICS, every_branch=False)

        def call() -> Answer:
            begun = time.process_time()
            found = [solver.blade_peaks(disk, harmonics=HARMONICS, every_branch=False) for disk in drawn]
            each = (time.process_time() - begun) / disks
            expect("all peaks are known", all(peaks.reached for peaks in found))
            return Answer(value=sum(peaks.largest for peaks in found), figure=each * study / 120.0)

        return call

    return prepare


for _blades, _disks, _study, _goal in ((8, 50, 1000, 3.0), (24, 4, 100, 2.5)):
    row(
        f"mistuned-{_blades}", f"{_study} mistuned disks of {_blades} blades, H = 5, every blade, two cores",
        _goal, unit="min", runs=0,
    )(_mistuned_disks(_blades, _disks, _study))  # fmt: skip


def _cold(*arguments: str) -> Callable[[], Callable[[], Answer]]:
    """A process of the command from its start to its end, kernels cached."""

    def prepare() -> Callable[[], Answer]:
        # Of a checkout from before the command had a process of its own, `main` is that.
        start = "import sys; from service import cli; sys.exit(getattr(cli, 'process', cli.main)())"

        def call() -> Answer:
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            done = subprocess.run(
                [sys.executable, "-c", start, *arguments], check=False, stdout=subprocess.DEVNULL
            )
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            expect(f"{' '.join(arguments)} ends well", done.returncode == 0)
            spent = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
            return Answer(value=1.0, figure=spent)

        return call

    return prepare


for _arguments, _goal in (("solve two-dof --frequency 1", 0.5), ("--help", 0.1)):
    row(f"cold-{_arguments.split()[0].strip('-')}", f"`stickslip {_arguments}`, cold", _goal, runs=9)(
        _cold(*_arguments.split())
    )


def _forecast_scenes() -> list[tuple[Any, int]]:
    """Return scenes of all classes, each with its harmonics."""
    import solver
    from benchmarks.problems import chain, graded_chain
    from benchmarks.space import damper, masses, plate

    shipped = ("two-dof", "bladed-disk", "shroud-3d", "platform-wedge", "platform-cylinder", "fe-disk")
    return [
        *((solver.load_scene(name), 11) for name in shipped),
        (chain(8, sliders=True), 11), (chain(32, sliders=True), 5), (graded_chain(100), 7),
        (masses(4, "elastic-normal"), 11), (masses(16, "elastic-normal"), 7), (masses(4, "coulomb-3d"), 11),
        (masses(16, "coulomb-3d"), 5), (damper(25), 7), (plate(100), 5), (plate(324), 5), (lap_joint(16), 3),
        (lap_joint(30), 3), (lap_joint(60, amplitude=30.0), 3), (_mistuned_fe_disk(), 5),
    ]  # fmt: skip


@row("forecast", "`plan`'s forecast of a point of a branch, 9 of 10 scenes", 2.0, unit="× off", runs=0)
def _forecasts() -> Callable[[], Answer]:
    import solver
    from solver.balance.balance import build
    from solver.balance.workspace import Workspace
    from solver.continuation.branches.sweep import walk_branch

    def call() -> Answer:
        off = []
        for scene, harmonics in _forecast_scenes():
            low, high = scene.observe.band
            told = solver.plan(scene, harmonics=harmonics).seconds_a_point
            workspace = Workspace.of(build(scene, harmonics=harmonics))
            start = workspace.solve(2.0 * math.pi * low)
            expect(f"{scene.name}: the start converges", start.converged)
            for _ in range(2):  # the first loads what it calls
                begun, spent, points = time.process_time(), 0.0, 0
                for stretch in walk_branch(workspace, low, high, solver.ContinuationSettings(), start.u):
                    points += len(stretch.solutions)
                    spent = time.process_time() - begun
                    if spent > ENOUGH:
                        break
                if spent > ENOUGH:
                    break
            off.append(max(told * points / spent, spent / points / told))
            print(f"{scene.name}: {told:.2g} s foretold, {spent / points:.2g} s", file=sys.stderr, flush=True)
        return Answer(value=1.0, figure=sorted(off)[math.ceil(0.9 * len(off)) - 1])

    return call


def _designed(scene: Any, wanted: dict[str, Any], *, robust: bool = False) -> Callable[[], Answer]:
    """Return the call that designs a scene."""
    import optim

    def call() -> Answer:
        found = (optim.robust_design if robust else optim.design)(scene, **wanted)
        expect(f"{scene.name} has an optimum", math.isfinite(found.objective if robust else found.peak.value))
        return Answer(
            value=found.objective if robust else found.evaluation.objective,
            responses=found.responses if robust else found.evaluations,
        )

    return call


def _wedge(low: float, high: float) -> Callable[[], Answer]:
    import solver

    wanted = {"variables": {"wedge.mass": (low, high)}, "harmonics": 3}
    return _designed(solver.load_scene("platform-wedge"), wanted)


@row("design-wedge-005", "design of `wedge.mass`, 4 contact points, H = 3, 0.005 to 0.05 kg", 8.0, runs=1)
def _wedge_design() -> Callable[[], Answer]:
    return _wedge(0.005, 0.05)


@row("design-wedge-001", "the same, 0.001 to 0.03 kg", 8.0, runs=1)
def _light_wedge_design() -> Callable[[], Answer]:
    return _wedge(0.001, 0.03)


def _five_variables(name: str) -> Callable[[], Callable[[], Answer]]:
    def prepare() -> Callable[[], Answer]:
        import solver
        from benchmarks.designing import FIVE

        variables, limits = FIVE[name]
        return _designed(solver.load_scene(name), {"variables": variables, **limits})

    return prepare


for _name in ("two-dof", "bladed-disk"):
    row(f"design-five-{_name}", f"design of `{_name}`: five variables, three criteria", 3.0, runs=2)(
        _five_variables(_name)
    )


@row("design-robust", "robust design of `bladed-disk`: kt and mu in intervals", 4.0, runs=2)
def _robust_design() -> Callable[[], Answer]:
    import solver
    from benchmarks.designing import UNCERTAIN

    return _designed(solver.load_scene("bladed-disk"), UNCERTAIN, robust=True)


@row("design-cases", "design of two masses: two variables, three cases, a limit on the band", 5.0, runs=2)
def _design_of_cases() -> Callable[[], Answer]:
    from benchmarks.designing import CASES
    from benchmarks.problems import case_a

    return _designed(case_a(), CASES)


def classes() -> None:
    """Every class of work beside its goal: `python -m benchmarks.classes --help` has rows and ratios."""
    _print_table(list(ROWS), [])


def serve() -> None:
    """Answer with cost, result and memory of one call for each name of a row."""
    calls: dict[str, Callable[[], Answer]] = {}
    for line in sys.stdin:
        name = line.rstrip("\n")
        if name not in calls:
            calls[name] = ROWS[name].prepare()
        begun = time.process_time()
        found = calls[name]()
        spent = (time.process_time() - begun) / found.parts
        mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MIB
        figure = spent if found.figure is None else found.figure
        answer = {"figure": figure, "value": found.value, "mib": mib, "responses": found.responses}
        print(json.dumps(answer), flush=True)


def _measure(which: Row, folders: list[Path]) -> tuple[str, ...]:
    """Return a line of the table: a row in all checkouts, ours the first."""
    sides = [Checkout(folder, "benchmarks.classes") for folder in folders]
    found = [[side.ask(which.name, PATIENCE)] for side in sides]
    for _ in range(which.runs):
        for side, answers in zip(sides, found, strict=True):
            if answers[0] is not None and answers[0]["figure"] <= WARM:
                answers.append(side.ask(which.name, PATIENCE))
    for side in sides:
        side.close()
    ours = found[0][-1]
    expect(f"{which.name}: no answer after {PATIENCE:g} s", ours is not None)
    assert ours is not None
    figures = []
    for answers in found:
        warm = [each["figure"] for each in answers[1:] or answers if each is not None]
        figures.append(statistics.median(warm) if warm else math.nan)
        for each in answers:
            off = 0.0 if each is None else abs(each["value"] / ours["value"] - 1.0)
            expect(f"{which.name}: results are {off:.1e} apart", off <= AGREE)
    ratios = [
        (f"{each:.3g} ({each / figures[0]:.1f} ×)" if each == each else f"died or > {PATIENCE:g} s")
        + _responses(answers[-1])
        for each, answers in zip(figures[1:], found[1:], strict=True)
    ]
    met = "yes" if figures[0] <= which.goal else "no"
    return (
        which.name, which.work, f"{which.goal:g} {which.unit}", f"{figures[0]:.3g}" + _responses(ours), met,
        f"{ours['mib']:.0f}", *ratios,
    )  # fmt: skip


def _responses(answer: dict[str, Any] | None) -> str:
    """Return in words how many responses a design took."""
    responses = None if answer is None else answer.get("responses")
    return "" if responses is None else f", {responses} responses"


def _print_table(names: list[str], others: list[Path]) -> None:
    """Print the rows of some names."""
    here = Path(__file__).resolve().parents[1]
    folders = [here, *(folder.resolve() for folder in others)]
    lines = [_measure(ROWS[name], folders) for name in names]
    header = ("row", "work", "goal", "figure", "met", "MiB", *(folder.name for folder in folders[1:]))
    table("Every class at its cost [of the process, one thread, warm, medians]", header, lines)


def main() -> None:
    """Print the table, or some of its rows, beside other checkouts."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.classes", description=__doc__)
    parser.add_argument(
        "--row", nargs="+", choices=ROWS, default=list(ROWS), metavar="NAME", help=", ".join(ROWS)
    )
    parser.add_argument("--against", nargs="+", type=Path, default=[], metavar="FOLDER")
    asked = parser.parse_args()
    _print_table(asked.row, asked.against)


if __name__ == "__main__":
    main()
