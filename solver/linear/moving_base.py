"""A base that moves as prescribed: its motions as more coordinates of a linear model.

Each coordinate y moves one pattern of real shares r, and what has phases is the sum of two in quadrature,
r cos(φ) and r sin(φ). They stand last and have the rows y = amplitude, ikω y = amplitude or
−(kω)² y = amplitude, so that amplitudes, derivatives and observed motion follow as for any other. Where the
ground moves, x = z + Σ R y with the rigid-body motions R of the structure; counted from the ground,
M z'' + C z' + K z = f − Σ M R y''. Driven DOFs have the rows x_s = Σ r_s y, of a stiffness beside which that
of the structure vanishes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from solver.arrays import Complex, Integer, Real
from solver.errors import SettingError
from solver.linear.model import ExtraTerms, ForceTerm, LinearModel, LinearModelDerivative, Terms
from solver.matrices.values import frozen
from solver.scene.excitation import Motion
from solver.scene.scene import Scene

_WHOLE, _MOVING = np.zeros(1, np.int64), np.ones(1, np.bool_)  # a structure without sectors, in motion
_RIGID = 1e20  # stiffness of what drives a DOF, relative to the largest of the structure


class BaseMotion(NamedTuple):
    """What one coordinate of a base moves.

    Attributes
    ----------
    ground : whether the ground moves, or the DOFs of the shares do.
    shares : DOF and its part of the motion.
    motion : what the amplitudes are of.
    counts : whether it is part of the motion of the base, from which a relative one is counted; what phases
        of shares add in quadrature is not.
    """

    ground: bool
    shares: tuple[tuple[str, float], ...]
    motion: Motion
    counts: bool


Amplitudes = tuple[float, float, int]  # amplitude, phase [rad] and harmonic
BaseMotions = Mapping[BaseMotion, list[Amplitudes]]


def base_motions(scene: Scene) -> BaseMotions:
    """Return the coordinates of the base that moves, with the amplitudes of each; none of forces alone.

    r cos(ωt + φ) = r cos(φ) cos(ωt) + r sin(φ) cos(ωt + π/2).
    """
    found: dict[BaseMotion, list[Amplitudes]] = {}
    for e in scene.excitation:
        if e.base is None:
            continue
        for part, turn in ((math.cos, 0.0), (math.sin, 0.5 * math.pi)):
            shares = tuple((dof, share * part(phase)) for dof, share, phase in e.base.shares)
            if turn == 0.0 or any(share for _, share in shares):
                own = BaseMotion(e.base.ground, shares, e.base.motion, turn == 0.0)
                found.setdefault(own, []).append((e.amplitude, e.phase + turn, e.harmonic))
    return found


def with_base(model: LinearModel, scene: Scene, base: BaseMotions) -> LinearModel:
    """Return the model with the motions of the base as its last coordinates.

    Raises
    ------
    SettingError
        Driven DOFs that are sums of the coordinates: of a structure given by its modes.
    """
    n, m = model.M.shape[0], len(base)
    shares, driven = _shares(model, base), _driven(model, base)
    terms, K, C = _widened(model, shares, driven)
    M, still = terms["M"], np.zeros((n + m, n + m))
    stiffness = _RIGID * float(np.abs(model.K0).max())
    K[driven, driven] += stiffness
    for at, (one, part) in enumerate(zip(base, shares.T, strict=True), start=n):
        if not one.ground:
            K[driven, at] -= stiffness * part[driven]
        row = {"displacement": K, "velocity": C, "acceleration": M}[one.motion]
        row[at, at] = 1.0
        if one.motion != "displacement":
            still[at, at] = 1.0
    frozen(M)
    extra = ExtraTerms(offsets=(0,), K=frozen(K)[None], C=frozen(C)[None], still=frozen(still))
    return replace(
        model, **terms, extra=extra, prescribed=m,
        shapes=_seen(model.shapes, scene, base, shares), observe=_seen(model.observe, scene, base, shares),
        contact_here=_wide(model.contact_here, m), contact_next=_wide(model.contact_next, m),
        forces=(*_wider(model.forces, m), *_motions(base, n)),
    )  # fmt: skip


def _widened(terms: Terms, shares: Real, driven: Integer) -> tuple[dict[str, Any], Complex, Complex]:
    """Return the symmetric terms with those of a base behind them, and what K and C have beside.

    Driven DOFs have no equation of motion, and the ground moves the structure by its inertia.
    """
    n, m = shares.shape
    (K0,), (C0,), (own,) = terms.plain(_WHOLE)
    more = terms.beside(_WHOLE, _MOVING)
    K, C = (
        np.pad(part + 0j, (0, m))
        for part in ((0.0 * K0, 0.0 * C0) if more is None else (more[0][0], more[1][0]))
    )
    M, K0, C0 = (np.pad(part, (0, m)) for part in (own, K0, C0))
    M[:n, n:] = 0.0 if driven.size else own @ shares
    M[driven], K[driven], C[driven] = 0.0, -K0[driven], -C0[driven]
    nothing = frozen(np.zeros((n + m, n + m)))
    return {"M": M, "K0": frozen(K0), "Kp": nothing, "C0": frozen(C0), "Cp": nothing}, K, C


def derivative_with_base(
    d: LinearModelDerivative, model: LinearModel, base: BaseMotions
) -> LinearModelDerivative:
    """Return a derivative of `model` (without its base) as one of the model with it."""
    m, driven = len(base), _driven(model, base)
    terms, K, C = _widened(d, _shares(model, base), driven)
    frozen(terms["M"])
    own = ExtraTerms(offsets=(0,), K=frozen(K)[None], C=frozen(C)[None])
    second = d.second_extra
    if second is not None:
        K, C = (np.pad(part, ((0, 0), (0, m), (0, m))) for part in (second.K, second.C))
        K[:, driven], C[:, driven] = 0.0, 0.0
        second = replace(second, K=K, C=C)
    return replace(
        d, **terms, sector=None, extra=own, second_extra=second,
        contact_here=None if d.contact_here is None else _wide(d.contact_here, m),
        contact_next=None if d.contact_next is None else _wide(d.contact_next, m),
        forces=_wider(d.forces, m), second_forces=_wider(d.second_forces, m),
    )  # fmt: skip


def _shares(model: LinearModel, base: BaseMotions) -> Real:
    """The coordinates' part of each motion, (n, m): DOFs must be coordinates."""
    found = np.zeros((model.M.shape[0], len(base)))
    for i, motion in enumerate(base):
        for dof, share in motion.shares:
            found[_coordinate(model, dof), i] += share
    return found


