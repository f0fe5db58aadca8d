"""The report of an identification: estimates, fit over the data, what is not told, what to measure next."""

from __future__ import annotations

from html import escape
from typing import Any

from optim.views.tables.studies import candidate_words, estimate_row, told_pairs
from service.rendering.report.sections import (
    Designed,
    Json,
    plan_section,
    scene_section,
    title_section,
    versions,
)
from solver.scene.parameter_paths import parameter
from solver.scene.scene import Scene
from solver.scene.toml import toml_text
from solver.views.plots.html import image, page, pairs, table

_MOST_CANDIDATES = 10


def identification_report(given: Designed) -> str:
    """The report as a page of HTML.

    Parameters
    ----------
    given : what was measured, with its values as they were given, and what was found.
    """
    scene, found = given.scene, given.result
    name = f"Parameters of {scene.name} from measurements"
    parts = [
        title_section(given, name, found["status"]),
        _estimates(scene, found),
        *_fit(found),
        *_correlations(found),
        f"<h2>How sure it is</h2>{pairs(told_pairs(found))}",
        *_next(found),
        scene_section(scene),
        plan_section(scene.with_values(found["values"]), found["n_harmonics"]),
        _again(scene, found),
    ]
    return page(name, "\n".join(parts))


def _estimates(scene: Scene, found: Json) -> str:
    """Each unknown as given, as found, and between which bounds it was looked for."""
    rows: list[list[Any]] = []
    for one in found["estimates"]:
        path = one["name"].split(",")[0].strip()
        low, high = one["bounds"]
        before = parameter(path, scene.value(path))
        bounds = f"{low:.6g} to {high:.6g} {one['unit']}".rstrip()
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
        under = ", ".join(f"{path} = {value:.6g}" for path, value in run["conditions"].items())
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
