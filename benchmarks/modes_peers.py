"""One nonlinear mode beside tmdsimpy and NLvib in one run: the same structures over the same amplitudes."""

from __future__ import annotations

import importlib.util
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh

import solver
from benchmarks.beam import beam
from benchmarks.harness import WrongResultError, expect, table, timed
from benchmarks.peers import LONGEST, ONE_THREAD
from benchmarks.problems import case_a
from solver import Scene
from solver.linear.assembly import linear_model
from solver.modes.at_amplitudes import mode_at_amplitudes

HERE = Path(__file__).resolve().parent
HARMONICS = 11
SAMPLES = 256  # instants of a period at which the others evaluate friction
OMEGA_OFF, ZETA_OFF = 1e-3, 2e-2  # relative: sampling the friction force costs so much
TMDSIMPY, TMDSIMPY_PYTHON, NLVIB = "TMDSIMPY", "TMDSIMPY_PYTHON", "NLVIB"
WANTED = 100.0


class Case(NamedTuple):
    """A structure with equal Jenkins elements to the ground, and the amplitudes [√kg m] of its first mode."""

    name: str
    scene: Scene
    amplitudes: tuple[float, float]
    step: float  # the others' arc length


@dataclass(frozen=True, slots=True, kw_only=True)
class PeerCurve:
    """A curve by another code: seconds on the wall and of the process, and its points."""

    seconds: float
    cpu_seconds: float
    amplitude: list[float]
    omega: list[float]
    zeta: list[float]


def one_mass() -> Scene:
    """A mass on a spring with a slider to the ground."""
    return Scene.from_dict(
        {
            "name": "one-mass",
            "structure": {
                "kind": "lumped", "masses": {"x": 1.0},
                "springs": [{"between": ["x", "ground"], "k": 1.0, "c": 0.01}],
            },
            "contacts": [{"name": "slider", "between": ["x", "ground"], "kt": 0.25, "mu": 0.2, "N0": 1.0}],
            "excitation": {"dof": "x", "amplitude": 1.0},
            "observe": {"dof": "x", "band": [0.05, 0.5]},
        }
    )  # fmt: skip


def cases() -> tuple[Case, ...]:
    """One mass, two masses with one slider, and a cantilever of 8 DOFs with four."""
    return (
        Case("one mass, one slider", one_mass(), (0.1, 100.0), 0.1),
        Case("case A: two masses, one slider", case_a(), (0.3, 100.0), 0.1),
        Case("cantilever of 8 DOFs, four sliders", beam(4), (1e-4, 0.1), 0.1),
    )


def modes_peers() -> None:
    """One nonlinear mode at H = 11 beside tmdsimpy and NLvib: time of a curve, and how far they are apart."""
    rows = []
    for case in cases():
        found, timing = timed(
            lambda case=case: solver.nonlinear_mode(
                case.scene, 1, amplitudes=case.amplitudes, harmonics=HARMONICS, errors=False
            ),
            runs=7,
        )
        expect(f"the mode of {case.name}: {found.status.value}", found.reached)
        rows.append(
            (
                case.name,
                "stickslip",
                str(found.amplitude.size),
                _ms(timing.cpu),
                _ms(timing.least),
                "",
                "",
                "",
            )
        )
        for name, peer in _peers(_task(case)):
            if isinstance(peer, str):
                rows.append((case.name, name, peer, "", "", "", "", ""))
                continue
            rows.append((case.name, name, *_beside(case, peer, timing.cpu, float(found.damping_ratio.max()))))
    header = ("first mode", "code", "points", "ms (process)", "ms (wall)", "times slower", "ω off", "ζ off")
    table(f"One nonlinear mode by the extended periodic motion concept, H = {HARMONICS}", header, rows)
    print(
        f"others at {SAMPLES} instants a period, wanted {WANTED:g} times slower; off: from ours at their "
        "amplitudes, ω relative, ζ of the largest"
    )


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.1f}"


