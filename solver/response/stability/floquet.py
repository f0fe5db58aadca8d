"""Stability of periodic responses: Floquet multipliers, with the places of the sliders in the state."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from solver.contacts.pieces.piece import ContactPart
from solver.continuation.branch import Branch
from solver.errors import SettingError
from solver.jit import fourier
from solver.jit.fourier import Complex, Real
from solver.jit.timer import clock
from solver.lab import from_lab
from solver.linear.assembly import linear_model
from solver.linear.model import with_inertia
from solver.response.solution import Solution, check_converged
from solver.response.stability.monodromy import PERIOD, LinearPart, Monodromy, PeriodElement, monodromy
from solver.response.stability.multipliers import Stability, growth_of
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.cyclic.annulus import annulus
from solver.scene.scene import Scene

ROUNDING = 1e-14  # of the largest motion, one that is none
Motions = tuple[Real, ...]  # of every contact, (ports, 2H + 1) full coefficients [m]


@shows_progress("stability")
def stability(
    solution: Solution, *, on_progress: OnProgress = None, should_stop: ShouldStop = None
) -> Stability:
    """Return the Floquet multipliers of a periodic response; `plan` says how long that takes.

    Of a cyclic scene the whole annulus is perturbed: contacts in their states join all nodal diameters, so
    the sector that stands for the motion does not stand for its perturbations.

    Parameters
    ----------
    solution : one that converged.
    on_progress : called with (share done, steps so far).
    should_stop : asked between steps.

    Raises
    ------
    SettingError
        The solution did not converge.
    StoppedError
        `should_stop` said so.
    """
    check_converged(solution)
    if solution.scene.rigid_contact is not None:
        found: Stability = from_lab("proofs.exact.answer:stability_exactly")(
            solution.scene, solution.frequency_hz
        )
        return found
    motions = tuple(np.array(contact.motions) for contact in solution.contacts)
    return motions_stability(
        solution.scene, solution.frequency_hz, motions, on_progress=on_progress, should_stop=should_stop
    )


def branch_stability(
    branch: Branch, points: Iterable[int] | None = None, *, at: Sequence[tuple[float, Real]] = ()
) -> tuple[Stability, ...]:
    """Return the stability of points of a branch.

    Parameters
    ----------
    branch : from `sweep`.
    points : indices into its points; all of them if left out, none if `at` is given.
    at : other responses of its balance, as value of the parameter and solution (n_unknowns,): its peaks.

    Raises
    ------
    SettingError
        An index beyond the branch.
    """
    balance, found = branch.balance, []
    every_point = range(0 if at else len(branch.values))
    chosen = list(at)
    for i in every_point if points is None else points:
        if not -len(branch.values) <= i < len(branch.values):
            raise SettingError("points", i, f"must be indices of a branch of {len(branch.values)} points")
        chosen.append((float(branch.values[i]), branch.solutions[i, :-1]))
    for value, solution in chosen:
        coefficients = solution.reshape(-1, balance.n_coefficients)
        every = fourier.to_full(coefficients, balance.system.ks, balance.highest_harmonic)
        motions = tuple(np.split(every, balance.system.first_port[1:-1]))
        found.append(motions_stability(*branch.scene_at(value), motions))
    return tuple(found)


def motions_stability(
    scene: Scene, frequency_hz: float, motions: Motions, *, on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> Stability:  # fmt: skip
    """Return the stability of a response of a scene at a frequency with given motions of its contacts."""
    begun = clock()
    found = scene_monodromy(scene, frequency_hz, motions, on_progress=on_progress, should_stop=should_stop)
    values = np.linalg.eigvals(found.reduced).astype(np.complex128)
    multipliers = values[np.argsort(-np.abs(values), kind="stable")]
    return Stability(
        multipliers=multipliers, neutral=found.neutral, growth=growth_of(multipliers),
        frequency_hz=frequency_hz, seconds=clock() - begun,
    )  # fmt: skip


def scene_monodromy(
    scene: Scene, frequency_hz: float, motions: Motions, *, mass_damping: float = 0.0,
    alone: Complex | None = None, on_progress: OnProgress = None, should_stop: ShouldStop = None,
) -> Monodromy:  # fmt: skip
    """Return the monodromy matrix of a scene in a periodic motion, of all sectors if it is cyclic.

    Parameters
    ----------
    scene : with the values of the motion.
    frequency_hz : excitation frequency [Hz].
    motions : (ports, 2H + 1) full coefficients of the relative motions of every contact [m].
    mass_damping : what the damping has besides, in units of the mass [1/s]; below 0 it feeds the motion.
    alone : (n,) mass-normalised mode that it acts on alone, of a structure without sectors.
    on_progress, should_stop : as for `stability`.
    """
    whole = annulus(scene) if scene.structure.has_sectors else scene
    model = linear_model(whole)
    free = model.free
    parts = _parts(scene, motions)
    every = np.split(model.contact_here, np.cumsum(whole.port_counts, dtype=np.int64))[:-1]
    elements = tuple(
        PeriodElement(ports=ports[list(part.ports)][:, free], pieces=part.pieces)
        for ports, contact in zip(every, whole.contacts, strict=True)
        for part in parts[contact.name]
    )
    heavy = np.any(model.M, axis=1)
    for contact, element in zip(whole.contacts, every, strict=True):
        if np.any(element[:, free & ~heavy]):
            wanted = "must not join a point without inertia where stability is asked for"
            raise SettingError("contact", contact.name, wanted)
    K, C, M = (each[0][free][:, free] for each in model.at(np.zeros(1, np.int64), np.ones(1, np.bool_)))
    if np.any(K.imag) or np.any(C.imag):
        wanted = (
            "must have no structural damping and no imaginary coefficients: they are terms of the frequency "
            "domain, and stability is one in time"
        )
        raise SettingError("scene", scene.name, wanted)
    fed = M.real
    if alone is not None:
        fed = np.outer(M @ alone, (M @ alone).conj()).real
    K, C, M, rates = with_inertia(K.real, C.real + mass_damping * fed, M)
    structure = LinearPart(M=M, C=C, K=K, rates=rates)
    sectors = scene.structure.sector_count if scene.structure.has_sectors else 1
    return monodromy(
        structure, elements, PERIOD * frequency_hz, sectors=sectors, order=scene.engine_order,
        on_progress=on_progress, should_stop=should_stop,
    )  # fmt: skip


def _parts(scene: Scene, motions: Motions) -> dict[str, tuple[ContactPart, ...]]:
    """The states of every contact; those of the next sector are the same a part of a period earlier."""
    own: dict[str, tuple[ContactPart, ...]] = {}
    rounding = ROUNDING * max((float(np.abs(each).max(initial=0.0)) for each in motions), default=0.0)
    for contact, found in zip(scene.contacts, motions, strict=True):
        moved = np.where(np.abs(found).max(axis=1, keepdims=True) > rounding, found, 0.0)
        parts = contact.perturbed(moved, contact.normal_load(moved))
        if parts is None:
            wanted = f"must have contacts whose law says how it is perturbed ({contact.LAW} does not)"
            raise SettingError("solution", contact.name, wanted)
        own[contact.name] = parts
    structure = scene.structure
    if not structure.has_sectors:
        return own
    n, order = structure.sector_count, scene.engine_order
    return {
        f"{name}@{j}": tuple(
            part._replace(pieces=tuple(piece.earlier(PERIOD * (order * j % n) / n) for piece in part.pieces))
            for part in parts
        )
        for j in range(n)
        for name, parts in own.items()
    }
