"""What datasets are made of: columns, harmonics, and what each says of itself."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

import numpy as np

from solver.results.dataset import Attribute, Variable
from solver.views.io import scene_attributes

if TYPE_CHECKING:
    from solver.jit.fourier import Real
    from solver.scene.scene import Scene

AMPLITUDE = "max|x| of the observed DOF"


def attributes(status: str, scene: Scene | None = None, **more: Attribute | None) -> dict[str, Attribute]:
    """What every dataset says of itself: the version, the status, the scene."""
    try:
        made_by = f"stickslip {version('stickslip')}"
    except PackageNotFoundError:
        made_by = "stickslip"
    given: Mapping[str, Attribute | None] = {"source": made_by, "status": status, **more}
    known = {name: value for name, value in given.items() if value is not None}
    return known if scene is None else {**known, **scene_attributes(scene)}


def column(dim: str, values: object, unit: str = "", about: str = "") -> Variable:
    """One value for each place along a dimension."""
    return Variable(dims=(dim,), values=np.asarray(values), unit=unit, about=about)


def harmonics(coefficients: Real, dims: tuple[str, ...], name: str, unit: str) -> dict[str, Variable]:
    """Cosine and sine parts of full coefficients (..., 2H + 1), each (..., H + 1); the mean is the first."""
    size = (coefficients.shape[-1] + 1) // 2
    cosine, sine = np.zeros((2, *coefficients.shape[:-1], size))
    cosine[..., 0], cosine[..., 1:] = coefficients[..., 0], coefficients[..., 1::2]
    sine[..., 1:] = coefficients[..., 2::2]
    words = f"of the {name.replace('_', ' ')}, by harmonic"
    return {
        f"{name}_cos": Variable(dims=dims, values=cosine, unit=unit, about=f"cosine part {words}"),
        f"{name}_sin": Variable(dims=dims, values=sine, unit=unit, about=f"sine part {words}"),
    }
