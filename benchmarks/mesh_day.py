"""A designer's day with a real mesh: from its matrices to a design and its report, each step timed.

The mesh is that of `docs/fe/face.py`: a blade of some 3000 nodes whose platform rubs with a face of 56 nodes,
or of 4000 nodes and 100.
"""

from __future__ import annotations

import contextlib
import io
import runpy
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import optim
import solver
from benchmarks.harness import expect, table
from solver import Scene

FACE = Path(__file__).resolve().parents[1] / "docs" / "fe" / "face.py"
LOAD, HARMONICS = "plat.N0", 5
FREE, STUCK, RANGE = 0.0, 1e5, (5.0, 3000.0)  # N on the face
PATCH = "plat=FACE:ground,normal=y,kt=2e7,kn=4e7,mu=0.3,N0=300"
DAYS = {"small": ("", None), "56": ("--fine", None), "100": ("--finer", 40)}
"""The mesh of each day, and how many motions it is written in; None: as many as it takes."""


def command(*words: object) -> str:
    """What a command prints, which must end well."""
    from service.cli import main

    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        code = main([str(word) for word in words])
    expect(f"stickslip {words[0]} ends with {code}", code == 0)
    return out.getvalue()


@cache
def mesh_of(day: str) -> tuple[Path, int]:
    """The folder with the matrices of a day, made once, and the number of its nodes."""
    folder = Path(tempfile.mkdtemp(prefix=f"mesh-{day}-"))
    made = runpy.run_path(str(FACE))
    with contextlib.redirect_stdout(io.StringIO()):
        _, nodes, _ = made["write"](folder, made["SIZES"][DAYS[day][0]])
    return folder, nodes


def imported(day: str, name: str = "scene") -> Path:
    """The scene that `import --patch` makes of the mesh of a day."""
    folder, nodes = mesh_of(day)
    target = folder / f"{name}.toml"
    for path in (target, folder / f"{name}-reduced.npz"):
        path.unlink(missing_ok=True)
    motions = () if DAYS[day][1] is None else ("--modes", DAYS[day][1])
    files = [folder / name for name in ("face-M.npz", "face-K.npz", "face.dof")]
    ends = ("--dof", f"tip={nodes}.UY", "--force", "tip=2")
    command(
        "import", *files, "--nodes", folder / "face.inp", "--out", target, *ends, "--patch", PATCH, *motions
    )
    return target


@cache
def scene_of(day: str) -> Scene:
    """That scene, imported once."""
    return solver.load_scene(imported(day))


def steps(day: str) -> dict[str, Callable[[], Any]]:
    """The steps of a day by their names, in their order; each can be called again."""
    path, scene = imported(day), scene_of(day)
    load = scene.with_values

    def swept(value: float) -> Callable[[], Any]:
        return lambda: solver.sweep(load({LOAD: value}), harmonics=HARMONICS)

    report = path.with_suffix(".html")
    between = (LOAD, *RANGE, "--harmonics", HARMONICS)
    return {
        "import": lambda: imported(day, "again"),
        "solve": lambda: solver.solve(scene, frequency_hz=scene.observe.band[0], harmonics=HARMONICS),
        "sweep": swept(300.0),
        "free: no load": swept(FREE),
        "stuck: 100 kN": swept(STUCK),
        "design with report": lambda: command("design", path, "--variable", *between, "--report", report),
        "robust, mu 0.25 to 0.35": lambda: optim.robust_design(
            scene, variables={LOAD: RANGE}, uncertain={"plat.mu": (0.25, 0.35)}, harmonics=HARMONICS
        ),
        "margin": lambda: command(
            "margin", path, "--from", 1, "--to", 4, "--points", 3, "--limit", 0.01, "--harmonics", HARMONICS
        ),
    }  # fmt: skip


def mesh_day(days: tuple[str, ...] = ("small", "56")) -> None:
    """Each step of the day, after one solve that loads what is compiled."""
    for day in days:
        rows = []
        todo = steps(day)
        todo["solve"]()
        for name, step in todo.items():
            begun, clock = time.process_time(), time.perf_counter()
            found = step()
            spent = f"{time.process_time() - begun:.2f}", f"{time.perf_counter() - clock:.1f}"
            rows.append((name, *spent, _said(found)))
            print(*rows[-1], flush=True)
        scene = scene_of(day)
        modes = scene.structure.modes
        expect("the structure is written in motions", modes is not None)
        what = f"a face of {len(scene.contacts)} pairs in {modes.omega2.size} motions, H = {HARMONICS}"
        table(what, ("step", "s (process)", "s (wall)", "found"), rows)


def _said(found: Any) -> str:
    """What a step found, in a few words."""
    if isinstance(found, Path):
        return found.name
    if isinstance(found, str):
        told = [line for line in found.splitlines() if line.startswith(("plat.N0", "peak", "objective"))]
        return " ".join(" ".join(told[:2]).split())
    if isinstance(found, optim.RobustResult):
        return f"{found.optimum} {found.objective:.4g}"
    if hasattr(found, "peak"):
        return f"{1e3 * found.peak.value:.4g} mm at {found.peak.at:.5g} Hz, {len(found.values)} points"
    return f"{1e3 * found.max_abs:.4g} mm"
