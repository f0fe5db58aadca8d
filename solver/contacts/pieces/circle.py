"""Friction in two directions under one circular limit L = μN between two events, and linearised about it.

From the sticks and slips with their exact ends that `solver.contacts.kernels.circle.circle_state` finds: the
force of a stick is that at its begin and the motion since then; in a slip it lies on the circle, in the
direction of the collocation polynomial.

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
from typing import Any, NamedTuple

import numpy as np

from solver.contacts.fields import Real
from solver.contacts.kernels.circle.circle_law import whole_path
from solver.contacts.kernels.circle.circle_state import FOUND, SETTLES
from solver.contacts.kernels.circle.panels import between
from solver.contacts.kernels.columns import COLUMNS, KT, KT_SECOND, MU
from solver.contacts.kernels.stick_slip_events import FAILED, SEPARATED, SLIP
from solver.contacts.laws.contact_parts import Slider
from solver.contacts.pieces.line import Shares, gap_pieces, values_at
from solver.contacts.pieces.piece import SHORTEST, TURN, Rates, StateEntry, StatePiece, spring, steady
from solver.errors import SettingError
from solver.jit import fourier
from solver.jit.kernel_records import Row
from solver.jit.trig_polynomial import grid_size, grid_tables

_TOGETHER = 1e-8  # rad: two states no further apart follow each other
_LEAST = 1e-300


class SpacePath(NamedTuple):
    """The sticks and slips of a period, with the motions and the load they belong to."""

    motions: Real  # (2, 2H + 1) [m]
    load: Real  # full coefficients, not cut at 0 [N]
    slider: Slider
    pieces: np.recarray[Any, Any]
    panels: np.recarray[Any, Any]
    settles: bool  # it slips no more: the last piece lasts for ever
    contact: float  # share of the period in which the normal load presses


def path_in_space(slider: Slider, motions: Real, load: Real) -> SpacePath:
    """Follow a contact over a period.

    Parameters
    ----------
    motions : (2 or 3, 2H + 1) full coefficients [m], of which the first two are tangential.
    load : full coefficients of the normal load, what the normal motion adds included [N].

    Raises
    ------
    SettingError
        A motion that can not be followed.
    """
    sliding = np.ascontiguousarray(motions[:2])
    ks, load_ks = (fourier.all_harmonics((q.shape[-1] - 1) // 2) for q in (sliding, load))
    top = max(int(ks[-1]), int(load_ks[-1]), 1)
    row = np.zeros(COLUMNS)
    row[[KT, KT_SECOND, MU]] = *slider.stiffnesses, slider.mu
    tables = grid_tables(grid_size(top), top)
    found, intervals = np.zeros(1, FOUND), np.empty((top + 2, 2))
    state, pieces, panels = whole_path(sliding, ks, load, load_ks, row, *tables, found, intervals)
    if state < 0 or state == FAILED:
        raise SettingError("motions", "of this contact", "must be ones that can be followed")
    (here,) = found.view(np.recarray)
    count = 0 if state == SEPARATED else here.pieces
    pressed = intervals[: here.intervals]
    share = float((pressed[:, 1] - pressed[:, 0]).sum()) / TURN if len(pressed) else 1.0
    return SpacePath(
        motions=sliding, load=load, slider=slider, pieces=pieces[:count].copy().view(np.recarray),
        panels=panels.view(np.recarray), settles=bool(here.how == SETTLES),
        contact=0.0 if state == SEPARATED else share,
    )  # fmt: skip


def shares_in_space(path: SpacePath) -> Shares:
    """Return the shares of the period in stick, slip and separation."""
    if path.settles or not len(path.pieces):
        return Shares(stick=path.contact, slip=0.0, separation=1.0 - path.contact)
    slips = path.pieces[path.pieces.motion == SLIP]
    slip = float((slips.end - slips.begin).sum()) / TURN
    return Shares(stick=max(path.contact - slip, 0.0), slip=slip, separation=1.0 - path.contact)


def force_in_space(path: SpacePath, tau: Real) -> Real:
    """Return both components of the friction force [N] at the angles `tau` [rad], (2, n)."""
    force = np.zeros((2, tau.size))
    pieces = path.pieces[-1:] if path.settles else path.pieces
    for piece in pieces:
        since = (tau - piece.begin) % TURN
        inside = np.full(tau.size, True) if path.settles else since <= piece.end - piece.begin
        here = piece.begin + since[inside]
        if piece.motion == SLIP:
            way, _ = _ways(directions(path, piece, here))
            force[:, inside] = path.slider.limit(values_at(path.load, here)) * way.T
        else:
            moved = values_at(path.motions, here) - values_at(path.motions, np.array([piece.begin]))
            force[:, inside] = np.array([[piece.tx], [piece.ty]]) + path.slider.pull(moved)
    return force


def directions(path: SpacePath, piece: Row, tau: Real) -> Real:
    """Return the direction θ of the force at angles within a slip, (n,) [rad]."""
    panels = path.panels[piece.first : piece.first + piece.count].view(np.recarray)
    found = np.empty(tau.size)
    for i, (at, panel) in enumerate(
        zip(tau, panels[np.clip(np.searchsorted(panels.end, tau), 0, len(panels) - 1)], strict=True)
    ):
        place = min(max((at - panel.begin) / (panel.end - panel.begin), 0.0), 1.0)
        found[i] = between(panel.start, np.ascontiguousarray(panel.theta), place)
    return found


class _Motion:
    """The motion of a contact at an angle: rates of both directions, limit and its rate, direction."""

    def __init__(self, path: SpacePath) -> None:
        self.path = path
        highest = max((path.motions.shape[1] - 1) // 2, (path.load.size - 1) // 2)
        curves = np.zeros((4, 2 * highest + 1))
        curves[:2, : path.motions.shape[1]] = fourier.derivative(path.motions)
        curves[2, : path.load.size] = path.slider.limit(path.load)
        curves[3, : path.load.size] = path.slider.limit(fourier.derivative(path.load))
        self._curves = curves

    def at(self, tau: Real) -> tuple[Real, Real, Real]:
        """Return u' (t, 2) [m], L and L' (t,) [N]."""
        here = values_at(self._curves, tau)
        return here[:2].T, here[2], here[3]

    def direction(self, piece: Row, tau: Real) -> Real:
        """Return θ in a slip at any angles (t,)."""
        here = piece.begin + (tau - piece.begin) % TURN
        # Where rounding has put the begin a period later it is the begin.
        later = here - piece.end > 0.5 * (TURN - (piece.end - piece.begin))
        return directions(self.path, piece, np.where(later, piece.begin, here))


def circle_pieces(path: SpacePath) -> tuple[StatePiece, ...]:
    """Return the states of a contact in space with two or, where the load moves, three motions."""
    kn = None if path.slider.normal_port is None else path.slider.normal_stiffness
    if not path.slider.limit(1.0) or not len(path.pieces):
        # The normal load alone acts.
        closed = () if kn is None else gap_pieces(path.load, kn, 0.0)
        return tuple(spring(piece.begin, piece.end, np.diag([0.0, 0.0, kn or 0.0])) for piece in closed)
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
            panels = path.panels[row.first : row.first + row.count].view(np.recarray)
            pieces.append(
                StatePiece(
                    begin=begin, end=end, rates=_slip_rates(motion, kn, row), entry=entry,
                    carried=np.zeros((1, 2 if kn is None else 3)),
                    edges=tuple(float(edge) for edge in panels.end[:-1]),
                )
            )  # fmt: skip
        else:
            pieces.append(_stick(path, kn, begin, end, entry))
    return tuple(pieces)


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
    K = np.diag(path.slider.stiffnesses)
    grip = -K if kn is None else np.vstack([-K, np.zeros(2)])
    carried = _padded(np.eye(2), kn)
    rates = steady(_tangent(K, kn, np.zeros(2)), grip)
    return StatePiece(begin=begin, end=end, rates=rates, entry=entry, carried=carried)


def _entry(motion: _Motion, kn: float | None, row: Row, before: Row | None) -> StateEntry:
    """Return what is remembered where a state begins, after another or after separation."""
    path, begin = motion.path, float(row.begin)
    K, by_load = np.diag(path.slider.stiffnesses), path.slider.limit_rise
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
        onto = (m_way - along * n)[None, :] @ K / path.slider.kt
        return StateEntry(_padded(onto, kn, np.array([along * by_load / path.slider.kt])), -onto)
    F = np.linalg.inv(K)
    return StateEntry(_padded(np.eye(2), kn, -F @ n * by_load), -path.slider.kt * (F @ m_way)[:, None])


def _ways(theta: float | Real) -> tuple[Real, Real]:
    c, s = np.cos(theta), np.sin(theta)
    return np.stack([c, s], axis=-1), np.stack([-s, c], axis=-1)


def _slip_rates(motion: _Motion, kn: float | None, row: Row) -> Callable[[Real], Rates]:
    """Return the rates in a slip as a function of angles."""
    (k1, k2), by_load = motion.path.slider.stiffnesses, motion.path.slider.limit_rise
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
