"""What people read of a study of mistuned disks, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.rendering.tables.robust import quantile_words
from service.rendering.tables.text import print_pairs
from solver.results import units
from solver.results.known import known_pairs


def _errors(found: Mapping[str, Any]) -> str:
    """How well the mean is known: by the error of the peaks, and as that of a few disks of all."""
    by_peaks, by_disks = found.get("mean_error"), found.get("standard_error")
    of_peaks = "" if by_peaks is None else f", known to {by_peaks:.2g} by the error of the peaks"
    return of_peaks + ("" if by_disks is None else f", standard error {by_disks:.2g} by the number of disks")


def report(found: Mapping[str, Any]) -> None:
    """The amplitude magnification over the disks, and the worst of them."""
    disks, tuned, worst = found["samples"], found["tuned"], found["worst"]
    title = f"{found['scene']}, {len(disks)} disks, spread {found['spread']:g} of {', '.join(found['of'])}"
    pairs = []
    if tuned["peak"] is not None:
        height = units.length(tuned["peak"])
        pairs.append((f"tuned, max |{found['dof']}|", f"{height} at {tuned['at_hz']:.6g} Hz"))
    if found["mean"] is not None:
        pairs.append(("magnification", f"{found['mean']:.4g} in the mean{_errors(found)}"))
        if found["deviation"] is not None:
            pairs.append(("  deviation of the disks", f"{found['deviation']:.2g}"))
    pairs += [
        (f"  {100.0 * quantile['share']:g} % below", quantile_words(quantile, "magnification", "disks"))
        for quantile in found["quantiles"]
    ]
    if worst is not None:
        blade, factors = worst["worst_blade"], ", ".join(f"{factor:.4f}" for factor in worst["factors"])
        place = f"blade {blade} at {worst['at_hz'][blade]:.6g} Hz"
        error = worst.get("magnification_error")
        known = "" if error is None else f" ± {error:.2g}"
        pairs.append(
            ("worst", f"{worst['magnification']:.4g}{known}: {units.length(worst['largest'])}, {place}")
        )
        pairs.append(("  its disk", f"seed {worst['seed']}, factors {factors}"))
    pairs += known_pairs(found)
    pairs.append(("time", units.duration(found["seconds"])))
    print_pairs(f"{title}, {found['n_harmonics']} harmonics", pairs)
