"""A criterion from outside the package: the root of the mean square of the amplitude over the band.

By Gauss' quadrature at fixed frequencies: its gradient and Hessian are exact for the sum.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import solver
from optim.criteria.criterion import Criterion, CriterionRow, Form, Judged, Key
from optim.criteria.key import PositiveNumber
from solver.balance.workspace import Workspace

if TYPE_CHECKING:
    from solver.scene.scene import Scene

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


def frequencies(scene: Scene) -> np.ndarray:
    low, high = scene.observe.band
    return 0.5 * (low + high) + 0.5 * (high - low) * NODES


def rows(judged: Judged) -> list[CriterionRow]:
    """One row: √(½ Σ wᵢ aᵢ²) with aᵢ at the nodes."""
    workspace = Workspace.of(judged.branch.balance)
    hertz = frequencies(judged.branch.balance.scene)
    found = [workspace.solve(2.0 * np.pi * hz).u.copy() for hz in hertz]
    paths = judged.problem.paths
    slopes = solver.Sensitivities(judged.branch.balance, paths if judged.gradients else ())
    points = [slopes.gradient(u, hz) for u, hz in zip(found, hertz, strict=True)]
    a = np.array([point.value for point in points])
    value = float(np.sqrt(0.5 * WEIGHTS @ a**2))
    if not judged.gradients:
        return [judged.row(RMS, "rms amplitude", value, None, bound=judged.limit(RMS))]
    da = np.array([point.by_parameters for point in points])
    gradient = 0.5 * (WEIGHTS * a) @ da / value

    def second() -> np.ndarray:
        dda = np.array([slopes.hessian(u, hz).hessian for u, hz in zip(found, hertz, strict=True)])
        inner = np.einsum("i,ij,ik->jk", WEIGHTS, da, da) + np.einsum("i,ijk->jk", WEIGHTS * a, dda)
        return (0.5 * inner - np.outer(gradient, gradient)) / value

    return [judged.row(RMS, "rms amplitude", value, gradient, bound=judged.limit(RMS), second=second)]


RMS = Criterion(
    name="rms amplitude",
    unit="m",
    help="The root of the mean square of the amplitude over the band.",
    rows=rows,
    weight="rms",
    keys=(
        Key(
            name="max_rms", annotation=PositiveNumber, form=Form.NUMBER, flag="--max-rms", metavar="A",
            help="Largest root of the mean square of the amplitude allowed [m].",
        ),
    ),
)  # fmt: skip
