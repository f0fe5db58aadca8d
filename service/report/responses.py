"""The responses of a report: as given, at the optimum, and the linear limits between which they lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

import solver
from solver import units
from solver.branch import Branch
from solver.plots import style
from solver.plots.curves import Response
from solver.scene import Contact, Scene

_STUCK = 1e9  # N, a normal load under which a contact never slips


@dataclass(frozen=True, slots=True, kw_only=True)
class Responses:
    """Responses over the scene's band; None where one has no point, or no linear limit exists."""

    before: Branch | None
    after: Branch | None
    free: Branch | None
    stuck: Branch | None


def responses_of(
    before: Scene, after: Scene, paths: tuple[str, ...], harmonics: int, limit: float | None
) -> Responses:
    """Compute the responses of a report.

    Parameters
    ----------
    before, after : the scene as given, and at the optimum.
    paths : what was designed; its contacts are those removed in one limit, all others are stuck.
    harmonics : highest harmonic kept.
    limit : amplitude [m] at which the band is measured.
    """
    designed = {path.partition(".")[0] for path in paths}
    names = [contact.name for contact in after.contacts]
    removed = [name for name in names if name in designed] or names
    free = stuck = None
    if names and all(isinstance(contact, Contact) for contact in after.contacts):
        held = {f"{name}.N0": _STUCK for name in names}
        still = {f"{name}.N1": 0.0 for name in names}
        stuck = _sweep(after.with_values({**held, **still}), 1, None)
        free = _sweep(after.with_values({**held, **{f"{n}.N0": 0.0 for n in removed}, **still}), 1, None)
    return Responses(
        before=_sweep(before, harmonics, limit), after=_sweep(after, harmonics, limit), free=free, stuck=stuck
    )


def _sweep(scene: Scene, harmonics: int, limit: float | None) -> Branch | None:
    branch = solver.sweep(scene, harmonics=harmonics, limit=limit)
    return branch if len(branch.values) and branch.peak is not None else None


def comparison_figure(scene: Scene, found: Responses) -> Figure:
    """The responses on a logarithmic scale; at least one has a point."""
    dotted, dashed = (0, (1.2, 1.8)), (0, (5.0, 2.5))
    lines = (
        ("contacts removed (linear)", found.free, style.GREY, dotted, 1.0),
        ("contacts stuck (linear)", found.stuck, style.GREY, dashed, 1.0),
        ("as given", found.before, style.BLUE, "-", 1.4),
        ("optimum", found.after, style.VERMILION, "-", 2.0),
    )
    curves = {name: Response.of_branch(branch) for name, branch, *_ in lines if branch is not None}
    mine = [curve for name, curve in curves.items() if "linear" not in name] or list(curves.values())
    unit = units.length_unit(float(np.median([curve.amplitude.max() for curve in mine])))
    with style.styled():
        page, (axes,) = style.figure(6.6, 4.0)
        for name, _, color, dashes, width in lines:
            if name in curves:
                axes.plot(
                    curves[name].values, curves[name].amplitude * unit.per_metre, color=color,
                    linestyle=dashes, linewidth=width, label=name,
                )  # fmt: skip
        axes.set_yscale("log")
        style.plain_log(axes.yaxis)
        axes.margins(x=0.0)
        style.label(axes, "frequency [Hz]", f"amplitude, max |{scene.observe.dof}| [{unit.name}]")
        axes.set_title(scene.name)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=4)
    return page
