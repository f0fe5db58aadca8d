"""The reports of results: what was given, what came out, what holds it, how to have it again.

Of a robust design both optima, and what the uncertainty does; of an identification estimates, the fit over
the data, what is not told, and what to measure next.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

import optim
from optim.views.plots.figures import robust_figure
from optim.views.tables.design import SIDE_LINES, design, effort_pairs, front, uncertain_rows
from optim.views.tables.studies import candidate_words, estimate_row, shares, told_pairs
from service.rendering.report.sections import (
    DASHED,
    Designed,
    Json,
    ReportLine,
    Sweeps,
    again_section,
    branch_table,
    by_path,
    in_scenario,
    linear_lines,
    motion_section,
    optimum_section,
    plan_section,
    response_section,
    scene_section,
    title_section,
    versions,
    violation_pair,
)
from solver.continuation.branch import AnyBranch
from solver.errors import SolverError
from solver.results import units
from solver.scene.parameter_paths import parameter
from solver.scene.scene import Scene
from solver.scene.toml import toml_text
from solver.views.plots import style
from solver.views.plots.html import block_html, image, page, pairs, table

_MOST_PARAMETERS = 8


def design_report(given: Designed) -> str:
    """The report as a page of HTML.

    SettingError, SceneError if the optimum does not fit the scene. `given`: what was designed: the result of
    a design, or of a front.
    """
    chosen = _chosen(given.result)
    optimum = by_path(chosen["optimum"])
    sweeps = Sweeps(harmonics=given.harmonics, limit=given.problem.get("limit"))
    case = sweeps.governing(given.scene, given.problem, optimum)
    scene = case.scene
    after = scene.with_values(optimum)
    lines = [
        *linear_lines(after, tuple(optimum)),
        ReportLine(name="as given", branch=sweeps.of(scene), color=style.BLUE),
        ReportLine(name="optimum", branch=sweeps.of(after), color=style.VERMILION, width=2.0),
    ]
    words = f"Amplitude, {scene.measured.name}, over frequency, as given and at the optimum{case.where}"
    parts = [
        title_section(given, f"Damper of {given.scene.name}", chosen["status"]),
        optimum_section(given, {"optimum": chosen["optimum"]}),
        f"<h2>Before and after{escape(case.where)}</h2>{branch_table(lines)}",
        response_section(scene, lines, words), *_holds(given, chosen), _sensitivities(given, after),
        *_trade_off(given.result), motion_section(lines[-1].branch), scene_section(given.scene),
        plan_section(after, given.harmonics),
        again_section(given, "pareto" if _is_front(given.result) else "design"),
    ]  # fmt: skip
    return page(f"Damper of {given.scene.name}", "\n".join(parts))


def _is_front(result: Json) -> bool:
    return "points" in result


def _chosen(result: Json) -> Json:
    """The optimum; of a front its knee, else its least peak."""
    if not _is_front(result):
        return result
    points = result["points"]
    if not points:
        return {"optimum": {}, "peak": None, "active": [], "status": result["status"]}
    point = points[result["knee"] or 0]
    peak = {"value": point["peak"], "at": point["at"]}
    return {**point, "optimum": point["values"], "peak": peak, "status": result["status"]}


def _holds(given: Designed, chosen: Json) -> list[str]:
    """What holds the optimum: limits, active rows with multipliers, local optima."""
    if _is_front(given.result):
        active = "; ".join(chosen["active"])
        return [f"<h2>What holds it</h2><p>{escape(active)}</p>"] if active else []
    first, *tables = design(given.result)
    parts = ["<h2>What holds it</h2>", pairs(first.pairs)]
    conditions = given.result.get("conditions")
    if conditions is not None:
        parts.append(pairs([violation_pair(conditions["violation"])]))
    return parts + [f"<h3>{escape(one.title)}</h3>{block_html(one)}" for one in tables]


def _sensitivities(given: Designed, after: Scene) -> str:
    """What one per cent of each parameter does at the optimum: how exactly it has to be built."""
    try:
        found = optim.sensitivities(after, limit=given.problem.get("limit"), harmonics=given.harmonics)
    except SolverError as error:
        return f"<h2>Sensitivities</h2><p>Not known: {escape(str(error))}</p>"
    told: Json = found.to_json()
    if not found.reached:
        return f"<h2>Sensitivities</h2><p>{escape(told['status'])}</p>"
    words = "Change for one per cent more of a parameter; those that matter most for the highest peak."
    most = block_html(next(shares(told)), _MOST_PARAMETERS)
    return f"<h2>Sensitivities</h2><p class=quiet>{words}</p>{most}"


def _trade_off(result: Json) -> list[str]:
    """The front, of a job that computed one."""
    if not _is_front(result) or not result["points"]:
        return []
    from optim.views.plots.figures import pareto_figure

    words = "The front of peak against band, and the frequencies at risk"
    return ["<h2>Trade-off</h2>", image(pareto_figure(result), words), block_html(next(front(result)))]


_COUNTS = 1e-6  # multipliers below this hold nothing
_COLORS = {"nominal": style.SKY, "robust": style.VERMILION}


def robust_report(given: Designed) -> str:
    """The report as a page of HTML.

    SettingError, SceneError if the optimum does not fit the scene. `given`: what was designed; its result is
    that of `optim.robust_design`.
    """
    found = given.result
    optimum = by_path(found["optimum"])
    sweeps = Sweeps(harmonics=given.harmonics, limit=given.problem.get("limit"))
    case = sweeps.governing(given.scene, given.problem, optimum)
    scene = case.scene
    after = scene.with_values(optimum)
    linear, lines = linear_lines(after, tuple(optimum)), _lines(scene, found, sweeps)
    words = (
        f"Amplitude, {scene.measured.name}, over frequency: as given, and both optima with nothing uncertain"
    )
    if any("worst" in line.name for line in lines):
        words += " and in the scenario that is worst for each"
    words += case.where
    shown = _shown(lines)
    title = f"Robust damper of {given.scene.name}"
    parts = [
        title_section(given, title, found["status"]),
        optimum_section(given, {f"{name} optimum": side["values"] for name, side in _sides(found)}),
        _uncertain(found), _over_the_uncertainty(found), f"<h2>Responses</h2>{branch_table(lines)}",
        response_section(scene, [*linear, *lines], words), _robust_holds(found),
        motion_section(shown.branch, f"At the peak of the {shown.name}"), scene_section(given.scene),
        plan_section(after, given.harmonics), again_section(given, "design"),
    ]  # fmt: skip
    return page(title, "\n".join(parts))


def _sides(found: Json) -> list[tuple[str, Json]]:
    return [(name, found[name]) for name in ("nominal", "robust") if found[name] is not None]


def _lines(scene: Scene, found: Json, sweeps: Sweeps) -> list[ReportLine]:
    """As given, and each optimum with nothing uncertain and in its worst scenario."""
    lines = [ReportLine(name="as given", branch=sweeps.of(scene), color=style.GREEN, width=1.0)]
    for name, side in _sides(found):
        here = scene.with_values(by_path(side["values"]))
        color = _COLORS[name]
        lines.append(ReportLine(name=f"{name} optimum", branch=sweeps.of(here), color=color, width=2.0))
        if side["worst"] is not None:
            worst = sweeps.worst(in_scenario(here, side["worst"]["scenario"]))
            lines.append(
                ReportLine(name=f"{name} optimum, worst case", branch=worst, color=color, dashes=DASHED)
            )
    return lines


def _shown(lines: Sequence[ReportLine]) -> ReportLine:
    """The last response of one sector: a mistuned disk has a loop in every sector, too many to look at."""
    few = [line for line in lines if line.branch is None or not _written_out(line.branch)]
    return (few or lines)[-1]


def _written_out(branch: AnyBranch) -> bool:
    """Whether a disk's sectors are contacts of their own."""
    return any("@" in contact.name for contact in branch.scene.contacts)


