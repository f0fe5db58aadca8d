"""Answers as components of OpenMDAO, with their exact partial derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from stickslip.lab.exports.exact_functions import AMPLITUDE, FREQUENCY, ExactFunction
from solver.errors import MissingExtraError
from solver.scene.scene import Scene

try:
    import openmdao.api as om
except ModuleNotFoundError as error:
    raise MissingExtraError("openmdao", "openmdao") from error


class FrictionComponent(om.ExplicitComponent):  # type: ignore[misc]
    """One function with an input for each path, and an output of its name.

    Parameters
    ----------
    function : of `stickslip.lab.exports.exact_functions`.
    scene : whose values the inputs have at first; all 1 if left out.

    An input is named as its path, with a colon for each dot: ``shroud:N0``. Where there is no answer, because
    an iteration did not converge, an `AnalysisError` tells the driver, which may try elsewhere.
    """

    def __init__(self, function: ExactFunction, scene: Scene | None = None) -> None:
        self._function, self._scene = function, scene
        self._at: tuple[bytes, float, Any] | None = None
        super().__init__()

    def setup(self) -> None:
        """Declare inputs, output and derivatives."""
        for path in self._function.paths:
            known = None if self._scene is None or path in (FREQUENCY, AMPLITUDE) else self._scene.value(path)
            self.add_input(_name(path), val=1.0 if known is None else known)
        self.add_output(self._function.name, units=self._function.unit or None)
        self.declare_partials(self._function.name, "*")

    def compute(self, inputs: Any, outputs: Any) -> None:
        """The value."""
        outputs[self._function.name] = self._both(inputs)[0]

    def compute_partials(self, inputs: Any, partials: Any) -> None:
        """The gradient, which came with the value."""
        for path, slope in zip(self._function.paths, self._both(inputs)[1].tolist(), strict=True):
            partials[self._function.name, _name(path)] = slope

    def _both(self, inputs: Any) -> tuple[float, Any]:
        x = np.array([inputs[_name(path)].item() for path in self._function.paths])
        if self._at is None or self._at[0] != x.tobytes():
            value, slopes = self._function(x)
            if not np.isfinite(value):
                given = ", ".join(
                    f"{path} = {one!r}" for path, one in zip(self._function.paths, x.tolist(), strict=True)
                )
                raise om.AnalysisError(f"there is no {self._function.name} at {given}")
            self._at = x.tobytes(), value, slopes
        return self._at[1:]


def _name(path: str) -> str:
    return path.replace(".", ":")
