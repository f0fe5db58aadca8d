"""What people read of disks: Campbell and interference diagrams, and mistuned disks, given as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.rendering.tables.robust import quantile_words
from service.rendering.tables.text import print_pairs, print_table
from solver.results import units
from solver.results.known import known_pairs


def campbell(found: Mapping[str, Any]) -> None:
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


_DIRECTIONS = {"standing": "", "both": "", "forward": " forward", "backward": " backward"}
MISSING = "the sector was not reduced for nodal diameters {}: reduce it for all with --engine-order 1"


def interference(found: Mapping[str, Any]) -> None:
    """The frequencies at each nodal diameter, and the orders that meet them."""
    rows = [
        (
            f"{point['diameter']}{_DIRECTIONS[point['wave']]}",
            _listed(point["open_hz"]),
            _listed(point["stuck_hz"]),
        )
        for point in found["diameters"]
    ]
    title = f"{found['scene']}, {found['sectors']} sectors"
    print_table(title, ("nodal diameter", "all open [Hz]", "all stuck [Hz]"), rows, right="012")
    if found["speed_rpm"] is not None:
        _crossings(found)
    pairs = []
    if found["missing"]:
        pairs.append(("warning", MISSING.format(", ".join(map(str, found["missing"])))))
    pairs.append(("time", units.duration(found["seconds"])))
    print_pairs("", pairs)


def _crossings(found: Mapping[str, Any]) -> None:
    rows = [
        (
            str(one["order"]), f"{one['frequency_hz']:.6g}",
            f"{one['diameter']}{'' if one['wave'] == 'standing' else ' ' + one['wave']}", str(one["family"]),
            f"{one['open_hz']:.6g} to {one['stuck_hz']:.6g}",
            "meets it" if one["inside"] else f"{100.0 * one['margin']:.3g} % away",
        )
        for one in found["crossings"]
    ]  # fmt: skip
    title = f"orders within {100.0 * found['within']:g} % of a family at {found['speed_rpm']:g} rpm"
    names = ("order", "frequency [Hz]", "nodal diameter", "family", "open to stuck [Hz]", "")
    print_table(title, names, rows, right="0134")


def _listed(values: list[float]) -> str:
    return "  ".join(f"{value:9.2f}" for value in values) or "none"


def _errors(found: Mapping[str, Any]) -> str:
    """How well the mean is known: by the error of the peaks, and as that of a few disks of all."""
    by_peaks, by_disks = found.get("mean_error"), found.get("standard_error")
    of_peaks = "" if by_peaks is None else f", known to {by_peaks:.2g} by the error of the peaks"
    return of_peaks + ("" if by_disks is None else f", standard error {by_disks:.2g} by the number of disks")


def mistuning(found: Mapping[str, Any]) -> None:
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
