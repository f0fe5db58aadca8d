"""What people read of a Campbell diagram, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.rendering.tables.text import print_pairs, print_table
from solver.results import units
from solver.results.known import known_pairs


def diagram(found: Mapping[str, Any]) -> None:
    """The crossings, and what every order does at running speeds."""
    low, high = found["speeds_rpm"][0]
    title = f"{found['scene']}, {low:g} to {high:g} rpm, {found['n_harmonics']} harmonics"
    rows = [
        (
            str(order["order"]), f"{crossing['speed_rpm']:.6g}", f"{crossing['frequency_hz']:.6g}",
            _amplitude(crossing),
            "running speed" if crossing["inside"] else f"{100.0 * crossing['margin']:.3g} % away",
        )
        for order in found["orders"]
        for crossing in order["crossings"]
    ]  # fmt: skip
    print_table(title, ("order", "crossing [rpm]", "peak [Hz]", "amplitude", ""), rows, right="0123")
    pairs = []
    for order in found["orders"]:
        pairs.append((f"order {order['order']}", _running(order)))
        for what, name in (("stuck_hz", "all stuck"), ("open_hz", "all open")):
            pairs.append((f"  {name}", ", ".join(f"{value:.5g}" for value in order[what]) + " Hz"))
    reasons = (o["peak_certificate"] for o in found["orders"] if "peak_certificate" in o)
    open_ends = dict.fromkeys(one["reason"] for one in reasons if not one["known"])
    pairs += [("warning", f"a response may have further peaks. {reason}") for reason in open_ends]
    pairs += known_pairs(found, besides=("peaks_open",))
    words = {True: "no", False: "yes", None: "unknown"}[found["clear"]]
    what = "a peak" if found["limit"] is None else f"more than {units.length(found['limit'])}"
    pairs.append((f"{what} at a running speed", words))
    pairs.append(("time", units.duration(found["seconds"])))
    print_pairs("", pairs)


def _amplitude(crossing: Mapping[str, Any]) -> str:
    """An amplitude with its estimated error; of an earlier version without."""
    error, height = crossing.get("error_estimate"), crossing["amplitude"]
    if error is None:
        return units.length(height) + (" ± not known" if "error_estimate" in crossing else "")
    unit = units.length_unit(height)
    return f"{units.number(height * unit.per_metre)} ± {units.number(error * unit.per_metre, 2)} {unit.name}"


def _running(order: Mapping[str, Any]) -> str:
    """What one order does at running speeds, in words."""
    highest = order["highest_running"]
    text = "no response at running speeds"
    if highest is not None:
        text = f"at most {_amplitude(highest)}, at {highest['speed_rpm']:.6g} rpm"
    over = ", ".join(f"{low:.6g} to {high:.6g}" for low, high in order["exceeded_running_rpm"])
    if over:
        text += f"; above {units.length(order['limit'])} from {over} rpm"
    return text
