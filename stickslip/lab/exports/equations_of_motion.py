"""The equations of motion of a scene as arrays, for programs that solve them: `solver` is not asked again.

With coordinates q of a structure, reduced or not, loads N and friction forces F of the contacts,

    M q'' + C q' + K q + Σ_j (along_j F_j + normal_j P_j) = Σ_i force_i a_i cos(h_i ω t + φ_i),

u = along q, v = normal q the relative motions, N = N0 + Σ_k N_k cos(kωt + φ_k) + kn v. Of the laws `coulomb`
and `elastic-normal` F' = kt u' while |F| < μN, else F = ±μN while it slips that way, F = 0 while N <= 0, and
P = max(N, 0), less max(N0, 0) if v counts from a prestressed state; of the law `gap` F = k max(u - gap, 0).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.contact_parts import Follows, Row
from solver.errors import SettingError
from solver.jit.fourier import Integer, Real
from solver.linear.assembly import check_structure, linear_model
from solver.linear.model import LinearModel
from solver.marching.march import whole
from solver.scene.parameter_paths import check_frequency
from solver.scene.scene import Scene

CARRIED = (Follows.FRICTION, Follows.RUBBING, Follows.GAP)
_EXPORTED = "to be exported"


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactRows:
    """The contacts, or the directions of one that has a limit in each; m of them."""

    names: Annotated[tuple[str, ...], "Their names."]
    laws: Annotated[tuple[str, ...], "Their laws."]
    follows: Annotated[Integer, "0 friction, 1 friction under a load that moves, 2 a gap, (m,)."]
    along: Annotated[Real, "Rows of the motions u they pull along, (m, n)."]
    normal: Annotated[Real, "Rows of the motions v that press them, 0 where the load is given, (m, n)."]
    kt: Annotated[Real, "Tangential stiffness, of a gap its stiffness [N/m], (m,)."]
    mu: Annotated[Real, "Friction coefficient, (m,)."]
    N0: Annotated[Real, "Mean of the given load [N], (m,)."]
    wave: Annotated[Real, "Amplitudes N_k of its harmonics 1 to k [N], (m, k)."]
    wave_phase: Annotated[Real, "Their phases [rad], (m, k)."]
    ratio: Annotated[Real, "The first amplitude over N0 where it is tied to it, else 0, (m,)."]
    kn: Annotated[Real, "Normal stiffness [N/m], (m,)."]
    presses: Annotated[Real, "1 where the load acts on the normal motion, (m,)."]
    prestressed: Annotated[Real, "1 where max(N0, 0) is in equilibrium at rest, (m,)."]
    gap: Annotated[Real, "Gap [m], (m,)."]


@dataclass(frozen=True, slots=True, kw_only=True)
class EquationsOfMotion:
    """The equations of motion of a scene, n coordinates; a disk written out."""

    scene: Annotated[Scene, "What they are of."]
    frequency_hz: Annotated[float, "Frequency of the excitation [Hz]."]
    M: Annotated[Real, "Mass [kg], (n, n)."]
    C: Annotated[Real, "Damping [N s/m], (n, n)."]
    K: Annotated[Real, "Stiffness [N/m], (n, n)."]
    dofs: Annotated[tuple[str, ...], "Names of the degrees of freedom x."]
    shapes: Annotated[Real, "x = shapes q, (n_dofs, n)."]
    observe: Annotated[Real, "Row of the observed motion, (n,)."]
    force: Annotated[Real, "Rows along which forces act, (f, n)."]
    amplitude: Annotated[Real, "Their amplitudes a [N], (f,)."]
    phase: Annotated[Real, "Their phases φ [rad], (f,)."]
    harmonic: Annotated[Integer, "Their harmonics h, 0 of a static load, (f,)."]
    contacts: ContactRows


def equations_of(scene: Scene, frequency_hz: float) -> EquationsOfMotion:
    """Return the equations of a scene under its excitation at a frequency [Hz].

    Raises
    ------
    SettingError
        A contact with another law or a rigid one, structural damping, a base that moves, a bad frequency.
    """
    hertz = check_frequency("frequency_hz", frequency_hz)
    for contact in scene.contacts:
        if contact.is_rigid:
            given = ", ".join(f"{each:g}" for each in contact.stiffnesses)
            raise SettingError(f"{contact.name}.kt", given, f"must be finite {_EXPORTED}, as kn")
        if any(row.follows not in CARRIED for row in contact.rows()):
            wanted = f"must be coulomb, elastic-normal or gap {_EXPORTED}, in a plane with limits apart"
            raise SettingError(f"{contact.name}.law", contact.LAW, wanted)
    scene = whole(scene.at_frequency(hertz))
    model = linear_model(scene)
    check_structure(scene, model, _EXPORTED)
    zero = np.zeros(1, np.int64)
    K, C, M = (np.array(each[0].real) for each in model.at(zero, np.ones(1, np.bool_)))
    force, amplitude, phase, harmonic = _forces(model)
    return EquationsOfMotion(
        scene=scene, frequency_hz=hertz, M=M, C=C, K=K, dofs=tuple(model.dofs), shapes=model.shapes,
        observe=model.observe, force=force, amplitude=amplitude, phase=phase, harmonic=harmonic,
        contacts=_contacts(scene, np.real(model.ports_at(zero)[0])),
    )  # fmt: skip


def _forces(model: LinearModel) -> tuple[Real, Real, Real, Integer]:
    """Return the forces with their phases: one whose DOFs have phases of their own is two."""
    found = []
    for each in model.forces:
        for row, lead in ((np.real(each.vector), 0.0), (np.imag(each.vector), 0.5 * np.pi)):
            if np.any(row) and each.amplitude != 0.0:
                found.append((row, each.amplitude, each.phase + lead, each.harmonic))
    rows = np.array([row for row, *_ in found]).reshape(-1, model.n_coordinates)
    amplitude, phase = (np.array([each[k] for each in found], np.float64) for k in (1, 2))
    return rows, amplitude, phase, np.array([each[3] for each in found], np.int64)


def _contacts(scene: Scene, ports: Real) -> ContactRows:
    """Return the contacts; `ports` are the rows of all their relative motions."""
    placed: list[tuple[AnyContact, Row, Real]] = []
    first = 0
    for contact in scene.contacts:
        own = ports[first : first + len(contact.end_keys)]
        placed += [(contact, row, own) for row in contact.rows()]
        first += len(contact.end_keys)
    rows, n = [row for _, row, _ in placed], ports.shape[1]
    waves = [((row.N1, row.N1_phase), *row.higher) for row in rows]
    sizes = np.zeros((2, len(rows), max(map(len, waves), default=1)))
    for i, each in enumerate(waves):
        sizes[:, i, : len(each)] = np.array(each).T
    along = np.array([own[row.port] for _, row, own in placed]).reshape(-1, n)
    normal = np.array(
        [np.zeros(n) if row.normal_port is None else own[row.normal_port] for _, row, own in placed]
    ).reshape(-1, n)
    moving = [getattr(contact, "moving", None) for contact, *_ in placed]
    ratios = [0.0 if contact.load is None else contact.load.ratio or 0.0 for contact, *_ in placed]
    numbers = {
        key: np.array([getattr(row, key) for row in rows], np.float64)
        for key in ("kt", "mu", "N0", "kn", "gap")
    }
    return ContactRows(
        names=tuple(row.name for row in rows), laws=tuple(contact.LAW for contact, *_ in placed),
        follows=np.array([row.follows.value for row in rows], np.int64), along=along, normal=normal,
        wave=sizes[0], wave_phase=sizes[1], ratio=np.array(ratios, np.float64),
        presses=np.array([row.presses * (row.normal_port is not None) for row in rows], np.float64),
        prestressed=np.array([each is not None and each[1] for each in moving], np.float64), **numbers,
    )  # fmt: skip
