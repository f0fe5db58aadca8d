"""Measured quantities: values as `solve` reports them, derivatives as central differences of it."""

import numpy as np
import pytest
from each import each

import solver
from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.errors import SettingError
from solver.sensitivity.observed import ObservedSensitivities, Quantity

PATHS = {
    "two-dof": ["damper.kt", "damper.mu", "damper.N0", "damper.N1_ratio", "structure.k1", "excitation.phase"],
    "bladed-disk": ["shroud.kt", "shroud.mu", "shroud.N0", "root.kt", "structure.tip_middle"],
}
POINTS = [("two-dof", 1.3), ("bladed-disk", 700.0), ("bladed-disk", 752.0)]
ALL = Effects(even_harmonics=True)


def measured(scene: solver.Scene, at_hz: float, quantity: Quantity) -> np.ndarray:
    """The quantity by the way of the public response."""
    found = solver.solve(scene, frequency_hz=at_hz, harmonics=7, effects=ALL)
    amplitude = complex(found.observed[1], -found.observed[2])
    values = {
        Quantity.AMPLITUDE: [abs(amplitude)],
        Quantity.COMPLEX: [amplitude.real, amplitude.imag],
        Quantity.MAX_ABS: [found.max_abs],
        Quantity.HALF_PEAK_TO_PEAK: [found.half_peak_to_peak],
    }
    return np.array(values[quantity])


@each("quantity", Quantity)
@each(("name", "at_hz"), POINTS)
def test_derivatives_against_differences_of_solve(name: str, at_hz: float, quantity: Quantity) -> None:
    scene, paths = solver.load_scene(name), PATHS[name]
    found = ObservedSensitivities(build(scene, harmonics=7, effects=ALL), paths)
    seen = found.observed(found.solve(at_hz, ()).u, at_hz, quantity)
    assert seen is not None
    assert seen.values == pytest.approx(measured(scene, at_hz, quantity), rel=1e-9)
    size = np.abs(seen.values).max()
    for column, path in enumerate(paths):
        value = scene.value(path)
        step = 1e-5 * (abs(value) or 1.0)
        ends = [measured(scene.with_values({path: value + s * step}), at_hz, quantity) for s in (-1, 1)]
        known = (ends[1] - ends[0]) / (2.0 * step)
        scale = max(np.abs(known).max(), 1e-4 * size / (abs(value) or 1.0))
        assert np.abs(seen.slopes[:, column] - known).max() <= 1e-6 * scale


def test_a_harmonic_that_is_not_kept_is_refused() -> None:
    found = ObservedSensitivities(build(solver.load_scene("two-dof"), harmonics=3), ["damper.mu"])
    with pytest.raises(SettingError, match="harmonic"):
        found.observed(found.solve(1.3, ()).u, 1.3, Quantity.AMPLITUDE, harmonic=9)
