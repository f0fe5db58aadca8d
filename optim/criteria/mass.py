"""The mass of the bodies of a scene, such as dampers: their sum, of a disk those of one sector."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from optim.criteria.criterion import (
    Criterion,
    CriterionContext,
    CriterionRow,
    Form,
    Judged,
    Key,
    positive_limit,
)
from optim.criteria.key import PositiveNumber

if TYPE_CHECKING:
    from optim.problem.variables import Real
    from solver.scene.scene import Scene


def _rows(judged: Judged) -> list[CriterionRow]:
    import numpy as np

    scene, paths = judged.branch.balance.scene, judged.problem.paths
    bodies = {body.name: body.mass for body in scene.bodies if body.name.partition("@")[2] in ("", "0")}
    slope = None
    if judged.gradients:
        slope = np.array([sum(_gained(scene, path, name) for name in bodies) for path in paths])
    return [
        judged.row(
            MASS, "mass of the bodies", sum(bodies.values()), slope, bound=judged.limit(MASS),
            second=partial(np.zeros, (len(paths), len(paths))),
        )
    ]  # fmt: skip


def _gained(scene: Scene, path: str, body: str) -> float:
    """Return what a body gains by a unit of a parameter: of its mass matrix the first entry."""
    from solver.scene.parameter_paths import parameter_of

    matrix: Real | None = parameter_of(scene, path).slope().masses.get(body)
    return 0.0 if matrix is None else float(matrix[0, 0])


def _lacking(scene: Scene) -> str:
    return "" if scene.bodies else "needs `bodies` or `dampers` by their shape"


def _read(asked: CriterionContext) -> object:
    from optim.problem.checks import DesignError

    if _lacking(asked.scene):
        raise DesignError("max_mass", asked.values["max_mass"], _lacking(asked.scene))
    return positive_limit(asked)


MASS = CRITERION = Criterion(
    name="mass",
    unit="kg",
    help="The mass of all bodies, dampers by their shape among them; of a disk that of one sector.",
    rows=_rows,
    weight="mass",
    keys=(
        Key(
            name="max_mass", annotation=PositiveNumber, form=Form.NUMBER, flag="--max-mass", metavar="KG",
            help="Largest mass of all bodies [kg].",
        ),
    ),
    read=_read,
    lacking=_lacking,
    limit_name="mass limit",
    with_place=False,
)  # fmt: skip
