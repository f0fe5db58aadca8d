"""The design layer: criteria with gradients, and the search for the best damper."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from optim.errors import DataError, DesignError
    from optim.identification.identify import identify
    from optim.identification.result import Identification, IdentifyStatus
    from optim.problem.typed import Case, Limit
    from optim.results.design import DesignResult, DesignStatus
    from optim.robust.result import RobustResult, RobustStatus
    from optim.robust.robust import robust_design
    from optim.search import design
    from optim.studies.campbell import campbell_diagram, forbidden_hz
    from optim.studies.crossings import CampbellDiagram, CampbellStatus
    from optim.studies.elasticities import SensitivityResult, SensitivityStatus, sensitivities
    from optim.studies.pareto import pareto_front
    from optim.studies.pareto_result import ParetoResult, ParetoStatus

_HOME = {
    "DataError": "errors", "identify": "identification.identify", "Identification": "identification.result",
    "IdentifyStatus": "identification.result",
    "Case": "problem.typed", "Limit": "problem.typed",
    "design": "search", "DesignResult": "results.design", "DesignStatus": "results.design",
    "DesignError": "errors", "CampbellDiagram": "studies.crossings", "CampbellStatus": "studies.crossings",
    "campbell_diagram": "studies.campbell", "forbidden_hz": "studies.campbell",
    "sensitivities": "studies.elasticities", "SensitivityResult": "studies.elasticities",
    "SensitivityStatus": "studies.elasticities", "pareto_front": "studies.pareto",
    "ParetoResult": "studies.pareto_result", "ParetoStatus": "studies.pareto_result",
    "robust_design": "robust.robust", "RobustResult": "robust.result", "RobustStatus": "robust.result",
}  # fmt: skip

__all__ = [
    "CampbellDiagram",
    "CampbellStatus",
    "Case",
    "DataError",
    "DesignError",
    "DesignResult",
    "DesignStatus",
    "Identification",
    "IdentifyStatus",
    "Limit",
    "ParetoResult",
    "ParetoStatus",
    "RobustResult",
    "RobustStatus",
    "SensitivityResult",
    "SensitivityStatus",
    "campbell_diagram",
    "design",
    "forbidden_hz",
    "identify",
    "pareto_front",
    "robust_design",
    "sensitivities",
]


if not TYPE_CHECKING:  # a checker shall notice a name that is none

    def __getattr__(name: str) -> object:
        """Load a public name on first use (CVXPY takes a second to import)."""
        if name not in _HOME:
            raise AttributeError(f"module 'optim' has no attribute {name!r}")
        value = getattr(import_module(f"optim.{_HOME[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """Return the public names too that are not loaded yet, for completion."""
    return sorted({*globals(), *__all__})
