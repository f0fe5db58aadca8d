"""The report of a design: what was given, what came out, what holds it, how to have it again."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import solver
from service.cli.design_reports import design_tables
from service.report.responses import Responses, comparison_figure, responses_of
from solver import units
from solver.plots.html import image, page, pairs, table
from solver.scene import Scene
from solver.toml_text import toml_text

Json = Mapping[str, Any]
_PACKAGES = ("stickslip", "numpy", "scipy", "numba", "casadi", "cvxpy", "clarabel")


@dataclass(frozen=True, slots=True, kw_only=True)
class Designed:
    """What a report is of.

    Attributes
    ----------
    scene : Scene
        As it was given, with its values set.
    problem : mapping
        The arguments of the design layer.
    result : mapping
        The JSON of `optim.DesignResult`, or of `optim.ParetoResult`.
    """

    scene: Scene
    problem: Json
    result: Json

    @property
    def front(self) -> Json | None:
        """The front, if this is one."""
        return self.result if "points" in self.result else None

    @property
    def chosen(self) -> Json:
        """The optimum; of a front its knee, else its least peak."""
        if self.front is None:
            return self.result
        points = self.front["points"]
        if not points:
            return {"optimum": {}, "peak": None, "active": [], "status": self.front["status"]}
        point = points[self.front["knee"] or 0]
        peak = {"value": point["peak"], "at": point["at"]}
        return {**point, "optimum": point["values"], "peak": peak, "status": self.front["status"]}


def design_report(given: Designed) -> str:
    """The report as a page of HTML.

    Parameters
    ----------
    given : what was designed.

    Raises
    ------
    SettingError, SceneError
        The optimum does not fit the scene.
    """
    optimum = {path.strip(): v for paths, v in given.chosen["optimum"].items() for path in paths.split(",")}
    after = given.scene.with_values(optimum)
    harmonics = int(given.problem.get("harmonics", 11))
    found = responses_of(given.scene, after, tuple(optimum), harmonics, given.problem.get("limit"))
    parts = [
        f"<h1>Damper of {escape(given.scene.name)}</h1>",
        f"<p>{escape(given.chosen['status'])}</p>",
        _figures(given, found),
        _response(given.scene, found),
        *_holds(given),
        *_trade_off(given),
        _motion(after, found, harmonics),
        _scene(given.scene),
        _plan(after, harmonics),
        _again(given),
    ]
    return page(f"Damper of {given.scene.name}", "\n".join(parts))


def _figures(given: Designed, found: Responses) -> str:
    """The optimum, and what it changes."""
    rows: list[list[Any]] = []
    for name, value in given.chosen["optimum"].items():
        path = name.split(",")[0].strip()
        before = units.parameter(path, given.scene.value(path))
        bounds = (given.problem.get("variables") or {}).get(name)
        between = (
            "" if bounds is None else f"{units.number(bounds[0], 6)} to {units.parameter(path, bounds[1])}"
        )
        rows.append([name, before, units.parameter(path, value), between])
    changes: list[list[Any]] = []
    for name, branch in (("as given", found.before), ("optimum", found.after)):
        if branch is not None and branch.peak is not None:
            band = "" if branch.band is None else f"{units.number(branch.band.width)} Hz"
            error = units.length(branch.error_estimate)
            place = f"{branch.peak.at:.6g} Hz"
            changes.append([name, units.length(branch.peak.value), error, place, band])
    heads = ["response", "highest peak", "estimated error", "at", "band"]
    return (
        f"<h2>Optimum</h2>{table(['variable', 'as given', 'optimum', 'bounds'], rows)}"
        f"<h2>Before and after</h2>{table(heads, changes)}"
    )


def _response(scene: Scene, found: Responses) -> str:
    figure = comparison_figure(scene, found)
    words = f"Amplitude of {scene.observe.dof} over frequency, as given and at the optimum"
    linear = ", between the linear limits" if found.free is not None else ""
    return image(figure, words, f"{words}{linear}.")


def _holds(given: Designed) -> list[str]:
    """What holds the optimum: limits, active rows with multipliers, local optima."""
    if given.front is not None:
        active = "; ".join(given.chosen["active"])
        return [f"<h2>What holds it</h2><p>{escape(active)}</p>"] if active else []
    found, tables = design_tables(given.result)
    parts = ["<h2>What holds it</h2>", pairs(found)]
    conditions = given.result.get("conditions")
    if conditions is not None:
        worst = max(conditions["violation"], 0.0)
        violation = f"{worst:.1e}" if worst > 0.0 else "none"
        parts.append(pairs([("largest relative violation of a limit", violation)]))
    for one in tables:
        parts += [f"<h3>{escape(one.heading)}</h3>", table(list(one.columns), [list(r) for r in one.rows])]
    return parts


def _trade_off(given: Designed) -> list[str]:
    """The front, of a job that computed one."""
    if given.front is None or not given.front["points"]:
        return []
    from optim.plots.pareto import pareto_figure

    heads = [*given.front["points"][0]["values"], "peak", "band"]
    rows = [
        [*p["values"].values(), units.length(p["peak"]), f"{units.number(p['band_hz'])} Hz"]
        for p in given.front["points"]
    ]
    words = "The front of peak against band, and the frequencies at risk"
    return ["<h2>Trade-off</h2>", image(pareto_figure(given.front), words), table(heads, rows)]


def _motion(scene: Scene, found: Responses, harmonics: int) -> str:
    """One period at the highest peak."""
    peak = None if found.after is None else found.after.peak
    solution = None if peak is None else solver.solve(scene, frequency_hz=peak.at, harmonics=harmonics)
    if solution is None or not solution.converged:
        return ""
    words = "One period at the highest peak: motion, hysteresis loops, harmonics"
    states = [(contact.name, contact.state.value) for contact in solution.contacts]
    return f"<h2>At the peak</h2>{image(solution.plot(), words, words + '.')}{pairs(states)}"


def _scene(scene: Scene) -> str:
    """The contacts, the force and what is observed; the rest is in the TOML."""
    contacts: list[list[Any]] = []
    for contact in scene.contacts:
        values = [
            f"{key} = {units.parameter(f'{contact.name}.{key}', value)}"
            for key in contact.PARAMETERS
            if (value := getattr(contact, key)) is not None
        ]
        contacts.append([contact.name, " – ".join(contact.between), ", ".join(values)])
    low, high = scene.observe.band
    about = [
        ("structure", f"{scene.structure.kind}, {len(scene.structure.dofs)} DOFs"),
        *(("force", f"{force.amplitude:g} N on {force.dof}") for force in scene.excitation),
        ("observed", f"{scene.observe.dof}, {low:g} to {high:g} Hz"),
    ]
    return f"<h2>Scene</h2>{pairs(about)}{table(['contact', 'between', 'as given'], contacts)}"


def _plan(scene: Scene, harmonics: int) -> str:
    found = solver.plan(scene, harmonics=harmonics)
    rows: list[list[Any]] = [[e.name, "in use" if e.used else "left out", e.reason] for e in found.effects]
    words = "What was computed, and what was left out without loss."
    return f"<h2>Plan</h2><p class=quiet>{words}</p>{table(['effect', '', 'why'], rows)}"


def _again(given: Designed) -> str:
    """The files and the command that give the same, and the versions."""
    command = "pareto" if given.front is not None else "design"
    problem = toml_text({"scene": "scene.toml", **given.problem})
    packages = [("Python", platform.python_version()), *((name, _version(name)) for name in _PACKAGES)]
    return (
        "<h2>To have it again</h2>"
        f"<pre>stickslip {command} --problem problem.toml</pre>"
        f"<p>problem.toml</p><pre>{escape(problem)}</pre>"
        f"<p>scene.toml</p><pre>{escape(toml_text(given.scene.to_dict()))}</pre>"
        f"<h3>Versions</h3>{pairs(packages)}"
    )


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
