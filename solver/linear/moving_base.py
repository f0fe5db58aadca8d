"""A base that moves as prescribed: its motion as one more coordinate of a linear model.

The coordinate y stands last and has the row y = amplitude, ikω y = amplitude or −(kω)² y = amplitude, so that
amplitudes, derivatives and observed motion follow as for any other. Where the ground moves, x = z + R y
with the rigid-body motion R of the structure; counted from the ground, M z'' + C z' + K z = f − M R y''.
Driven DOFs have the rows x_s = r_s y, of a stiffness beside which that of the structure vanishes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.errors import SettingError
from solver.linear.extra_terms import ExtraTerms
from solver.linear.model import ForceTerm, LinearModel, LinearModelDerivative
from solver.scene.scene import Scene
from solver.scene.terms.excitation import Base

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
_WHOLE, _MOVING = np.zeros(1, np.int64), np.ones(1, np.bool_)  # a structure without sectors, in motion
_RIGID = 1e20  # stiffness of what drives a DOF, relative to the largest of the structure


def base_of(scene: Scene) -> Base | None:
    """Return the base that moves; None where only forces act."""
    return next((force.base for force in scene.excitation if force.base is not None), None)


def with_base(model: LinearModel, scene: Scene, base: Base) -> LinearModel:
    """Return the model with the motion of the base as its last coordinate.

    Raises
    ------
    SettingError
        Driven DOFs that are sums of the coordinates: of a structure given by its modes.
    """
    n = model.M.shape[0]
    shares = _shares(model, base)
    M, K, C = (
        _padded(model.M),
        np.zeros((n + 1, n + 1), np.complex128),
        np.zeros((n + 1, n + 1), np.complex128),
    )
    if model.extra is not None:
        (K[:n, :n],), (C[:n, :n],) = model.extra.at(model.turns(_WHOLE), _MOVING, model.K0[None])
    K0, C0 = _padded(model.K0), _padded(model.C0)
    still = np.zeros((n + 1, n + 1))
    if base.ground:
        M[:n, n] = model.M @ shares
    else:
        rows = np.flatnonzero(shares)
        stiffness = _RIGID * float(np.abs(model.K0).max())
        for matrix, own in ((K, K0), (C, C0)):
            matrix[rows] = -own[rows]
        M[rows] = 0.0
        K[rows, rows] += stiffness
        K[rows, n] -= stiffness * shares[rows]
    if base.motion == "displacement":
        K[n, n] = 1.0
    else:
        still[n, n] = 1.0
        (C if base.motion == "velocity" else M)[n, n] = 1.0
    for array in (M, K0, C0, K, C, still):
        array.setflags(write=False)
    return replace(
        model, M=M, K0=K0, Kp=_zeros(n + 1), C0=C0, Cp=_zeros(n + 1), prescribed=True,
        shapes=_seen(model.shapes, scene, base, model), observe=_seen_one(model, scene, base),
        contact_here=_widened(model.contact_here), contact_next=_widened(model.contact_next),
        extra=ExtraTerms(offsets=(0,), K=K[None], C=C[None], still=still),
        forces=(*(_wider(term) for term in model.forces), *_motions(scene, n)),
    )  # fmt: skip


def derivative_with_base(d: LinearModelDerivative, model: LinearModel, base: Base) -> LinearModelDerivative:
    """Return a derivative of `model` (without its base) as one of the model with it."""
    shares = _shares(model, base)
    driven = np.zeros(shares.size, np.bool_) if base.ground else shares != 0.0

    def wide(matrix: NDArray[Any]) -> NDArray[Any]:
        found = np.pad(matrix, (0, 1))
        found[:-1][driven] = 0.0
        return found

    dM = wide(d.dM)
    if base.ground:
        dM[:-1, -1] = d.dM @ shares
    # Rows of driven DOFs are of no symmetric part: the whole derivative stands with the extra terms.
    (dK,), (dC,), _ = d.at(model, _WHOLE, _MOVING)
    own = ExtraTerms(offsets=(0,), K=wide(dK)[None], C=wide(dC)[None])
    second = d.second_extra
    if second is not None:
        K, C = (np.array([wide(each) for each in part]) for part in (second.K, second.C))
        second = replace(second, K=K, C=C)
    nothing = _zeros(shares.size + 1)
    return replace(
        d, dM=dM, dK0=nothing, dKp=nothing, dC0=nothing, dCp=nothing, by_loss_factor=False,
        extra=own, second_extra=second,
        contact_here=None if d.contact_here is None else _widened(d.contact_here),
        contact_next=None if d.contact_next is None else _widened(d.contact_next),
        forces=tuple(map(_wider, d.forces)), second_forces=tuple(map(_wider, d.second_forces)),
    )  # fmt: skip


def _shares(model: LinearModel, base: Base) -> Real:
    """The coordinates' part of the motion: DOFs must be coordinates."""
    found = np.zeros(model.M.shape[0])
    for dof, share in base.shares:
        row = model.shapes[model.dofs.index(dof)]
        if np.count_nonzero(row) != 1 or row.max() != 1.0:
            wanted = "must be coordinates of the matrices: give the structure by M and K, not by modes"
            raise SettingError("excitation", dof, wanted)
        found += share * row
    return found


def _motions(scene: Scene, n: int) -> tuple[ForceTerm, ...]:
    """The amplitudes of the base as right-hand sides of its own row."""
    vector = np.append(np.zeros(n), 1.0)
    vector.setflags(write=False)
    return tuple(
        ForceTerm(vector=vector, amplitude=e.amplitude, phase=e.phase, harmonic=e.harmonic)
        for e in scene.excitation
        if e.base is not None
    )


def _seen(shapes: Real, scene: Scene, base: Base, model: LinearModel) -> Real:
    """The DOFs, absolute or relative to the base, in all coordinates."""
    moved = shapes @ _shares(model, base) if base.ground else np.zeros(len(shapes))
    if scene.observe.relative:
        moved = np.zeros(len(shapes)) if base.ground else -shapes.sum(axis=1)
    return _frozen(np.column_stack([shapes, moved]))


def _seen_one(model: LinearModel, scene: Scene, base: Base) -> Real:
    return _frozen(_seen(model.observe[None], scene, base, model)[0])


def _wider(term: ForceTerm) -> ForceTerm:
    return replace(term, vector=_frozen(np.append(term.vector, 0.0)))


def _widened(rows: Real) -> Real:
    return _frozen(np.column_stack([rows, np.zeros(len(rows))]))


def _padded(matrix: Real) -> Real:
    return np.pad(matrix, (0, 1))


def _zeros(n: int) -> Real:
    return _frozen(np.zeros((n, n)))


def _frozen(array: Real) -> Real:
    array.setflags(write=False)
    return array
