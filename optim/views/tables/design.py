"""What people read of a design, robust or not, and of a front, given as the JSON object a program reads."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from solver.results import units
from solver.results.known import Known, Measured, known_pairs, note_pairs, stable_pairs
from solver.results.order_statistics import quantile_words
from solver.results.told import Block, ResultTable, Summary
from solver.results.units import duration, quantity
from solver.scene.parameter_paths import parameter
from solver.views.tables.responses import proved

Json = Mapping[str, Any]
Pairs = list[tuple[str, str]]

_PRICED = 0.02  # share of a size, rounded down to a power of ten
_COUNTS = 1e-6  # multipliers below this hold nothing
_ROUNDING = 1e-6  # relative excess over a limit up to which it is kept


def design(found: Json) -> Iterator[Block]:
    """The best design, robust if that was asked: what it reaches, what holds it, the other optima."""
    if "nominal" in found:
        yield from robust(found)
        return
    title = f"Best damper of {found['scene']}"
    yield Summary(title if _kept(found) else f"{title}: not all limits can be kept", _pairs(found))
    tables = (_options(found), _limits(found), _active(found), _basins(found), _checked(found))
    yield from (table for table in tables if table is not None)


def _kept(found: Json) -> bool:
    """Whether every limit is kept, to the accuracy of the search."""
    conditions = found.get("conditions")
    return not found.get("broken") or (conditions is not None and conditions["violation"] <= _ROUNDING)


def front(found: Json) -> Iterator[Block]:
    """The points of a front of peak against band with what each costs in terms of the other."""
    points: Sequence[Json] = found["points"]
    hertz = _price(max((point["band_hz"] for point in points), default=1.0))
    metres = _price(min((point["peak"] for point in points), default=1.0))
    knee = None if found["knee"] is None else points[found["knee"]]

    def less(point: Json) -> str:
        return "" if point["slope"] is None else units.length(abs(point["slope"]) * hertz)

    def wider(point: Json) -> str:
        return "" if point["hz_per_metre"] is None else units.hertz(metres * point["hz_per_metre"])

    yield _designs(
        f"Front of {found['scene']}: peak against band",
        points,
        {
            "peak": lambda point: units.length(point["peak"]),
            "error": _error,
            "band": lambda point: units.hertz(point["band_hz"]),
            f"peak for {units.hertz(hertz)} less band": less,
            f"band for {units.length(metres)} less peak": wider,
            "": lambda point: "knee" if point is knee else "",
        },
    )
    pairs = [("not found", f"band of {units.hertz(width)}") for width in found["missed"]]
    pairs += [("end", end["status"]) for end in found["ends"] if not end["reached"]]
    effort = f"{found['evaluations']} designs in {duration(found['seconds'])}"
    yield Summary("", [*Measured.of_result(found).pairs, *pairs, *known_pairs(found), ("effort", effort)])


def _designs(title: str, found: Sequence[Json], columns: Mapping[str, Callable[[Json], str]]) -> ResultTable:
    """A table of designs: their variables, then what is told of each."""
    names = tuple(found[0]["values"]) if found else ()
    rows = [
        (*(parameter(name, one["values"][name]) for name in names), *(show(one) for show in columns.values()))
        for one in found
    ]
    return ResultTable(title, (*names, *columns), rows)


def _yes(so: bool) -> str:
    return "yes" if so else "no"


def _error(point: Json) -> str:
    """The estimated error of the peak of a point; empty of an earlier version."""
    if "error_estimate" not in point:
        return ""
    error = Known.of_result(point).error
    return units.length(error) if math.isfinite(error) else "not known"


def _price(size: float) -> float:
    """A round number, a hundredth of a size or so, in which a change of it is told."""
    return 10.0 ** math.floor(math.log10(_PRICED * size)) if size > 0.0 else 1.0


def values(optimum: Json) -> Pairs:
    """The variables with their units."""
    return [(path, parameter(path, value)) for path, value in optimum.items()]


def amount(value: float | None, unit: str) -> str:
    """A number of a row with its unit; lengths in the one that fits; of a row null has no end."""
    if value is None:
        return "infinite"
    return quantity(value, unit)


def _pairs(found: Json) -> Pairs:
    """What the design is and what it came to."""
    pairs = [*values(found["optimum"]), *_plateau(found), *Measured.of_result(found).pairs]
    peaks: Sequence[Json] = found.get("peaks") or ([found["peak"]] if found["peak"] else [])
    several = len({peak.get("case") for peak in peaks}) > 1
    if any(row["weight"] > 0.0 and row["quantity"] != "peak" for row in found.get("rows", ())):
        pairs.append(("objective", amount(found["objective"], "").strip()))
    unit = Measured.of_result(found).unit
    for index, peak in enumerate(peaks):
        of = f" ({peak['case']})" if several else ""
        name, error = ("further peak", None) if index else ("peak", found.get("error_estimate"))
        pairs.append((name, f"{quantity(peak['value'], unit, error)} at {units.hertz(peak['at'])}{of}"))
    pairs += [*_errors(found), *_curve(found.get("curve"))]
    if found["band_hz"] is not None:
        pairs.append(("band", f"{units.hertz(found['band_hz'])} above {quantity(found['limit'], unit)}"))
    for row in further(found):
        pairs.append((row["quantity"], f"{amount(row['value'], row['unit'])}: {row['what']}"))
    if found["active"]:
        held = found.get("held_by")
        case = f" (of {held['case']})" if held and several else ""
        pairs.append(("held by", "; ".join(found["active"]) + case))
    looked = len(found.get("looked_at", ()))
    if looked:
        ends = len(found.get("basins", ()))
        pairs.append(("looked at", f"{looked} designs over the whole range; {ends} local optima"))
    if "certainty" in found:
        pairs.append(("certain", found["certainty"]))
    pairs += proved(found.get("certificates") or ())
    residual = found.get("optimality")
    if residual is not None:
        pairs.append(("KKT residual", units.number(residual, 2)))
    effort = f"{found['evaluations']} frequency responses in {duration(found['seconds'])}"
    work = found.get("work")
    if work is not None and abs(work - found["evaluations"]) >= 0.5:
        effort += f", the work of {units.number(work, 3)}"
    by = f", method {found['method']}" if "method" in found else ""
    return [*pairs, ("effort", effort + by)]


def _curve(check: Json | None) -> Pairs:
    """What a performance curve is worth: its peak beside the exact one, the estimate, and the time."""
    if check is None:
        return []

    def percent(key: str) -> str:
        return "not known" if check[key] is None else f"{100.0 * check[key]:+.2g} %"

    one = "one curve for all designs" if check["shared"] else f"{check['curves']} curves"
    told = "suffices" if check["suffices"] else "does not suffice"
    spent = f"{duration(check['curve_seconds'])}, estimate {duration(check['correction_seconds'])}"
    saved = check["seconds_saved"]
    return [
        ("performance curve", f"mode {check['mode']}, {one}: off by {percent('error')} here"),
        ("estimated before", f"{percent('estimate')}: {told} for {100.0 * check['tolerance']:g} %"),
        ("time of curves", f"{spent}, a whole response {duration(check['response_seconds'])}"),
        ("time saved", "none" if saved is None or saved <= 0.0 else duration(saved)),
    ]


def further(found: Json) -> list[Json]:
    """The largest row of each criterion that is minimised besides peak and band."""
    rows = [row for row in found.get("rows", ()) if row["weight"] > 0.0]
    largest: dict[str, Json] = {}
    for row in sorted(rows, key=lambda row: row["weight"] * height(row)):
        largest[row["quantity"]] = row
    return [row for name, row in largest.items() if name not in ("peak", "band")]


def height(row: Json) -> float:
    """The value of a row; null has no end."""
    value = row["value"]
    return math.inf if value is None else float(value)


def _plateau(found: Json) -> Pairs:
    """How far other values are as good, and what the design was chosen by among them."""
    ends = [
        (f"{path}, as good", f"{parameter(path, low)} to {parameter(path, high)}")
        for path, (low, high) in found.get("plateau", {}).items()
    ]
    by = found.get("chosen_by")
    return [*ends, ("chosen by", by)] if by else ends


def _errors(found: Json) -> Pairs:
    """What makes numbers doubtful; the error of the peak stands beside it."""
    unknown = found.get("relative_error", 0.0) is None
    pairs = [("estimated error", "not known"), *stable_pairs(found)] if unknown else stable_pairs(found)
    warnings = found.get("warnings", ())
    pairs += [("warning", words) for words in warnings]
    return pairs + [pair for pair in note_pairs(found) if pair[1] not in warnings]


def _checked(found: Json) -> ResultTable | None:
    """The local optima again with more harmonics, where the estimated error is large."""
    checked: Sequence[Json] = found.get("checked", ())
    if not checked:
        return None
    return _designs(
        "Again with more harmonics",
        checked,
        {
            "harmonics": lambda one: str(one["n_harmonics"]),
            "peak": lambda one: "unknown" if one["peak"] is None else units.length(one["peak"]),
            "keeps the limits": lambda one: _yes(one["feasible"]),
        },
    )


def _options(found: Json) -> ResultTable | None:
    """The options of a catalogue, best first."""
    options: Sequence[Json] = found.get("options", ())
    if not options:
        return None
    rows = [
        (
            one["name"],
            "" if one["objective"] is None else units.number(one["objective"], 6),
            ", ".join(parameter(path, value) for path, value in one["values"].items()),
            one["status"],
        )
        for one in options
    ]
    return ResultTable("Options", ("option", "objective", "values", "what became of it"), rows)


def _limits(found: Json) -> ResultTable | None:
    """Every limit: what was asked, what is reached, and what is left or missing."""
    worst: dict[tuple[str, str, str, float], Json] = {}
    for row in found.get("rows", ()):
        if row["bound"] is None:
            continue
        key = (row["quantity"], row["case"], row["what"].partition(" at ")[0], row["bound"])
        if key not in worst or height(row) > height(worst[key]):
            worst[key] = row
    if not worst:
        return None
    several, kept = len({row["case"] for row in worst.values()}) > 1, _kept(found)
    rows: list[tuple[str, ...]] = []
    for row in sorted(worst.values(), key=lambda row: row["bound"] - height(row)):
        left, unit = row["bound"] - height(row), row["unit"]
        left = max(left, 0.0) if kept else left
        by = "" if row["value"] is None else f" by {amount(-left, unit)}"
        holds = f"{amount(left, unit)} left" if left >= 0.0 else f"broken{by}"
        what = f"{row['what']} ({row['case']})" if several else row["what"]
        asked, reached = f"≤ {amount(row['bound'], unit)}", amount(row["value"], unit)
        # A row is kept from above: where larger is better its sign is turned. Older results do not say it.
        if not row.get("smaller_is_better", row["quantity"] != "separation"):
            what = what.removeprefix("-")
            asked, reached = f"≥ {amount(0.0 - row['bound'], unit)}", amount(0.0 - row["value"], unit)
        rows.append((what, asked, reached, holds))
    return ResultTable("Limits", ("limit", "asked", "reached", ""), rows)


def _active(found: Json) -> ResultTable | None:
    """The rows and bounds that hold the optimum, with their multipliers."""
    conditions = found.get("conditions")
    if not conditions:
        return None
    several = len({row["case"] for row in conditions["rows"]}) > 1
    held = [
        (f"{row['what']} ({row['case']})" if several else row["what"], row["multiplier"])
        for row in conditions["rows"]
    ]
    held += [
        (f"{bound['side']} bound of {bound['variable']}", bound["multiplier"])
        for bound in conditions["bounds"]
    ]
    rows: list[tuple[str, ...]] = [(what, units.number(x)) for what, x in held if abs(x) > _COUNTS]
    return ResultTable("Active", ("row", "multiplier"), rows) if rows else None


def _basins(found: Json) -> ResultTable | None:
    """The local optima, if there are several."""
    basins: Sequence[Json] = found.get("basins", ())
    if len(basins) < 2:
        return None
    return _designs(
        "Local optima",
        basins,
        {
            "peak": lambda basin: units.length(basin["peak"]),
            "settled": lambda one: _yes(one["settled"]),
            "proven": lambda one: _yes(one.get("proven", True)),
            "keeps the limits": lambda one: _yes(one["feasible"]),
        },
    )


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
            (
                "gain",
                f"the robust worst peak is {units.number(100.0 * found['gain'], 3)} % below the nominal one",
            )
        )
    if found["gap"] is not None:
        whole = ", after a look at the whole uncertainty" if found.get("inner_look") else ""
        pairs.append(("gap of the cuts", f"{units.number(found['gap'], 2)}{whole}"))
    if found["optimality"] is not None:
        pairs.append(("KKT residual", units.number(found["optimality"], 2)))
    pairs += (known := known_pairs(found))
    said = {words for _, words in known}
    pairs += [("warning", words) for words in found.get("warnings", ()) if words not in said]
    if found["unknown"] is not None:
        pairs.append(("no response", found["unknown"]["words"]))
    effort = f"{found['designs']} designs, {found['responses']} frequency responses"
    return [*pairs, ("effort", f"{effort} in {duration(found['seconds'])}")]


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
        said.append((f"{', '.join(of)} of every blade", f"within {units.number(within)} % of the tuned one"))
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
    ("keeps the limits", lambda side: _yes(side["feasible"])),
)