def _driven(model: LinearModel, base: BaseMotions) -> Integer:
    """The coordinates that are driven; none where the ground moves."""
    at = {_coordinate(model, dof) for one in base if not one.ground for dof, _ in one.shares}
    return np.array(sorted(at), np.int64)


def _coordinate(model: LinearModel, dof: str) -> int:
    row = model.shapes[model.dofs.index(dof)]
    if np.count_nonzero(row) != 1 or row.max() != 1.0:
        wanted = "must be coordinates of the matrices: give the structure by M and K, not by modes"
        raise SettingError("excitation", dof, wanted)
    return int(np.argmax(row))


def _motions(base: BaseMotions, n: int) -> Iterable[ForceTerm]:
    """The amplitudes of the base as right-hand sides of its own rows."""
    for vector, amplitudes in zip(np.eye(len(base), n + len(base), n), base.values(), strict=True):
        for amplitude, phase, harmonic in amplitudes:
            yield ForceTerm(vector=frozen(vector), amplitude=amplitude, phase=phase, harmonic=harmonic)


def _seen(rows: Real, scene: Scene, base: BaseMotions, shares: Real) -> Real:
    """What is seen, (…, n), absolute or relative to the base, in all coordinates."""
    ground = np.array([one.ground for one in base])
    if scene.observe.relative:
        counted = np.array([one.counts and not one.ground for one in base], np.float64)
        moved = -rows.sum(axis=-1, keepdims=True) * counted
    else:
        moved = rows @ shares * ground
    return frozen(np.concatenate([rows, moved], axis=-1))


def _wider(terms: tuple[ForceTerm, ...], m: int) -> tuple[ForceTerm, ...]:
    return tuple(replace(term, vector=frozen(np.concatenate([term.vector, np.zeros(m)]))) for term in terms)


def _wide(rows: Real, m: int) -> Real:
    return frozen(np.pad(rows, ((0, 0), (0, m))))
