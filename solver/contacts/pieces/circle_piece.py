"""States of friction in two directions under one circular limit L = μN, linearised about the motion.

Stick: t = K (u − w), K = diag(k1, k2). In slip t = L n, n = (cos θ, sin θ), m = (−sin θ, cos θ), and with
F = K⁻¹, Δ = 1/k2 − 1/k1, G = mᵀ F m

    L G θ' = mᵀ u' − Δ sin θ cos θ L',      a = [−nᵀ u' − Δ (cos² θ − sin² θ) L' + 2 L Δ sin θ cos θ θ']/(L G)

(`solver.contacts.kernels.circle.panels` has the law). A perturbation δt = n δL + m k1 η, k1 η = L δθ, has

    k1 η' = (L'/L + a) k1 η + [mᵀ δu' − Δ sin θ cos θ δL' − G θ' δL]/G,      δL = μ kn δv.

η stays finite where L goes to 0, and is 0 where a contact closes into slip: the direction there follows the
motion and forgets. At the instant a stick reaches the limit, δτ = −(nᵀ δt − δL)/(nᵀ K u' − L') later, the
direction begins to turn by another rate: k1 η = mᵀ δt − (mᵀ K n/nᵀ K n)(nᵀ δt − δL). Where a slip ends the
slider is at rest, δw = δu − F δt; where a contact closes into stick, w = u there, δw = δu − u' δL/L'.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solver.contacts.fields import Real
from solver.contacts.kernels.stick_slip_events import SLIP
from solver.contacts.pieces.piece import SHORTEST, TURN, Rates, StateEntry, StatePiece, spring, steady
from solver.contacts.space_path import SpacePath, directions
from solver.jit import fourier
from solver.jit.kernel_records import Row

_TOGETHER = 1e-8  # rad: two states no further apart follow each other
_LEAST = 1e-300


class _Motion:
    """The motion of a contact at an angle: rates of both directions, limit and its rate, direction."""

    def __init__(self, path: SpacePath) -> None:
        self.path = path
        highest = max((path.motions.shape[1] - 1) // 2, (path.load.size - 1) // 2)
        curves = np.zeros((4, 2 * highest + 1))
        curves[:2, : path.motions.shape[1]] = fourier.derivative(path.motions)
        curves[2, : path.load.size] = path.mu * path.load
        curves[3, : path.load.size] = path.mu * fourier.derivative(path.load)
        self._curves, self._highest = curves, highest

    def at(self, tau: Real) -> tuple[Real, Real, Real]:
        """Return u' (t, 2) [m], L and L' (t,) [N]."""
        here = fourier.basis(tau, self._highest) @ self._curves.T
        return here[:, :2], here[:, 2], here[:, 3]

    def direction(self, piece: Row, tau: Real) -> Real:
        """Return θ in a slip at any angles (t,)."""
        here = piece.begin + (tau - piece.begin) % TURN
        # Where rounding has put the begin a period later it is the begin.
        later = here - piece.end > 0.5 * (TURN - (piece.end - piece.begin))
        return directions(self.path, piece, np.where(later, piece.begin, here))


def circle_pieces(path: SpacePath, kn: float | None) -> tuple[StatePiece, ...]:
    """Return the states of a contact in space with two or, where the load moves, three motions."""
    if path.mu == 0.0 or not len(path.pieces):
        return _without_friction(path, kn)
    motion = _Motion(path)
    if path.settles:
        row = path.pieces[-1]
        return (_stick(path, kn, float(row.begin), float(row.begin) + TURN, None),)
    rows = [row for row in path.pieces if row.end - row.begin > SHORTEST]
    pieces = []
    for i, row in enumerate(rows):
        before = rows[i - 1]
        apart = (row.begin - before.end + _TOGETHER) % TURN > 2.0 * _TOGETHER
        slips, begin, end = row.motion == SLIP, float(row.begin), float(row.end)
        entry = _entry(motion, kn, row, None if apart else before)
        if slips:
            pieces.append(_slip(motion, kn, row, entry))
        else:
            pieces.append(_stick(path, kn, begin, end, entry))
    return tuple(pieces)


def _without_friction(path: SpacePath, kn: float | None) -> tuple[StatePiece, ...]:
    """Return when the normal load alone acts."""
    from solver.contacts.pieces.line import gap_pieces

    if kn is None:
        return ()
    tangent = np.diag([0.0, 0.0, kn])
    return tuple(spring(piece.begin, piece.end, tangent) for piece in gap_pieces(path.load, kn, 0.0))


def _padded(block: Real, kn: float | None, column: Real | None = None) -> Real:
    """Return rows (…, 2) of two motions with the column (…,) of the third, if there is one."""
    if kn is None:
        return block
    third = np.zeros(block.shape[:-1]) if column is None else column
    return np.concatenate([block, third[..., None]], axis=-1)


def _tangent(block: Real, kn: float | None, column: Real) -> Real:
    if kn is None:
        return block
    rows = _padded(block, kn, column)
    return np.concatenate([rows, np.broadcast_to([0.0, 0.0, kn], (*rows.shape[:-2], 1, 3))], axis=-2)


def _stick(
    path: SpacePath, kn: float | None, begin: float, end: float, entry: StateEntry | None
) -> StatePiece:
    K = np.diag(path.kt)
    grip = -K if kn is None else np.vstack([-K, np.zeros(2)])
    carried = _padded(np.eye(2), kn)
    rates = steady(_tangent(K, kn, np.zeros(2)), grip)
    return StatePiece(begin=begin, end=end, rates=rates, entry=entry, carried=carried)


def _entry(motion: _Motion, kn: float | None, row: Row, before: Row | None) -> StateEntry:
    """Return what is remembered where a state begins, after another or after separation."""
    path, begin = motion.path, float(row.begin)
    K, by_load = np.diag(path.kt), path.mu * (kn or 0.0)
    m = 2 if kn is None else 3
    rate, limit_rate = motion.at(np.array([begin]))[::2]
    slips = row.motion == SLIP
    if before is None:
        if slips:
            return StateEntry(np.zeros((1, m)), None)
        return StateEntry(_padded(np.eye(2), kn, -rate[0] * by_load / limit_rate[0] if kn else None), None)
    slipped = before.motion == SLIP
    if slipped and slips:
        return StateEntry(np.zeros((1, m)), np.eye(1))
    if not slipped and not slips:
        return StateEntry(np.zeros((2, m)), np.eye(2))
    n, m_way = _ways(
        motion.direction(row if slips else before, np.array([begin if slips else before.end]))[0]
    )
    if slips:
        along = float(m_way @ K @ n) / float(n @ K @ n)
        onto = (m_way - along * n) / path.kt[0]
        return StateEntry(
            _padded((onto @ K)[None, :], kn, np.array([along * by_load / path.kt[0]])), -(onto @ K)[None, :]
        )
    F = np.linalg.inv(K)
    return StateEntry(_padded(np.eye(2), kn, -F @ n * by_load), -path.kt[0] * (F @ m_way)[:, None])


def _ways(theta: float | Real) -> tuple[Real, Real]:
    c, s = np.cos(theta), np.sin(theta)
    return np.stack([c, s], axis=-1), np.stack([-s, c], axis=-1)


def _slip(motion: _Motion, kn: float | None, row: Row, entry: StateEntry) -> StatePiece:
    path = motion.path
    begin, end = float(row.begin), float(row.end)
    panels = path.panels[row.first : row.first + row.count].view(np.recarray)
    edges = tuple(float(edge) for edge in panels.end[:-1])
    size = 2 if kn is None else 3
    return StatePiece(
        begin=begin, end=end, rates=_slip_rates(motion, kn, row), entry=entry, carried=np.zeros((1, size)),
        edges=edges,
    )  # fmt: skip


def _slip_rates(motion: _Motion, kn: float | None, row: Row) -> Callable[[Real], Rates]:
    """Return the rates in a slip as a function of angles."""
    (k1, k2), by_load = motion.path.kt, motion.path.mu * (kn or 0.0)
    more = 1.0 / k2 - 1.0 / k1

    def rates(tau: Real) -> Rates:
        n, m_way = _ways(motion.direction(row, tau))
        rate, limit, limit_rate = motion.at(tau)
        limit = np.maximum(limit, _LEAST)
        c, s = n.T
        G = c * c / k2 + s * s / k1
        turn = (np.sum(m_way * rate, axis=1) - more * s * c * limit_rate) / (limit * G)
        a = (
            -np.sum(n * rate, axis=1)
            - more * (c * c - s * s) * limit_rate
            + 2.0 * limit * more * s * c * turn
        )
        by_rate = _padded(m_way / (k1 * G)[:, None], kn, -more * s * c * by_load / (k1 * G))
        grip = k1 * m_way[:, :, None]
        return Rates(
            tangent=_tangent(np.zeros((len(tau), 2, 2)), kn, by_load * n),
            grip=grip if kn is None else np.concatenate([grip, np.zeros_like(grip[:, :1])], axis=1),
            by_motion=_padded(np.zeros((len(tau), 2)), kn, -turn * by_load / k1)[:, None],
            by_rate=by_rate[:, None],
            own=(limit_rate / limit + a / (limit * G))[:, None, None],
        )

    return rates