def _uncertain(found: Json) -> str:
    """What is not known, and what is minimised over it."""
    aim = found["aim"] if found["quantile"] is None else f"{100.0 * found['quantile']:g} % {found['aim']}"
    return f"<h2>What is not known</h2>{pairs([*uncertain_rows(found['uncertain']), ('minimised', aim)])}"


def _over_the_uncertainty(found: Json) -> str:
    """Both optima over the uncertainty: numbers and picture."""
    sides = _sides(found)
    if not sides:
        return ""
    rows = [[name, *(show(side) for _, side in sides)] for name, show in SIDE_LINES]
    numbers = table(["", *(f"{name} optimum" for name, _ in sides)], rows)
    words = "Highest peak over the samples of the uncertainty, sorted, with the worst that was found"
    picture = image(robust_figure(found), words, f"{words}.") if found["nominal"] is not None else ""
    return f"<h2>Over the uncertainty</h2>{numbers}{picture}"


def _robust_holds(found: Json) -> str:
    """What holds the robust optimum, and how well the search closed."""
    told = effort_pairs(found)
    if found["violation"] is not None:
        told.append(violation_pair(found["violation"]))
    told.append(("search with nothing uncertain", found["nominal_status"]))
    parts = ["<h2>What holds it</h2>", pairs(told)]
    held = [cut for cut in found["cuts"] if abs(cut["multiplier"]) > _COUNTS]
    if held:
        rows: list[list[Any]] = [
            [cut["scenario"]["words"], "" if cut["peak"] is None else units.length(cut["peak"]),
             units.number(cut["multiplier"])]
            for cut in held
        ]  # fmt: skip
        heads = ["scenario", "peak where it was found", "multiplier"]
        parts.append(f"<h3>Scenarios that hold the robust optimum</h3>{table(heads, rows)}")
    return "".join(parts)


