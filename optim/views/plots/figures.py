"""The figure of each class of result, for its ``plot``."""

from __future__ import annotations

from matplotlib.figure import Figure

from optim.identification.result import Identification
from optim.results.design import DesignResult
from optim.robust.result import RobustResult
from optim.studies.crossings import CampbellDiagram
from optim.studies.elasticities import SensitivityResult
from optim.studies.pareto_result import ParetoResult
from optim.views.plots.campbell import campbell_figure
from optim.views.plots.designs import design_figure, robust_figure
from optim.views.plots.identification import identification_figure
from optim.views.plots.pareto import pareto_figure
from optim.views.plots.shares import sensitivities_figure
from solver.views.plots.curves import Response
from solver.views.plots.style import Into


def of_design(result: DesignResult, ax: Into = None) -> Figure:
    """Draw the response of the optimum."""
    return design_figure(result, ax=ax)


def of_robust(result: RobustResult, ax: Into = None) -> Figure:
    """Draw the peaks of both optima over the uncertainty."""
    return robust_figure(result.to_json(), ax=ax)


def of_campbell(diagram: CampbellDiagram, ax: Into = None) -> Figure:
    """Draw the diagram, and the responses beside it."""
    # One object for each branch: orders that share theirs are told by it.
    curves = {id(one.branch): Response.of_branch(one.branch) for one in diagram.orders}
    return campbell_figure(diagram.to_json(), [curves[id(one.branch)] for one in diagram.orders], ax=ax)


def of_sensitivities(result: SensitivityResult, ax: Into = None) -> Figure:
    """Draw what matters most as bars."""
    return sensitivities_figure(result.to_json(), ax=ax)


def of_identification(result: Identification, ax: Into = None) -> Figure:
    """Draw data and fit."""
    return identification_figure(result.to_json(), ax=ax)


def of_front(result: ParetoResult, ax: Into = None) -> Figure:
    """Draw the front and the frequencies at risk."""
    return pareto_figure(result.to_json(), ax=ax)
