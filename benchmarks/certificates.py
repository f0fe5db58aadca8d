"""What a proof costs, and how many random scenes are proved."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import stickslip
from benchmarks.harness import table

SCENES, WORK = 500, 600.0  # looked at; allowed to each, in millions of products of balls
SIZES = ((2, 1), (5, 2), (10, 4), (20, 8))  # masses, contacts
TRIES = 5
NARROW = 1e-15
GROUPS = ((1, 1), (2, 3), (4, 8))  # contacts, from and to


class Tried(NamedTuple):
    """A random scene, and how the proof of its response ended."""

    masses: int
    contacts: int
    events: int
    seconds: float
    why: str


def certificates(folder: Path | None = None, scenes: int = SCENES) -> None:
    """Proofs of responses: processor time by size, and the share of random scenes (--scenes of them)."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "cases"))
    from certified_scenes import random_scene

    print("masses, contacts: processor time of a proof (ms), of the balance, events")
    for masses, contacts in SIZES:
        for seed in range(TRIES):
            scene, hz = random_scene(seed, masses, contacts)
            begun = time.process_time()
            found = stickslip.solve(scene, frequency_hz=hz, harmonics=21)
            solved = time.process_time()
            proof = stickslip.certify(found)
            took, balance = 1e3 * (time.process_time() - solved), 1e3 * (solved - begun)
            print(f"{masses:3d} {contacts:2d}: {took:8.1f} {balance:8.1f} {proof.events:4d} {_why(proof)}")
    rows = list[Tried]()
    for seed in range(scenes):
        scene, hz = random_scene(seed)
        found = stickslip.solve(scene, frequency_hz=hz, harmonics=21)
        started = time.process_time()
        proof = stickslip.certify(found, most_work=WORK)
        took = time.process_time() - started
        rows.append(Tried(len(scene.dofs), len(scene.contacts), proof.events, took, _why(proof)))
        if rows[-1].why != "proved":
            print(f"scene {seed}: {len(scene.contacts)} contacts, {hz:.4g} Hz: {rows[-1].why}", flush=True)
    told(rows, folder)


def told(rows: Sequence[Tried], folder: Path | None) -> None:
    """Print the share proved by the number of contacts, and draw the time over the events."""
    shown: list[tuple[str, ...]] = []
    for low, high in (*GROUPS, (GROUPS[0][0], GROUPS[-1][1])):
        own = [row for row in rows if low <= row.contacts <= high]
        proved = [row for row in own if row.why == "proved"]
        seconds = np.array([row.seconds for row in proved])
        shown.append(
            (f"{low} to {high}", f"{len(own)}", f"{len(proved)}", f"{100.0 * len(proved) / len(own):.1f} %",
             f"{np.median(seconds):.3f}", f"{np.quantile(seconds, 0.9):.2f}", f"{seconds.max():.1f}")
        )  # fmt: skip
    names = ("contacts", "scenes", "proved", "share", "median [s]", "90 % [s]", "most [s]")
    table("Random scenes with a proof, processor time", names, shown)
    if folder is not None:
        _draw(rows, folder)


def _draw(rows: Sequence[Tried], folder: Path) -> None:
    from matplotlib.figure import Figure

    from solver.views.plots.style import BLUE, VERMILION, plain_log, styled

    with styled():
        page: Any = Figure(figsize=(5.6, 3.4), layout="constrained")
        axes = page.subplots()
        for proved, colour, mark in ((True, BLUE, "o"), (False, VERMILION, "x")):
            own = [row for row in rows if (row.why == "proved") == proved]
            label = f"{'proved' if proved else 'not proved'} ({len(own)})"
            axes.plot([row.events for row in own], [row.seconds for row in own], mark, color=colour,
                      markersize=4.0, linestyle="none", label=label)  # fmt: skip
        axes.set(xlabel="changes of a contact's state in a period", ylabel="processor time of the proof [s]")
        axes.set_xscale("symlog", linthresh=1.0)
        axes.set_yscale("log")
        axes.set_xticks([0, 1, 3, 10, 30, 100], ["0", "1", "3", "10", "30", "100"])
        plain_log(axes.yaxis)
        axes.minorticks_off()
        axes.legend()
        page.savefig(folder / "certificates.png", dpi=90)


def _why(proof: stickslip.solutions.Certificate) -> str:
    """Return why a response is not proved."""
    low, high = proof.half_peak_to_peak
    if proof.reached and high - low > NARROW * high:
        return f"the enclosure is {(high - low) / high:.1e} wide"
    return "proved" if proof.reached else proof.reason or proof.status.value


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.certificates", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="where the picture goes; none if left out")
    parser.add_argument("--scenes", type=int, default=SCENES, help="how many random scenes are looked at")
    certificates(**vars(parser.parse_args()))