_MOST_CANDIDATES = 10


def identification_report(given: Designed) -> str:
    """The report as a page of HTML.

    `given` is what was measured, with its values as they were given, and what was found.
    """
    scene, found = given.scene, given.result
    name = f"Parameters of {scene.name} from measurements"
    parts = [
        title_section(given, name, found["status"]), _estimates(scene, found), *_fit(found),
        *_correlations(found), f"<h2>How sure it is</h2>{pairs(told_pairs(found))}", *_next(found),
        scene_section(scene), plan_section(scene.with_values(found["values"]), found["n_harmonics"]),
        _again(scene, found),
    ]  # fmt: skip
    return page(name, "\n".join(parts))


def _estimates(scene: Scene, found: Json) -> str:
    """Each unknown as given, as found, and between which bounds it was looked for."""
    rows: list[list[Any]] = []
    for one in found["estimates"]:
        path = one["name"].split(",")[0].strip()
        low, high = one["bounds"]
        before = parameter(path, scene.value(path))
        bounds = units.span(low, high, one["unit"])
        rows.append([*estimate_row(one), before, bounds])
    if not rows:
        return "<p>There is no estimate.</p>"
    heads = ["parameter", "estimate", "± error", "95 % interval", "", "as given", "bounds"]
    return f"<h2>Estimates</h2>{table(heads, rows)}"


def _fit(found: Json) -> list[str]:
    """The data with the fit and its band, and the runs they are of."""
    from optim.views.plots.figures import identification_figure

    if not found["runs"]:
        return []
    words = "Measured data, the fit and its 95 % band"
    rows: list[list[Any]] = []
    for run in found["runs"]:
        under = ", ".join(f"{path} = {units.number(value)}" for path, value in run["conditions"].items())
        rows.append([run["kind"], run["source"], under, len(run["data"])])
    drawn = image(identification_figure(found), words, f"{words}.")
    return ["<h2>The fit</h2>", drawn, table(["kind", "from", "conditions", "points"], rows)]


def _correlations(found: Json) -> list[str]:
    """How the errors of the estimates hang together."""
    names = [one["name"] for one in found["estimates"]]
    if len(names) < 2:
        return []
    rows: list[list[Any]] = [
        [name, *(f"{value:+.3f}" for value in row)]
        for name, row in zip(names, found["correlation"], strict=True)
    ]
    quiet = "Near +1 or −1 the data tell only a combination of the two."
    return [f"<h2>Correlations</h2><p class=quiet>{quiet}</p>", table(["", *names], rows)]


def _next(found: Json) -> list[str]:
    """The measurements that would tell most, ranked."""
    known = [one for one in found["candidates"] if one["gain"] is not None]
    if not known:
        return []
    rows: list[list[Any]] = [[i + 1, candidate_words(one)] for i, one in enumerate(known[:_MOST_CANDIDATES])]
    quiet = "Ranked by how much the determinant of the information matrix would grow."
    return [f"<h2>What to measure next</h2><p class=quiet>{quiet}</p>", table(["", "conditions"], rows)]


def _again(scene: Scene, found: Json) -> str:
    """The scene with the estimates, what is left uncertain for a design, and the versions."""
    fitted = scene.with_values(found["values"])
    uncertain = toml_text({"scene": "scene.toml", "uncertain": found["uncertain"]})
    return (
        "<h2>To go on</h2>"
        "<pre>stickslip design --problem problem.toml --variable PATH LO HI</pre>"
        f"<h3>problem.toml</h3><pre>{escape(uncertain)}</pre>"
        f"<h3>scene.toml, with the estimates</h3><pre>{escape(toml_text(fitted.to_dict()))}</pre>"
        f"<h3>Versions</h3>{versions()}"
    )