def _beside(case: Case, peer: PeerCurve, ours: float, damping: float) -> tuple[str, ...]:
    """Return the columns of a peer; one that ends too early says where, and is compared up to there.

    Parameters
    ----------
    ours, damping : the time of our curve [s], and its largest ζ.

    Raises
    ------
    WrongResultError
        Its curve is not ours.
    """
    amplitude = np.array(peer.amplitude)
    low, high = case.amplitudes
    whole = bool(amplitude.max() >= 0.99 * high)
    inside = (amplitude >= low) & (amplitude <= high)
    mine = mode_at_amplitudes(case.scene, amplitude[inside], [], mode=1, harmonics=HARMONICS)
    omega = np.array(peer.omega)[inside] / (2.0 * math.pi * mine.frequency_hz) - 1.0
    zeta = (np.array(peer.zeta)[inside] - mine.damping_ratio) / damping
    off = float(np.abs(omega).max()), float(np.abs(zeta).max())
    expect(f"ω agrees, off by {off[0]:.1e}", off[0] <= OMEGA_OFF)
    expect(f"ζ agrees, off by {off[1]:.1e} of the largest", off[1] <= ZETA_OFF)
    return (
        str(amplitude.size) if whole else f"{amplitude.size}, ends at {amplitude.max():.1e}",
        _ms(peer.cpu_seconds), _ms(peer.seconds), f"{peer.cpu_seconds / ours:.0f}" if whole else "",
        f"{off[0]:.0e}", f"{off[1]:.0e}",
    )  # fmt: skip


def _task(case: Case) -> dict[str, Any]:
    """Return the problem of the runners: matrices, sliders, and the mode with every slider stuck."""
    scene = case.scene
    model = linear_model(scene)
    contact = scene.contacts[0]
    sliders = [int(np.flatnonzero(row).item()) for row in model.contact_here]
    M, C, K = model.M, model.C0, model.K0
    stuck = K.copy()
    stuck[sliders, sliders] += contact.kt
    squared, shapes = eigh(stuck, M)
    omega, shape = math.sqrt(squared[0]), shapes[:, 0]
    return {
        "M": M.tolist(), "C": C.tolist(), "K": K.tolist(), "sliders": sliders, "kt": contact.kt,
        "limit": contact.mu * contact.N0, "harmonics": HARMONICS, "samples": SAMPLES, "runs": 2,
        "log10": [math.log10(a) for a in case.amplitudes], "step": case.step, "omega": omega,
        "zeta": float(shape @ C @ shape) / (2.0 * omega), "shape": shape.tolist(),
    }  # fmt: skip


def _peers(task: dict[str, Any]) -> list[tuple[str, PeerCurve | str]]:
    """Return each other code with its curve, or with the reason why there is none."""
    every = [*range(HARMONICS + 1)]
    return [
        ("tmdsimpy", _tmdsimpy({**task, "kept": every})),
        ("tmdsimpy, odd harmonics alone", _tmdsimpy({**task, "kept": every[1::2]})),
        ("NLvib, Octave", _nlvib(task)),
    ]


def _tmdsimpy(task: dict[str, Any]) -> PeerCurve | str:
    told = by_tmdsimpy({**task, "what": "mode"})
    return told if isinstance(told, str) else PeerCurve(**told)


def by_tmdsimpy(task: dict[str, Any]) -> dict[str, Any] | str:
    """Return what the runner of tmdsimpy finds, or a sentence why there is nothing."""
    folder, python = os.environ.get(TMDSIMPY) or None, os.environ.get(TMDSIMPY_PYTHON, sys.executable)
    if folder is None and TMDSIMPY_PYTHON not in os.environ and importlib.util.find_spec("tmdsimpy") is None:
        return f"not installed: {TMDSIMPY} names its folder"
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": folder or ""}
    done = _run([python, str(HERE / "tmdsimpy_runner.py")], environment, json.dumps(task))
    if isinstance(done, str):
        return done
    told: dict[str, Any] = json.loads(done.stdout)
    return told


def _nlvib(task: dict[str, Any]) -> PeerCurve | str:
    folder, octave = os.environ.get(NLVIB) or None, shutil.which("octave-cli")
    if octave is None or folder is None:
        return "octave-cli is not installed" if octave is None else f"not installed: {NLVIB} names its folder"
    with tempfile.TemporaryDirectory() as name:
        asked, answer = Path(name) / "task.json", Path(name) / "answer.json"
        asked.write_text(json.dumps(task), encoding="utf-8")
        words = [octave, "--norc", "--quiet", str(HERE / "nlvib_runner.m"), folder, str(asked), str(answer)]
        done = _run(words, {**os.environ, **ONE_THREAD}, "")
        return done if isinstance(done, str) else PeerCurve(**json.loads(answer.read_text("utf-8")))


def _run(words: list[str], environment: dict[str, str], text: str) -> subprocess.CompletedProcess[str] | str:
    """Run another code; a sentence where it takes too long."""
    try:
        done = subprocess.run(
            words, input=text, capture_output=True, text=True, check=False, timeout=LONGEST, env=environment
        )
    except subprocess.TimeoutExpired:
        return f"stopped after {LONGEST:g} s"
    if done.returncode != 0:
        raise WrongResultError(f"{words[0]} ended with an error: {done.stderr.strip()[-1000:]}")
    return done
