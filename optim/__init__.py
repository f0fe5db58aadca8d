"""The design layer: criteria with gradients, and the search for the best damper."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from optim.campbell import campbell_diagram, forbidden_hz
    from optim.crossings import CampbellDiagram, CampbellStatus
    from optim.elasticities import SensitivityResult, SensitivityStatus, sensitivities
    from optim.errors import DesignError
    from optim.pareto import pareto_front
    from optim.pareto_result import ParetoResult, ParetoStatus
    from optim.result import DesignResult, DesignStatus
    from optim.robust import robust_design
    from optim.robust_result import RobustResult, RobustStatus
    from optim.search import design

_HOME = {
    "design": "search", "DesignResult": "result", "DesignStatus": "result", "DesignError": "errors",
    "CampbellDiagram": "crossings", "CampbellStatus": "crossings", "campbell_diagram": "campbell",
    "forbidden_hz": "campbell",
    "sensitivities": "elasticities", "SensitivityResult": "elasticities",
    "SensitivityStatus": "elasticities",
    "pareto_front": "pareto", "ParetoResult": "pareto_result", "ParetoStatus": "pareto_result",
    "robust_design": "robust", "RobustResult": "robust_result", "RobustStatus": "robust_result",
}  # fmt: skip

__all__ = [
    "CampbellDiagram",
    "CampbellStatus",
    "DesignError",
    "DesignResult",
    "DesignStatus",
    "ParetoResult",
    "ParetoStatus",
    "RobustResult",
    "RobustStatus",
    "SensitivityResult",
    "SensitivityStatus",
    "campbell_diagram",
    "design",
    "forbidden_hz",
    "pareto_front",
    "robust_design",
    "sensitivities",
]


def __getattr__(name: str) -> object:
    """Load a public name on first use (CVXPY takes a second to import)."""
    if name not in _HOME:
        raise AttributeError(f"module 'optim' has no attribute {name!r}")
    value = getattr(import_module(f"optim.{_HOME[name]}"), name)
    globals()[name] = value
    return value
