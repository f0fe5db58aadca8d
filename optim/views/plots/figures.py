"""The figure of each class of result, for its ``plot``."""

from __future__ import annotations

from matplotlib.figure import Figure

from optim.results.design_result import DesignResult
from optim.studies.crossings import CampbellDiagram
from optim.views.plots.campbell import campbell_figure
from optim.views.plots.designs import design_figure
from solver.views.plots.curves import Response
from solver.views.plots.style import Into


def of_design(result: DesignResult, ax: Into = None) -> Figure:
    """Draw the response of the optimum."""
    return design_figure(result, ax=ax)


def of_campbell(diagram: CampbellDiagram, ax: Into = None) -> Figure:
    """Draw the diagram, and the responses beside it."""
    # One object for each branch: orders that share theirs are told by it.
    curves = {id(one.branch): Response.of_branch(one.branch) for one in diagram.orders}
    return campbell_figure(diagram.to_json(), [curves[id(one.branch)] for one in diagram.orders], ax=ax)
