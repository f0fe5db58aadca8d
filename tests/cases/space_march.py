"""One mass-point lump of three DOFs on one contact in space, marched by the kernels of time marching."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from solver.contacts.laws.contact_parts import Follows, Row
from solver.marching.kernels import march_state as kernel
from solver.marching.kernels.taylor import run_periods
from solver.marching.march_equations import columns
from solver.scene.scene_parameter import Term

DATA = json.loads((Path(__file__).parent.parent / "data" / "three_d.json").read_text())
CASES: dict[str, Any] = DATA["cases"]
DOFS = ("x", "y", "z")
STEPS, SAMPLES = 128, 2048


def matrices(scene: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, C and K of the lumped structure."""
    structure = scene["structure"]
    M = np.diag([structure["masses"][dof] for dof in DOFS])
    C, K = np.zeros((3, 3)), np.zeros((3, 3))
    for spring in structure["springs"]:
        row = np.array(
            [float(dof == spring["between"][0]) - float(dof == spring["between"][1]) for dof in DOFS]
        )
        K += spring["k"] * np.outer(row, row)
        C += spring.get("c", 0.0) * np.outer(row, row)
    return M, C, K


def contact_rows(contact: dict[str, Any]) -> tuple[Row, ...]:
    """The rows of a contact in space: two, of which the first presses."""
    box = contact["limit"] == "box"
    given: dict[str, Any] = {
        "kt": contact["kt"], "mu": contact["mu"], "N0": contact["N0"], "N1": contact["N1"],
        "kn": contact["kn"], "normal_port": 2,
    }  # fmt: skip
    rest = max(contact["N0"], 0.0) if contact["prestressed"] else 0.0
    follows = (Follows.RUBBING,) * 2 if box else (Follows.CIRCLE, Follows.CIRCLE_SECOND)
    first = Row(name="rub", follows=follows[0], rest=rest, **given)
    given["kt"] = contact.get("kt_second", contact["kt"])
    return first, Row(name="rub (second)", port=1, follows=follows[1], rest=rest, presses=0.0, **given)


@dataclass(frozen=True, kw_only=True)
class Marched:
    """What a march gives."""

    half_pp: np.ndarray
    mean: np.ndarray
    work: float
    change: float


def sparse(matrix: np.ndarray) -> kernel.SparseRows:
    n = len(matrix)
    return kernel.SparseRows(np.arange(0, n * n + 1, n), np.tile(np.arange(n), n), matrix.ravel().copy())


def march_case(scene: dict[str, Any], frequency_hz: float, tolerance: float = 1e-11) -> Marched:
    """March a scene of three_d.json from rest until it repeats."""
    omega = 2.0 * math.pi * frequency_hz
    M, C, K = matrices(scene)
    inverse = np.linalg.inv(M)
    index = {dof: i for i, dof in enumerate(DOFS)}
    forms = tuple((Term(dof, False, 1.0),) for dof in DOFS)
    forces = scene["excitation"]
    system = kernel.System(
        A=sparse(inverse @ K / omega**2),
        B=sparse(inverse @ C / omega),
        W=sparse(inverse / omega**2),
        force_dof=np.array([index[force["dof"]] for force in forces]),
        force_amplitude=np.array([force["amplitude"] for force in forces]),
        force_phase=np.array([force["phase"] for force in forces]),
        force_harmonic=np.ones(len(forces), np.int64),
        omega=omega,
        **columns([(row, forms) for row in contact_rows(scene["contacts"][0])], index, 3),
    )
    state = kernel.State(np.zeros(3), np.zeros(3), np.zeros(2), np.full(2, kernel.STICK), np.zeros((2, 1)))
    nothing = kernel.Record(np.empty(0), np.empty(0), *(np.empty((2, 0)) for _ in range(3)))
    code, _ = run_periods(system, state, STEPS, tolerance, 0, nothing, np.empty(4000))
    assert code == kernel.SETTLED
    half_pp, mean, work, change = np.empty(3), np.empty(3), 0.0, np.empty(1)
    for dof in range(3):
        record = kernel.Record(
            np.empty(SAMPLES), np.empty(SAMPLES), *(np.empty((2, SAMPLES)) for _ in range(3))
        )
        run_periods(system, state, STEPS, 0.0, dof, record, change)
        fine = np.fft.irfft(np.fft.rfft(record.x), 32 * SAMPLES) * 32
        half_pp[dof], mean[dof] = 0.5 * (fine.max() - fine.min()), record.x.mean()
        if dof < 2:
            work += float(record.force[dof] @ record.v) * 2.0 * math.pi / SAMPLES
    return Marched(half_pp=half_pp, mean=mean, work=work, change=float(change[0]))
