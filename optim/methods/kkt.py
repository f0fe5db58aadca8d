"""Where a local search ended, judged by the first-order conditions themselves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.linearised import Conditions, Model, conditions
from optim.problem.variables import BoundedVariable
from optim.results.design_parts import LocalOptimum

Evaluate = Callable[[Mapping[str, float]], DesignEvaluation]
ModelOf = Callable[[DesignEvaluation], Model]

KKT_TOLERANCE = 1e-3  # relative objective per scaled variable
KEPT = 1e-6  # relative excess over a bound up to which it counts as kept
FLAT_SLOPE = 1e-9  # relative objective per scaled variable below which there is nothing to choose


@dataclass(frozen=True, slots=True, kw_only=True)
class Local:
    """Where a local search ended."""

    evaluation: Annotated[DesignEvaluation, "The best design."]
    merit: Annotated[float, "Its objective, with the penalty on the limits it does not keep."]
    settled: Annotated[
        bool,
        "Whether the first-order conditions hold: of the objective, or, if limits are not kept, of the "
        "largest excess over them.",
    ]
    feasible: Annotated[bool, "Whether the limits are kept."]
    conditions: Annotated[Conditions, "Multipliers and residual."]
    standing: Annotated[tuple[float, float], "What designs are compared by; see `standing`."]

    @property
    def optimum(self) -> LocalOptimum:
        """It as results tell it."""
        return optimum_at(self.evaluation, settled=self.settled, feasible=self.feasible)


def optimum_at(evaluation: DesignEvaluation, *, settled: bool, feasible: bool) -> LocalOptimum:
    """Return a design whose responses were computed as a local optimum."""
    return LocalOptimum(
        values=dict(evaluation.values), peak=evaluation.peaks[0].value, objective=evaluation.objective_told,
        settled=settled, feasible=feasible, proven=True,
    )  # fmt: skip


def standing(model: Model) -> tuple[float, float]:
    """Return what designs are compared by: the excess over the limits that are not kept, then the objective.

    No penalty is large enough for every limit: a design that keeps all of them goes before any that does not.
    """
    violation = model.violation
    return (0.0 if violation <= KEPT else violation), model.objective


def ended(here: DesignEvaluation, model: Model, variables: Sequence[BoundedVariable]) -> Local:
    """Return the end of a search at a design."""
    feasible = model.violation <= KEPT
    found = conditions(model, variables, feasibility=not feasible)
    return Local(
        evaluation=here, merit=model.merit, settled=found.residual <= KKT_TOLERANCE, feasible=feasible,
        conditions=found, standing=standing(model),
    )  # fmt: skip


def is_flat(model: Model) -> bool:
    """Return whether no row depends on any variable."""
    both = np.concatenate([model.slopes.reshape(-1), model.excess_slopes.reshape(-1)])
    return bool(np.all(np.abs(both) <= FLAT_SLOPE))


def of_limits(model: Model) -> Model:
    """Return the model whose objective is the largest relative excess over a limit, counted from 1."""
    rows = tuple(
        replace(row, weight=model.unit / unit)
        for row, unit in zip(model.limited, model.units.tolist(), strict=True)
    )
    return replace(
        without_limits(model), rows=rows, heights=1.0 + model.excess, slopes=model.excess_slopes,
        groups=np.zeros(model.excess.size),
    )  # fmt: skip


def without_limits(model: Model) -> Model:
    """Return the model of what is minimised alone."""
    none = np.zeros(0)
    return replace(model, limited=(), excess=none, excess_slopes=np.zeros((0, model.z.size)), units=none)


LocalSearch = Callable[[Evaluate, tuple[BoundedVariable, ...], DesignEvaluation, ModelOf], Local]
