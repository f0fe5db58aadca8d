"""The report of a design: what was given, what came out, what holds it, how to have it again."""

from __future__ import annotations

from html import escape

import optim
from optim.views.tables.design import design, front
from optim.views.tables.studies import shares
from service.rendering.report.responses_report import ReportLine, Sweeps, linear_lines
from service.rendering.report.sections import (
    Designed,
    Json,
    again_section,
    branch_table,
    by_path,
    motion_section,
    optimum_section,
    plan_section,
    response_section,
    scene_section,
    title_section,
    violation_pair,
)
from solver.errors import SolverError
from solver.scene.scene import Scene
from solver.views.plots import style
from solver.views.plots.html import block_html, image, page, pairs

_MOST_PARAMETERS = 8


def design_report(given: Designed) -> str:
    """The report as a page of HTML.

    Parameters
    ----------
    given : what was designed: the result of a design, or of a front.

    Raises
    ------
    SettingError, SceneError
        The optimum does not fit the scene.
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
        response_section(scene, lines, words),
        *_holds(given, chosen),
        _sensitivities(given, after),
        *_trade_off(given.result),
        motion_section(lines[-1].branch),
        scene_section(given.scene),
        plan_section(after, given.harmonics),
        again_section(given, "pareto" if _is_front(given.result) else "design"),
    ]
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
