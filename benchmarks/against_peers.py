"""Responses and designs of chains with sliders, beside what other codes take for the same."""

from __future__ import annotations

from dataclasses import dataclass

import optim
import solver
from benchmarks.harness import Timing, check, expect, table, timed
from benchmarks.limits import HEADER, distance
from benchmarks.optima import tracked_optima
from benchmarks.peers import HOW, QUOTED, PeerRun, interpreter, pyharm
from benchmarks.problems import BAND, case_a, chain
from solver import Branch, Scene

TRUE_PEAK, TRUE_AT = 10.2358, 1.01436  # m, Hz: case A by time marching
# N, m: case A; other codes say 345 to 346 N and 6.7597 m, time marching that 344.94 N is lower than 345.5 N.
BEST_LOAD, BEST_PEAK = 344.942, 6.75958
LONG_PEAK, LONG_AT = 20.178, 1.0045  # m, Hz: all masses in step; three codes, the frequency of a point
FINE_STEP = 0.25  # pyHarm's arc length for about 225 points of case A


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One problem: our response, what was wanted, and what pyHarm takes."""

    name: str
    branch: Branch
    timing: Timing
    wanted: str
    peak: str
    peer: PeerRun | None
    same_band: bool = True

    def cells(self) -> tuple[str, ...]:
        """Return the columns of the table of responses."""
        points = len(self.branch.values)
        mine, peer = self.timing.cpu, self.peer
        ratio, theirs = "", ""
        if peer is not None:  # over another band only the time of a point compares
            theirs = f"{1e3 * peer.cpu_seconds:.0f} ms, {peer.points} points"
            each = (peer.cpu_seconds / peer.points) / (mine / points)
            ratio = f"{each:.0f} a point"
            if self.same_band:
                ratio = f"{peer.cpu_seconds / mine:.0f} ({ratio})"
        return (
            self.name, str(points), f"{1e3 * mine:.2f}", f"{1e3 * self.timing.least:.2f}",
            f"{1e3 * mine / points:.4f}", self.wanted, theirs, ratio, self.peak,
        )  # fmt: skip


HEADER_ROWS = (
    "response", "points", "ms (process)", "ms (wall)", "ms a point", "wanted", "pyHarm, here", "times faster",
    "peak",
)  # fmt: skip


def _show(title: str, row: Row) -> None:
    table(title, HEADER_ROWS, [row.cells()])
    parts = distance(row.branch, row.timing.cpu).cells()
    table("Distance to the least a point can cost", ("response", *HEADER), [(row.name, *parts)])
    if interpreter() is None:
        print(HOW)


def _quote(*names: str) -> None:
    rows = [(name, q.pyharm, q.tmdsimpy, q.nlvib, q.nlvib_py) for name, q in QUOTED.items() if name in names]
    header = ("measured elsewhere", "pyHarm 1.2.2", "tmdsimpy", "NLvib 1.3", "NLvib-py")
    table("Other codes, another machine, one thread", header, rows)


def _response(scene: Scene, runs: int) -> tuple[Branch, Timing]:
    """Time a whole response; it must be complete, every point converged."""
    branch = solver.sweep(scene)
    expect(f"{scene.name}: {branch.status.value}", branch.reached)
    expect(f"{scene.name}: residual {branch.residuals.max():.1e}", bool(branch.residuals.max() <= 1e-9))
    return timed(lambda: solver.sweep(scene), runs=runs, warm_up=0)


def _against_marching(branch: Branch, rel: float) -> str:
    """Check the peak of a branch with a march at its frequency, by half peak-to-peak."""
    peak = branch.peak
    expect("the branch has a peak", peak is not None)
    solution = solver.solve(branch.balance.scene, frequency_hz=peak.at, harmonics=branch.balance.n_harmonics)
    check("solved again", solution.max_abs, peak.value, 1e-8)
    marched = solver.march(branch.balance.scene, frequency_hz=peak.at)
    expect(f"march: {marched.status.value}", marched.converged)
    return check("half peak-to-peak", solution.half_peak_to_peak, marched.half_peak_to_peak, rel)


def case_a_response() -> None:
    """Case A: the response from 0.2 to 2.5 Hz at 11 harmonics."""
    scene = case_a()
    branch, timing = _response(scene, 21)
    expect("the branch has a peak", branch.peak is not None)
    check("frequency of the peak", branch.peak.at, TRUE_AT, 1e-4)
    peak = check("peak of case A", branch.peak.value, TRUE_PEAK, 1e-4)
    peer = pyharm(scene, step=FINE_STEP, runs=2)
    if peer is not None:
        check("pyHarm's highest point", peer.peak, TRUE_PEAK, 1e-3)
    _show(
        f"Case A, {BAND[0]} to {BAND[1]} Hz",
        Row(name="case A, H = 11", branch=branch, timing=timing, wanted="10 ms", peak=peak, peer=peer),
    )
    _quote("case A, H = 11: s (points)", "case A, fewest points: s (points)")


def chain_of_8() -> None:
    """Eight masses with a slider on each."""
    scene = chain(8, sliders=True)
    branch, timing = _response(scene, 5)
    check("frequency of the peak", branch.peak.at, LONG_AT, 2e-4)
    check("peak, as of a longer chain", branch.peak.value, LONG_PEAK, 1e-4)
    peak = _against_marching(branch, 1e-5)
    _show(
        "Chain of 8 masses and 8 sliders, H = 11",
        Row(name="8 masses, 8 sliders", branch=branch, timing=timing, wanted="1 ms a point", peak=peak,
            peer=pyharm(scene, step=1.0, warm_up=0)),
    )  # fmt: skip
    _quote("chain of 8, 8 sliders: ms a point")


def chain_of_32() -> None:
    """Thirty-two masses with a slider on each."""
    branch, timing = _response(chain(32, sliders=True), 2)
    check("frequency of the peak", branch.peak.at, LONG_AT, 2e-4)
    peak = check("peak", branch.peak.value, LONG_PEAK, 1e-4)
    _show(
        "Chain of 32 masses and 32 sliders, H = 11 (pyHarm takes minutes: figures below)",
        Row(name="32 masses, 32 sliders", branch=branch, timing=timing, wanted="4 s", peak=peak, peer=None),
    )
    _quote("chain of 32, 32 sliders: s")


def one_slider() -> None:
    """Thirty-two masses with one slider."""
    scene = chain(32, sliders=False)
    branch, timing = _response(scene, 5)
    peak = _against_marching(branch, 1e-4)
    band = (0.95, 1.0)
    _show(
        f"Chain of 32 masses with one slider, H = 11 (pyHarm from {band[0]} to {band[1]} Hz only)",
        Row(name="32 masses, one slider", branch=branch, timing=timing, wanted="0.15 ms a point", peak=peak,
            peer=pyharm(scene, step=1.0, band=band, warm_up=0)),
    )  # fmt: skip
    _quote("chain of 32, one slider: ms a point")


def optimum() -> None:
    """The best constant load of case A, and the optima of the shipped scenes in units of a response."""
    result, timing = timed(lambda: optim.design(case_a(), variables={"damper.N0": (20.0, 3000.0)}), runs=3)
    load = result.optimum["damper.N0"]
    check("best load of case A", load, BEST_LOAD, 1e-4)
    peak = check("peak at the best load", result.peak.value, BEST_PEAK, 1e-6)
    least, tracked = timed(lambda: solver.least_peak(case_a(), "damper.N0", 20.0, 3000.0), runs=9)
    expect(f"least_peak: {least.status.value}", least.status is solver.TrackStatus.TRACKED)
    check("best load of case A, tracked", least.at, BEST_LOAD, 1e-4)
    rows = [
        ("optim.design, 20 to 3000 N", f"{load:.3f}", peak, str(result.evaluations),
         f"{1e3 * timing.cpu:.1f}", f"{1e3 * timing.least:.1f}", "50"),
        ("solver.least_peak, 20 to 3000 N", f"{least.at:.3f}",
         check("peak at the best load, tracked", least.peak, BEST_PEAK, 1e-6), str(least.sweeps),
         f"{1e3 * tracked.cpu:.1f}", f"{1e3 * tracked.least:.1f}", "50"),
    ]  # fmt: skip
    header = ("how", "N0 N", "peak", "responses", "ms (process)", "ms (wall)", "wanted ms")
    table("Best constant load of case A", header, rows)
    tracked_optima()
    _quote("best constant N0 of case A: s")
