"""A structure given by its matrices in few motions, chosen for its contacts: modes of both their limits.

A Craig-Bampton basis keeps every DOF of a face, so that a patch of n nodes is solved in 3 n motions though
its structure moves in few. The lowest modes of the structure with all contacts free and with all of them
stuck span what lies between, with the static motions under the forces and the contacts' loads. How many are
enough is told by the peak in all motions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from solver.arrays import Real
from solver.balance.balance import build
from solver.balance.kernels.output import MAX_ABS, SLOPE
from solver.balance.workspace import Workspace
from solver.continuation.branches.sweep import sweep
from solver.continuation.walk import ContinuationSettings
from solver.errors import SettingError
from solver.linear.assembly import linear_model
from solver.matrices.diagnostics import mass_carried
from solver.matrices.load_set import MatrixSet
from solver.matrices.normal_modes import UndampedModes, undamped_modes
from solver.matrices.values import DofTable, NormalModes
from solver.response.contact_response import contact_responses
from solver.scene.excitation import AMPLITUDE
from solver.scene.scene import MatricesStructure, Scene

FEW, MORE, MOST = 20, 1.5, 120  # motions tried first, how many times as many next, and at most
GOOD = 2e-3  # relative error of the peak's height from which fewer motions are enough
_NEW = 1e-10  # squared length of what a motion adds to others as long as 1: less is rounding
_BEYOND = 3.0  # times the force at which the first contact slips, where all stick under the one given
# Share of the peak's width of the first step to the peak in all motions, how many times as long the next may
# be, how many there may be, and what share of the height the last gains.
_BESIDE, _FAR, _TRIES, _LITTLE = 1e-3, 8.0, 12, 1e-5


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactReduction:
    """A structure in few motions, and what they are worth."""

    scene: Annotated[Scene, "The same scene with its structure in these motions."]
    modes: Annotated[NormalModes, "Of the structure in these motions."]
    motions: Annotated[Real, "In the coordinates of the matrices, M-orthonormal, a column each, (n, r)."]
    error: Annotated[float | None, "Of the peak's height, relative; None where no peak was found to tell it."]
    free_hz: Annotated[float, "Highest frequency kept of the structure with all contacts free."]
    stuck_hz: Annotated[float, "The same with all contacts stuck."]

    def facts(self, found: MatrixSet, basis: Any) -> dict[str, Any]:
        """What is kept, for programs; `basis` (rows, n) is of the coordinates in the rows that are found."""
        return {
            "count": self.modes.omega2.size, "error": self.error, "free_hz": self.free_hz,
            "stuck_hz": self.stuck_hz, "mass_carried": mass_carried(found, basis @ self.motions),
        }  # fmt: skip


def reduce_for_contacts(scene: Scene, count: int | None = None) -> ContactReduction:
    """Write the structure of a scene in `count` motions, or as many as the error of the peak asks for.

    The error is that of the response with one harmonic under the forces given, and where all contacts stick
    under forces at which they slip: its highest peak in these motions against the same in all of them.

    Raises
    ------
    SettingError
        A structure that is not given by symmetric M and K alone, or that is unstable.
    """
    structure, wanted = scene.structure, "must be `matrices` with M and K alone to be written in motions"
    if not isinstance(structure, MatricesStructure) or structure.M is None or structure.has_sectors:
        raise SettingError("structure", structure.kind, wanted)
    model = linear_model(scene)
    if structure.C is not None or model.extra is not None or len(model.M) != structure.n_coordinates:
        raise SettingError("structure", structure.kind, wanted)
    K, M, L = model.K0, model.M, model.contact_here
    limits = undamped_modes(K, M), undamped_modes(K + L.T @ (model.port_stiffnesses[:, None] * L), M)
    if limits[0].omega2.min() < -limits[0].sigma * _NEW - _NEW * limits[0].omega2.max():
        raise SettingError("structure", structure.kind, "must have a positive semidefinite K")
    loads = np.array([*(force.vector.real for force in model.forces), _pressed(scene, len(L)) @ L])
    size = FEW if count is None else count
    while True:
        motions = _motions(K, M, limits, loads, min(size, len(M)))
        omega2 = np.maximum(np.einsum("ij,ij->j", motions, K @ motions), 0.0)
        modes = NormalModes(omega2=omega2, modes=model.shapes[: len(structure.dofs)] @ motions)
        small = _in_modes(scene, structure, modes)
        error = peak_error(scene, small)
        if count is not None or size >= min(MOST, len(M)) or (error is not None and error <= GOOD):
            highest = [np.sqrt(max(each.omega2[size // 2 - 1], 0.0)) / (2.0 * np.pi) for each in limits]
            return ContactReduction(
                scene=small, modes=modes, motions=motions, error=error, free_hz=highest[0],
                stuck_hz=highest[1],
            )  # fmt: skip
        size = int(MORE * size)


def _pressed(scene: Scene, n_ports: int) -> Real:
    """Return the mean loads of the contacts at the ports along which they press (n_ports,) [N]."""
    found, first = np.zeros(n_ports), 0
    for contact in scene.contacts:
        if contact.normal_port is not None and contact.load is not None:
            found[first + contact.normal_port] = contact.load.mean
        first += len(contact.end_keys)
    return found


def _motions(K: Real, M: Real, limits: tuple[UndampedModes, UndampedModes], loads: Real, count: int) -> Real:
    """Return about `count` motions (n, r), M-orthonormal and K-orthogonal, lowest first."""
    free, stuck = limits
    bent = stuck.psi @ (stuck.psi.T @ loads.T)
    bent = bent[:, np.any(bent, axis=0)]
    low = count - count // 2 - bent.shape[1]
    basis = np.hstack([bent, stuck.phi[:, : max(low, 1)], free.phi[:, : count // 2]])
    basis /= np.sqrt(np.einsum("ij,ij->j", basis, M @ basis))
    lengths, turned = np.linalg.eigh(basis.T @ M @ basis)
    new = lengths > _NEW
    basis = basis @ (turned[:, new] / np.sqrt(lengths[new]))
    return np.asarray(basis @ np.linalg.eigh(basis.T @ K @ basis)[1])


def _in_modes(scene: Scene, structure: MatricesStructure, modes: NormalModes) -> Scene:
    dofs = DofTable.read({name: row for row, name in enumerate(structure.dofs)})
    given = {"M": None, "K": None, "reduction": None, "modes": modes, "dofs": dofs}
    return scene.model_copy(update={"structure": structure.model_copy(update=given)})


def peak_error(scene: Scene, small: Scene) -> float | None:
    """Return the relative error of the highest peak of a scene in fewer motions, with one harmonic.

    None where no response has a peak, or the one in all motions has none near it.
    """
    error, used = _at_peak(scene, small)
    if error is None or not 0.0 < used < 1.0:
        return error
    amplitude = {AMPLITUDE: scene.excitation[0].amplitude * _BEYOND / used}
    harder, _ = _at_peak(*(each.with_values(amplitude) for each in (scene, small)))
    return None if harder is None else max(error, harder)


def _at_peak(scene: Scene, small: Scene) -> tuple[float | None, float]:
    """Return the error of the highest peak under the forces given, and the most of its limit a contact uses.

    In all motions the peak is where the slope by the frequency is 0, by the secant from the one in few.
    """
    branch = sweep(small, harmonics=1, settings=ContinuationSettings(errors=False))
    peak, band = branch.peak, branch.band
    if not branch.reached or peak is None or not peak.interior or band is None:
        return None, 1.0
    few, every = (Workspace.of(build(each, harmonics=1)) for each in (small, scene))
    p, u, before = 2.0 * np.pi * peak.at, peak.solution, (np.nan, np.nan)
    used = float(np.nanmax([each.utilisation for each in contact_responses(few, u, p)]))
    step = 2.0 * np.pi * _BESIDE * band.width
    for _ in range(_TRIES):
        found = every.solve_from(p, u)
        seen = every.measure(found.u, p) if found.converged else None
        if seen is None:
            break
        u, height, slope = found.u, float(seen.values[MAX_ABS]), float(seen.values[SLOPE])
        bend = (slope - before[1]) / (p - before[0])
        if bend >= 0.0:
            break
        if bend < 0.0:
            step = float(np.clip(-slope / bend, -_FAR * abs(step), _FAR * abs(step)))
            if abs(slope * step) <= _LITTLE * height:
                return abs(peak.value / (height + 0.5 * slope * step) - 1.0), used
        else:
            step = float(np.copysign(step, slope))
        before, p = (p, slope), p + step
    return None, used
