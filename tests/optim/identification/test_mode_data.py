"""Curves of nonlinear modes as data: truth comes back, derivatives are those of differences."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import optim
import solver
from solver.modes.at_amplitudes import mode_at_amplitudes

TRUTH = {"damper.kt": 33.0, "damper.mu": 0.27}
BOUNDS = {"damper.kt": (15.0, 80.0), "damper.mu": (0.1, 0.6)}
AMPLITUDES = np.geomspace(1.8, 60.0, 12)


def _measured(seed: int, damping_noise: float) -> dict[str, Any]:
    """A curve of whole modes with more harmonics than the fit has, and noise."""
    scene = solver.load_scene("two-dof").with_values(TRUTH)
    curve = solver.nonlinear_mode(scene, amplitudes=(0.3, 100.0), harmonics=13, errors=False)
    exact = mode_at_amplitudes(curve.scene, AMPLITUDES, (), harmonics=13)
    rng = np.random.default_rng(seed)
    frequency = exact.frequency_hz * (1.0 + 0.02 * damping_noise * rng.normal(size=AMPLITUDES.size))
    damping = exact.damping_ratio * (1.0 + damping_noise * rng.normal(size=AMPLITUDES.size))
    return {
        "modal_amplitude": AMPLITUDES.tolist(), "frequency": frequency.tolist(),
        "damping_ratio": damping.tolist(),
    }  # fmt: skip


def test_known_truth_comes_back_from_a_curve_of_the_mode() -> None:
    found = optim.identify(
        solver.load_scene("two-dof"), [_measured(1, 0.03)], BOUNDS, harmonics=7, starts=2, candidates={}
    )
    assert found.reached, found.status
    assert found.noise == pytest.approx(0.03, rel=0.4)
    for one in found.estimates:
        assert abs(one.value - TRUTH[one.name]) < 4.0 * one.standard_error
        assert one.standard_error < 0.05 * one.value
    found.plot()


def test_derivatives_are_those_of_differences() -> None:
    scene, paths = solver.load_scene("two-dof"), ("damper.kt", "damper.N0", "structure.k1")
    amplitudes = np.array([2.5, 20.0])
    found = mode_at_amplitudes(scene, amplitudes, paths, harmonics=5)
    assert np.isfinite(found.frequency_hz).all()
    for j, path in enumerate(paths):
        value = scene.value(path)
        ends = [
            mode_at_amplitudes(
                scene.with_values({path: value * (1.0 + h)}),
                amplitudes,
                (),
                harmonics=5,
                guesses=found.points,
            )
            for h in (1e-5, -1e-5)
        ]
        for slope, (high, low) in (
            (found.by_frequency[:, j], (ends[0].frequency_hz, ends[1].frequency_hz)),
            (found.by_damping[:, j], (ends[0].damping_ratio, ends[1].damping_ratio)),
        ):
            np.testing.assert_allclose(slope, (high - low) / (2e-5 * value), rtol=1e-4, atol=1e-9)


def test_a_file_says_the_mode_and_gives_conditions(tmp_path: Path) -> None:
    told = _measured(2, 0.02)
    rows = zip(told["modal_amplitude"], told["frequency"], told["damping_ratio"], strict=True)
    text = "# damper.N0 = 100\n# mode = 1\nmodal_amplitude,frequency [rad/s],damping_ratio\n"
    text += "\n".join(f"{a},{2.0 * np.pi * f},{z}" for a, f, z in rows)
    (tmp_path / "mode.csv").write_text(text, encoding="utf-8")
    known = {"damper.kt": BOUNDS["damper.kt"]}
    scene = solver.load_scene("two-dof").with_values({"damper.mu": TRUTH["damper.mu"]})
    found = optim.identify(scene, [tmp_path / "mode.csv"], known, harmonics=5, starts=1, candidates={})
    assert found.values["damper.kt"] == pytest.approx(TRUTH["damper.kt"], rel=0.03)
    assert found.runs[0]["conditions"] == {"damper.N0": 100.0}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"damping_ratio": [0.02, 1.5]}, "below 1"),
        ({"modal_amplitude": [1.0, 1.0]}, "upward or downward"),
        ({"frequency_sd": [0.1, 0.1]}, "damping_sd"),
        ({"mode": "9"}, "mode"),
    ],
)
def test_what_is_wrong_is_told(change: dict[str, Any], words: str) -> None:
    table = {"modal_amplitude": [1.0, 2.0], "frequency": [1.2, 1.1], "damping_ratio": [0.02, 0.05], **change}
    with pytest.raises(optim.DataError, match=words):
        optim.identify(solver.load_scene("two-dof"), [table], BOUNDS, harmonics=5)
