"""What people read of a robust design, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from solver.results import units
from solver.results.known import known_pairs
from solver.results.measures import Measured
from solver.results.order_statistics import quantile_words
from solver.results.told import Block, ResultTable, Summary
from solver.scene.parameter_paths import parameter

Json = Mapping[str, Any]

_UNKNOWN = "not known"


def robust(found: Json) -> Iterator[Block]:
    """The nominal and the robust optimum side by side, and the scenarios that make the difference."""
    sides = [(name, found[name]) for name in ("nominal", "robust") if found[name] is not None]
    rows: list[tuple[str, ...]] = []
    if sides:
        for path in sides[0][1]["values"]:
            rows.append((path, *(parameter(path, side["values"][path]) for _, side in sides)))
        rows += [(name, *(show(side) for _, side in sides)) for name, show in SIDE_LINES]
    aim = found["aim"] if found["quantile"] is None else f"{100.0 * found['quantile']:g} % {found['aim']}"
    title = f"Robust damper of {found['scene']}, {aim}"
    columns = ("", *(f"{name} optimum" for name, _ in sides))
    yield ResultTable(title, columns, rows)
    said = "; ".join(f"{name} {what}" for name, what in uncertain_rows(found["uncertain"]))
    yield Summary("", [*Measured.of_result(found).pairs, ("uncertain", said), *effort_pairs(found)])
    held = [cut for cut in found["cuts"] if abs(cut["multiplier"]) > 1e-6]
    if held:
        yield ResultTable(
            "Scenarios that hold the robust optimum", ("scenario", "multiplier"),
            [(cut["scenario"]["words"], units.number(cut["multiplier"])) for cut in held],
        )  # fmt: skip


def effort_pairs(found: Json) -> list[tuple[str, str]]:
    """What was gained, how well the search closed, and what it took."""
    pairs: list[tuple[str, str]] = []
    if found["gain"] is not None:
        pairs.append(
            ("gain", f"the robust worst peak is {100.0 * found['gain']:.3g} % below the nominal one")
        )
    if found["gap"] is not None:
        whole = ", after a look at the whole uncertainty" if found.get("inner_look") else ""
        pairs.append(("gap of the cuts", f"{found['gap']:.1e}{whole}"))
    if found["optimality"] is not None:
        pairs.append(("KKT residual", f"{found['optimality']:.1e}"))
    pairs += (known := known_pairs(found))
    said = {words for _, words in known}
    pairs += [("warning", words) for words in found.get("warnings", ()) if words not in said]
    if found["unknown"] is not None:
        pairs.append(("no response", found["unknown"]["words"]))
    effort = f"{found['designs']} designs, {found['responses']} frequency responses"
    return [*pairs, ("effort", f"{effort} in {units.duration(found['seconds'])}")]


def uncertain_rows(found: Json) -> list[tuple[str, str]]:
    """What is not known, each with how."""
    said: list[tuple[str, str]] = []
    for one in found.get("parameters", ()):
        low, high, how = one["low"], one["high"], one["how"]
        if how == "relative deviation":
            said.append((one["path"], f"{100.0 * low:+.4g} to {100.0 * high:+.4g} %"))
        elif how == "deviation":
            said.append((one["path"], f"{low:+.4g} to {high:+.4g} from the design"))
        else:
            ends = [parameter(one["path"], end) for end in (low, high)]
            said.append((one["path"], f"from {ends[0]} to {ends[1]}"))
    if "samples" in found:
        said.append(("samples", str(len(found["samples"]))))
    if "disks" in found:
        said.append(("mistuned disks", str(len(found["disks"]))))
    if "mistuning" in found:
        of, within = found["mistuning"]["of"], 100.0 * found["mistuning"]["within"]
        said.append((f"{', '.join(of)} of every blade", f"within {within:.4g} % of the tuned one"))
    return said


def _length(value: float | None) -> str:
    return _UNKNOWN if value is None else units.length(value)


def _quantile(side: Json, share: float) -> str:
    found = [one for one in side["samples"]["quantiles"] if one["share"] == share]
    return quantile_words(found[0], "peak", "samples", units.length) if found else _UNKNOWN


SIDE_LINES: tuple[tuple[str, Callable[[Json], str]], ...] = (
    ("peak, nothing uncertain", lambda side: _length(side["peak"]["value"])),
    ("worst peak", lambda side: _length(None if side["worst"] is None else side["worst"]["peak"])),
    ("in the scenario", lambda side: "" if side["worst"] is None else side["worst"]["scenario"]["words"]),
    ("mean of the samples", lambda side: _length(side["samples"]["mean"])),
    ("95 % of the samples below", lambda side: _quantile(side, 0.95)),
    ("keeps the limits", lambda side: "yes" if side["feasible"] else "no"),
)
