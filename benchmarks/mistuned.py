"""What a mistuned disk costs whose every blade's peak is looked for."""

from __future__ import annotations

import time

import solver
from benchmarks.harness import check, expect, table

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
