"""What a mistuned disk costs whose every blade's peak is looked for."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import solver
from benchmarks.harness import check, expect, table
from stickslip.lab.worst_mistuning.linear_disk import Contacts, linear_disk

OF, SPREAD, HARMONICS = ("tip_middle", "tip"), 0.02, 5
STUDIES = ((8, 20, 1000, "3 min"), (24, 4, 100, "2.5 min"))  # blades, disks here, disks of a study, wanted


def disk_of(blades: int, seed: int) -> solver.Scene:
    """Return a mistuned disk like `bladed-disk` with so many blades."""
    raw = solver.load_scene("bladed-disk").to_dict()
    raw["structure"]["sectors"] = blades
    return solver.mistuned(solver.Scene.from_dict(raw), of=OF, spread=SPREAD, seed=seed)


def mistuned_disks() -> None:
    """Disks of 8 and 24 blades like `bladed-disk`, 500 to 900 Hz at 5 harmonics."""
    rows = []
    for blades, disks, study, wanted in STUDIES:
        drawn = [disk_of(blades, seed=10 + k) for k in range(disks)]
        solver.blade_peaks(drawn[0], 600.0, 620.0, harmonics=HARMONICS, every_branch=False)
        begun = time.process_time()
        found = [solver.blade_peaks(disk, harmonics=HARMONICS, every_branch=False) for disk in drawn]
        each = (time.process_time() - begun) / disks
        expect("all peaks known", all(peaks.largest > 0.0 for peaks in found))
        worst = found[0].worst
        other = drawn[0].model_copy(
            update={"observe": drawn[0].observe.model_copy(update={"dof": f"tip@{worst}"})}
        )
        peak = solver.sweep(other, harmonics=HARMONICS).peak
        expect("there is a peak", peak is not None)
        alone = check("the worst blade, swept alone", found[0].largest, peak.value, 1e-9)
        points = sum(len(peaks.branches[0].values) for peaks in found) / disks
        minutes = f"{each * study / 120.0:.1f} min"
        rows.append(
            (str(blades), str(disks), f"{points:.0f}", f"{each:.2f}", str(study), minutes, wanted, alone)
        )
    header = (
        "blades", "disks", "points", "s a disk (process)", "a study of", "on two cores", "wanted",
        "swept alone",
    )  # fmt: skip
    table("Mistuned disks, the peak of every blade", header, rows)


COUPLING, ZETA, WITHIN, DRAWN, BLADES = 0.001, 2e-6, 0.01, 60, (4, 6, 12, 24)


def ring(blades: int, order: int) -> solver.Scene:
    """Return lightly damped blades on a ring of springs."""
    springs: list[dict[str, Any]] = [
        {"name": "root", "between": ["b", "ground"], "k": 1.0},
        {"name": "ring", "between": ["b", "b@next"], "k": COUPLING},
    ]
    structure = {
        "kind": "cyclic", "sectors": blades, "masses": {"b": 1.0}, "springs": springs,
        "dampers": [{"name": "loss", "between": ["b", "ground"], "c": 2.0 * ZETA}],
    }  # fmt: skip
    force = {"dof": "b", "amplitude": 1.0, "engine_order": order}
    observe = {"dof": "b", "band": [0.155, 0.165]}
    return solver.Scene.from_dict(
        {"name": "ring", "structure": structure, "contacts": [], "excitation": force, "observe": observe}
    )


def worst_patterns() -> None:
    """The worst mistuning within 1 % of lightly damped rings beside Whitehead's bound and random disks."""
    rows = []
    rng = np.random.default_rng(1)
    for blades in BLADES:
        for order in (0, 1, blades // 2):
            scene = ring(blades, order)
            begun = time.process_time()
            found = solver.worst_mistuning(scene, of="root", within=WITHIN)
            seconds = time.process_time() - begun
            expect("a worst pattern", found.worst is not None)
            disk = linear_disk(scene, ("root",), Contacts.OPEN, scene.observe.band, "b")
            patterns = WITHIN * rng.uniform(-1.0, 1.0, (DRAWN, blades))
            drawn = max(disk.peak(delta).value for delta in patterns) / found.tuned_peak
            worst = found.worst.magnification if found.worst else 0.0
            expect("no random disk above the worst", drawn <= worst)
            rows.append(
                (str(blades), str(order), f"{drawn:.3f}", f"{worst:.4f}", f"{found.whitehead:.4f}",
                 f"{100.0 * (worst / found.whitehead - 1.0):+.2f} %", str(found.alike), f"{seconds:.1f}")
            )  # fmt: skip
    header = (
        "blades",
        "engine order",
        f"{DRAWN} random",
        "worst",
        "Whitehead",
        "apart",
        "alike",
        "s (process)",
    )
    table(f"Worst mistuning within {100.0 * WITHIN:g} %", header, rows)
