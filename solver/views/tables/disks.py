"""What people read of a nonlinear mode and of disks, given as the JSON objects that programs read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from solver.results import units
from solver.results.known import Measured, known_pairs
from solver.results.order_statistics import quantile_words
from solver.results.told import Block, ResultTable, Summary
from solver.results.units import duration, hertz, quantity, span
from solver.views.tables.responses import proved

_DIRECTIONS = {"standing": "", "both": "", "forward": " forward", "backward": " backward"}
MISSING = "the sector was not reduced for nodal diameters {}: reduce it for all with --engine-order 1"


def interference(found: Mapping[str, Any]) -> Iterator[Block]:
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
    yield ResultTable(title, ("nodal diameter", "all open [Hz]", "all stuck [Hz]"), rows)
    if found["speed_rpm"] is not None:
        crossings = [
            (
                str(one["order"]), units.number(one['frequency_hz']),
                f"{one['diameter']}{'' if one['wave'] == 'standing' else ' ' + one['wave']}",
                str(one["family"]),
                f"{units.number(one['open_hz'])} to {units.number(one['stuck_hz'])}",
                "meets it" if one["inside"] else f"{units.number(100.0 * one['margin'], 3)} % away",
            )
            for one in found["crossings"]
        ]  # fmt: skip
        speed = quantity(found["speed_rpm"], "rpm")
        title = f"orders within {100.0 * found['within']:g} % of a family at {speed}"
        names = ("order", "frequency [Hz]", "nodal diameter", "family", "open to stuck [Hz]", "")
        yield ResultTable(title, names, crossings)
    pairs = []
    if found["missing"]:
        pairs.append(("warning", MISSING.format(", ".join(map(str, found["missing"])))))
    pairs.append(("time", duration(found["seconds"])))
    yield Summary("", pairs)


def _listed(values: list[float]) -> str:
    return "  ".join(f"{value:9.2f}" for value in values) or "none"


def mistuning(found: Mapping[str, Any]) -> Iterator[Block]:
    """The amplitude magnification over the disks, and the worst of them."""
    disks, tuned, worst = found["samples"], found["tuned"], found["worst"]
    title = f"{found['scene']}, {len(disks)} disks, spread {found['spread']:g} of {', '.join(found['of'])}"
    pairs = []
    if tuned["peak"] is not None:
        height = units.length(tuned["peak"])
        pairs.append((f"tuned, {Measured.of_result(found).name}", f"{height} at {hertz(tuned['at_hz'])}"))
    if found["mean"] is not None:
        # How well the mean is known: by the error of the peaks, and as that of a few disks of all.
        by_peaks, by_disks = found.get("mean_error"), found.get("standard_error")
        of_peaks = "" if by_peaks is None else f", known to {by_peaks:.2g} by the error of the peaks"
        known = of_peaks + (
            "" if by_disks is None else f", standard error {units.number(by_disks, 2)} by the number of disks"
        )
        pairs.append(("magnification", f"{units.number(found['mean'])} in the mean{known}"))
        if found["deviation"] is not None:
            pairs.append(("  deviation of the disks", units.number(found["deviation"], 2)))
    pairs += [
        (f"  {100.0 * quantile['share']:g} % below", quantile_words(quantile, "magnification", "disks"))
        for quantile in found["quantiles"]
    ]
    if worst is not None:
        blade, factors = worst["worst_blade"], ", ".join(f"{factor:.4f}" for factor in worst["factors"])
        place = f"blade {blade} at {hertz(worst['at_hz'][blade])}"
        error = worst.get("magnification_error")
        pairs.append(
            (
                "worst",
                f"{quantity(worst['magnification'], '', error)}: {units.length(worst['largest'])}, {place}",
            )
        )
        pairs.append(("  its disk", f"seed {worst['seed']}, factors {factors}"))
    pairs += known_pairs(found)
    pairs.append(("time", duration(found["seconds"])))
    yield Summary(f"{title}, {found['n_harmonics']} harmonics", pairs)


_MOST_ROWS = 40
_LEVEL = 1e-9  # relative difference of damping ratios that is none
_Column = tuple[str, str, Callable[[Any], str]]  # its head, key, and how a value is told
_AMPLITUDE: _Column = "a [√kg m]", "amplitude", units.number
_FREQUENCY: _Column = "frequency [Hz]", "frequency", units.number
_FACTOR: _Column = "× excitation", "excitation", units.number


def held(found: Mapping[str, Any]) -> Iterator[Block]:
    """Frequency, force, phase and states of the contacts where one amplitude is held."""
    size = units.length(found["amplitude"])
    title = f"{found['scene']}, |{found['dof']}| held at {size}, {found['n_harmonics']} harmonics"
    pairs = [("points", str(len(found["frequency"]))), ("time", duration(found["seconds"]))]
    if found["least"] is not None:
        best = found["least"]
        at = hertz(best["frequency"])
        pairs.insert(0, ("least force", f"{units.number(best['excitation'])} times, at {at}"))
    if found["stability_unknown"]:
        pairs.append(("stability", found["stability_unknown"]))
    phase = "phase [deg]", "phase", "{:.1f}".format
    stable = "stable", "stable", {None: "?", True: "yes", False: "no"}.__getitem__
    yield from _curve(found, title, pairs, [_FREQUENCY, _FACTOR, phase, _height(found), stable])


def resonance(found: Mapping[str, Any]) -> Iterator[Block]:
    """Amplitude, frequency, force and states of the contacts in phase resonance."""
    pairs = [("points", str(len(found["frequency"]))), ("time", duration(found["seconds"]))]
    title = f"{found['scene']}, phase resonance of mode {found['mode']}"
    yield from _curve(found, title, pairs, [_AMPLITUDE, _height(found), _FREQUENCY, _FACTOR])


def mode(found: Mapping[str, Any]) -> Iterator[Block]:
    """Amplitude, frequency, damping ratio and states of the contacts, a point a row, thinned to a page."""
    if found.get("damping_ratio") is None:
        yield from resonance(found)
        return
    of = "" if found["nodal_diameter"] is None else f", nodal diameter {found['nodal_diameter']}"
    title = f"{found['scene']}, mode {found['mode']}{of}, {found['n_harmonics']} harmonics"
    count = len(found["amplitude"])
    pairs = [("points", f"{count}, {found['newton_iterations']} Newton iterations")]
    if count:
        # Where damping is level, rounding would choose among its places.
        ratios = found["damping_ratio"]
        best = next(i for i, one in enumerate(ratios) if one >= max(ratios) - _LEVEL * abs(max(ratios)))
        size, at = quantity(found["amplitude"][best], "√kg m"), hertz(found["frequency"][best])
        pairs.insert(0, ("most damping", f"{units.number(ratios[best])} at a = {size}, {at}"))
    pairs.append(("time", duration(found["seconds"])))
    pairs += proved(found.get("certificates") or ())
    damping = ("damping ratio", "damping_ratio", units.number), ("± by harmonics", "damping_error", _error)
    yield from _curve(found, title, pairs, [_AMPLITUDE, _height(found), _FREQUENCY, *damping])
    if found.get("performance"):
        yield from _performance(found["performance"], found["dof"])
    if found.get("limit_cycles"):
        yield _cycles(found["limit_cycles"], found["dof"])


def _height(found: Mapping[str, Any]) -> _Column:
    return Measured(dof=found["dof"]).name, "max_abs", units.length


def _curve(
    found: Mapping[str, Any], title: str, pairs: list[tuple[str, str]], columns: Sequence[_Column]
) -> Iterator[Block]:
    """A point a row, thinned to a page, with the states of the contacts, and what is said of all."""
    rows = [
        [*(told(found[key][i]) for _, key, told in columns), _states(found, i)]
        for i in _thinned(len(found["frequency"]))
    ]
    if rows:
        yield ResultTable(title, [*(head for head, _, _ in columns), "contacts"], rows)
    yield Summary("" if rows else title, pairs)


def _performance(curve: Mapping[str, Any], dof: str) -> Iterator[Block]:
    """Peaks over the excitation and, where they scale, over the loads."""
    heads = ["× excitation", f"peak of |{dof}|", "at [Hz]", "× load", f"peak of |{dof}|"]
    rows = []
    for i in _thinned(len(curve["excitation"])):
        row = [
            units.number(curve["excitation"][i]),
            units.length(curve["peak"][i]),
            units.number(curve["frequency"][i]),
        ]
        known = curve["scales"] and curve["load"][i] is not None
        row += [units.number(curve["load"][i]), units.length(curve["peak_at_load"][i])] if known else ["", ""]
        rows.append(row)
    yield ResultTable("Peaks of this mode alone", heads, rows)
    if curve["least"] is not None:
        best = curve["least"]
        yield Summary(
            "",
            [
                (
                    "least peak",
                    f"{units.length(best['peak'])} with {quantity(best['load'], '')} times the loads",
                )
            ],
        )


def _cycles(found: Mapping[str, Any], dof: str) -> Summary:
    """Limit cycles, and the most the damper holds."""
    pairs, named = [], Measured(dof=dof).name
    if found["most_damping"] is not None:
        most = f"ζ = {units.number(found['most_damping'])} ± {_error(found['most_error'])}"
        end = ", the end of the curve: more may be held beyond" if found["most_at_end"] else ""
        pairs.append(("most that is held", f"{most} at a = {quantity(found['most_at'], '√kg m')}{end}"))
    for cycle in found["cycles"]:
        name = {True: "stable cycle", False: "unstable cycle", None: "cycle"}[cycle["stable"]]
        size = f"{named} {units.length(cycle['max_abs'])} ± {_error(cycle['max_abs_error'], 'm')}"
        at = quantity(cycle["frequency"], "Hz", cycle["frequency_error"])
        pairs.append((name, f"a = {quantity(cycle['amplitude'], '√kg m')}, {size}, {at}"))
        if cycle["stable"] is None:
            mode = "attracts" if cycle["attracts"] else "repels"
            pairs.append(("", f"the mode alone {mode}; stability not known: {cycle['growth']}"))
    for low, high in found["unsolved"]:
        pairs.append(("not solved", f"a = {span(low, high, '√kg m')}: a cycle may be there"))
    if not found["cycles"]:
        pairs.append(("limit cycles", "none between these amplitudes"))
    if found.get("load_for") is not None:
        asked = found["load_for"]
        pairs.append((f"holds a = {quantity(asked['disturbance'], '√kg m')}", asked["words"]))
    if not found["completed"]:
        pairs.append(("not complete", "the curve ends before its largest amplitude: more may be beyond"))
    on = ", on this mode alone" if found["mode_alone"] else ""
    return Summary(f"Aerodynamic damping ratio {found['aero_damping']:g}{on}", pairs)


def _error(value: float | None, unit: str = "") -> str:
    """What more harmonics would change."""
    return "not known" if value is None else quantity(value, unit, digits=2)


def _states(found: Mapping[str, Any], i: int) -> str:
    """What the contacts do at a point, in words."""
    names, states = found["contacts"], found["states"][i]
    if not states:
        return "none"
    same = len(set(states)) == 1
    return states[0] if same else ", ".join(f"{n}: {s}" for n, s in zip(names, states, strict=True))


def _thinned(count: int) -> list[int]:
    """Some points, the first and the last among them."""
    if count <= _MOST_ROWS:
        return list(range(count))
    return sorted({round(k * (count - 1) / (_MOST_ROWS - 1)) for k in range(_MOST_ROWS)})
