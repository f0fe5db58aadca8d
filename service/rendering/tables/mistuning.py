"""What people read of a study of mistuned disks, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.rendering.tables.text import print_pairs
from solver.results import units


def report(found: Mapping[str, Any]) -> None:
    """The amplitude magnification over the disks, and the worst of them."""
    disks, tuned, worst = found["samples"], found["tuned"], found["worst"]
    title = f"{found['scene']}, {len(disks)} disks, spread {found['spread']:g} of {', '.join(found['of'])}"
    pairs = []
    if tuned["peak"] is not None:
        height = units.length(tuned["peak"])
        pairs.append((f"tuned, max |{found['dof']}|", f"{height} at {tuned['at_hz']:.6g} Hz"))
    if found["mean"] is not None:
        spread = "" if found["deviation"] is None else f" ± {found['deviation']:.2g}"
        pairs.append(("magnification", f"{found['mean']:.4g}{spread} in the mean"))
    pairs += [
        (f"  {100.0 * quantile['share']:g} % below", f"{quantile['magnification']:.4g}")
        for quantile in found["quantiles"]
    ]
    if worst is not None:
        blade, factors = worst["worst_blade"], ", ".join(f"{factor:.4f}" for factor in worst["factors"])
        place = f"blade {blade} at {worst['at_hz'][blade]:.6g} Hz"
        pairs.append(("worst", f"{worst['magnification']:.4g}: {units.length(worst['largest'])}, {place}"))
        pairs.append(("  its disk", f"seed {worst['seed']}, factors {factors}"))
    pairs.append(("time", units.duration(found["seconds"])))
    print_pairs(f"{title}, {found['n_harmonics']} harmonics", pairs)
