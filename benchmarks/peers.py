"""What other codes take for the same problems: measured figures to quote, and pyHarm run side by side."""

from __future__ import annotations

import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.harness import WrongResultError
from solver import Scene
from solver.linear.assembly import linear_model

RUNNER = Path(__file__).with_name("pyharm_runner.py")
INTERPRETER = "PYHARM_PYTHON"
HOW = (
    "pyHarm is not installed: make an environment of its own (python -m venv, then pip install pyharm-os) "
    f"and name its interpreter in {INTERPRETER}."
)
ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
}
LONGEST = 900.0  # s a response of pyHarm may take


@dataclass(frozen=True, slots=True, kw_only=True)
class Quoted:
    """A figure of another code, measured on another machine: one thread, ratios are what to keep."""

    pyharm: str
    tmdsimpy: str
    nlvib: str
    nlvib_py: str


QUOTED = {
    "case A, H = 11: s (points)": Quoted(
        pyharm="1.46 (225)", tmdsimpy="1.39 (224)", nlvib="11.1 (224)", nlvib_py="17.7 (223)"
    ),
    "case A, fewest points: s (points)": Quoted(
        pyharm="0.38 (26, peak off 4e-4)", tmdsimpy="0.40 (62)", nlvib="", nlvib_py=""
    ),
    "chain of 8, 8 sliders: ms a point": Quoted(pyharm="65", tmdsimpy="47", nlvib="431", nlvib_py=""),
    "chain of 32, 32 sliders: s": Quoted(pyharm="247", tmdsimpy="198", nlvib="", nlvib_py=""),
    "chain of 32, one slider: ms a point": Quoted(pyharm="488", tmdsimpy="312", nlvib="", nlvib_py=""),
    "best constant N0 of case A: s": Quoted(pyharm="7.2", tmdsimpy="9.1", nlvib="", nlvib_py=""),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PeerRun:
    """One response of another code.

    Attributes
    ----------
    seconds, cpu_seconds : float
        Of the whole response, warm, the fastest of the runs.
    points, failed : int
        Points of the branch, and attempts that did not converge.
    peak, at_hz : float
        The highest point [m] and where it is [Hz].
    """

    seconds: float
    cpu_seconds: float
    points: int
    failed: int
    peak: float
    at_hz: float


def interpreter() -> str | None:
    """Return the Python that has pyHarm, or None."""
    if importlib.util.find_spec("pyHarm") is not None:
        return sys.executable
    return os.environ.get(INTERPRETER)


def pyharm(
    scene: Scene, *, step: float, harmonics: int = 11, band: tuple[float, float] | None = None, runs: int = 1,
    warm_up: int = 1,
) -> PeerRun | None:  # fmt: skip
    """Let pyHarm compute the response of a chain with equal sliders to the ground; None without pyHarm.

    Parameters
    ----------
    scene : lumped, its contacts all alike with a constant load, its forces all alike.
    step : largest arc length step [rad/s and m], by which the number of points is set.
    band : Hz, the scene's if left out.

    Raises
    ------
    WrongResultError
        pyHarm did not end within `LONGEST` seconds, or ended with an error.
    """
    task = _task(scene, step, harmonics, band, runs, warm_up)
    answer = _asked(task)
    return None if answer is None else PeerRun(**answer)


@dataclass(frozen=True, slots=True, kw_only=True)
class PeerOptimum:
    """The best load by another code: time, responses and points it took, the load [N] and its peak [m]."""

    seconds: float
    cpu_seconds: float
    responses: int
    points: int
    failed: int
    at: float
    peak: float


def pyharm_optimum(
    scene: Scene, low: float, high: float, *, step: float, accuracy: float
) -> PeerOptimum | None:
    """Let SciPy's bounded search choose the load by pyHarm's responses, to `accuracy` [N]."""
    task = _task(scene, step, 11, None, 1, 1)
    answer = _asked({**task, "loads": [low, high], "accuracy": accuracy})
    return None if answer is None else PeerOptimum(**answer)


def _task(
    scene: Scene, step: float, harmonics: int, band: tuple[float, float] | None, runs: int, warm_up: int
) -> dict[str, Any]:
    """Return the problem of the runner."""
    model = linear_model(scene)
    index = {dof: i for i, dof in enumerate(scene.structure.dofs)}
    contact, force = scene.contacts[0], scene.excitation[0]
    return {
        "M": model.M.tolist(), "C": model.C0.tolist(), "K": model.K0.tolist(),
        "kt": contact.kt, "mu": contact.mu, "N0": contact.N0,
        "sliders": [index[end.dof] for one in scene.contacts for end in one.ends if end.dof is not None],
        "forced": [index[one.dof] for one in scene.excitation], "amplitude": force.amplitude,
        "observed": index[scene.observe.dof], "band": list(band or scene.observe.band), "step": step,
        "harmonics": harmonics, "samples": 256, "runs": runs, "warm_up": warm_up,
    }  # fmt: skip


def _asked(task: dict[str, Any]) -> dict[str, Any] | None:
    """Return the runner's answer; None without pyHarm."""
    python = interpreter()
    if python is None:
        return None
    # pyHarm leaves a folder where it runs.
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [python, str(RUNNER)], input=json.dumps(task), capture_output=True, text=True, check=False,
            timeout=LONGEST, cwd=folder, env={**os.environ, **ONE_THREAD},
        )  # fmt: skip
    if done.returncode != 0:
        raise WrongResultError(f"pyHarm ended with an error: {done.stderr.strip().splitlines()[-1:]}")
    answer: dict[str, Any] = json.loads(done.stdout)
    if not answer.pop("last_hz") >= (1.0 - 1e-9) * task["band"][1] or not math.isfinite(answer["peak"]):
        raise WrongResultError("pyHarm did not reach the end of the band")
    return answer
