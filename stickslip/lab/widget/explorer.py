"""A widget for notebooks: the response of a scene, with sliders for what may be chosen.

It is an anywidget (the extra `notebook`): JupyterLab, Notebook, VS Code, Colab and marimo show it.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from typing import Any

import anywidget
import traitlets

from optim.problem.variables import BoundedVariable, check_variables
from solver.continuation.branches.sweep import sweep
from solver.scene.parameter_paths import parameter_of
from solver.scene.scene import Scene

_HARMONICS = 5


class Explorer(anywidget.AnyWidget):
    """The widget `explore` returns.

    Attributes
    ----------
    scene : Scene
        The scene with the values of the sliders.
    branch : Branch
        Its response, as the curve shows it; without an error estimate.
    """

    _esm = (resources.files(__package__) / "explorer.js").read_text(encoding="utf-8")
    sliders: traitlets.List[dict[str, Any]] = traitlets.List(help="Name, unit, value, place 0 to 1.").tag(
        sync=True
    )
    places = traitlets.Dict(help="What a slider was moved to: name to place.").tag(sync=True)
    curve = traitlets.Dict(help="Frequencies [Hz], amplitudes [m], highest peak, status.").tag(sync=True)
    before = traitlets.Dict(help="The curve of the scene as it was given.").tag(sync=True)

    def __init__(self, scene: Scene, variables: tuple[BoundedVariable, ...], harmonics: int) -> None:
        super().__init__()
        self._given, self._variables, self._harmonics, self._turn = scene, variables, harmonics, 0
        self._show(scene)
        self.before = self.curve
        self.observe(self._moved, names="places")

    @property
    def values(self) -> dict[str, float]:
        """Parameter path to value, where the sliders stand."""
        return {path: self.scene.value(path) for variable in self._variables for path in variable.paths}

    def _moved(self, _change: object) -> None:
        """Compute the response again; every slider that was never moved stays where the scene has it."""
        moved = {v: v.outside(float(self.places[v.name])) for v in self._variables if v.name in self.places}
        values = {path: value for variable, value in moved.items() for path in variable.paths}
        self._turn += 1
        self._show(self._given.with_values(values))

    def _show(self, scene: Scene) -> None:
        """Compute and draw a scene; `turn` tells the notebook that an equal curve is a new one."""
        self.scene, self.branch = scene, sweep(scene, harmonics=self._harmonics)
        branch, peak = self.branch, self.branch.peak
        self.sliders = [_slider(scene, variable) for variable in self._variables]
        self.curve = {
            "hertz": branch.values.tolist(), "amplitude": branch.amplitude.tolist(),
            "peak": None if peak is None else [peak.at, peak.value],
            "name": scene.measured.name, "told": "" if branch.reached else branch.status.value,
            "turn": self._turn,
        }  # fmt: skip


def _slider(scene: Scene, variable: BoundedVariable) -> dict[str, Any]:
    parameter = parameter_of(scene, variable.paths[0])
    value = scene.value(variable.paths[0])
    place = variable.inside(min(max(value, variable.low), variable.high))
    return {"name": variable.name, "unit": parameter.unit, "value": value, "place": place}


def explore(
    scene: Scene, variables: Mapping[str, tuple[float, float]] | None = None, *, harmonics: int = _HARMONICS
) -> Explorer:
    """Show a scene's response in a notebook, with a slider for each variable.

    Parameters
    ----------
    scene : what is looked at, over its band.
    variables : parameter path to (low, high), as `stickslip.design` takes them; without any, the N0 of the
        first contact whose amplitude is tied to it.
    harmonics : highest harmonic kept.

    Returns
    -------
    The widget; its `scene` has the values of the sliders, its `branch` the response.

    Raises
    ------
    DesignError, SettingError
        A path or a range that does not fit the scene.
    """
    return Explorer(scene, check_variables(scene, variables), harmonics)
