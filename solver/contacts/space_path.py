"""What a contact with a circular limit does over a period: its force and the shares of its motions.

From the sticks and slips with their exact ends that `solver.contacts.kernels.circle.circle_state` finds: the
force of a stick is that at its begin and the motion since then; in a slip it lies on the circle μN, in the
direction of the collocation polynomial.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from solver.contacts.kernels.circle.circle_law import whole_path
from solver.contacts.kernels.circle.circle_state import FOUND, SETTLES
from solver.contacts.kernels.circle.panels import between
from solver.contacts.kernels.columns import COLUMNS, KT, KT_SECOND, MU
from solver.contacts.kernels.stick_slip_events import FAILED, SEPARATED, SLIP
from solver.contacts.segments import Shares
from solver.errors import SettingError
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.jit.kernel_records import Row
from solver.jit.trig_polynomial import grid_size, grid_tables

_TURN = 2.0 * math.pi


class SpacePath(NamedTuple):
    """The sticks and slips of a period, with the motions and the load they belong to."""

    motions: Real  # (2, 2H + 1) [m]
    load: Real  # full coefficients, not cut at 0 [N]
    kt: tuple[float, float]  # [N/m]
    mu: float
    pieces: np.recarray[Any, Any]
    panels: np.recarray[Any, Any]
    settles: bool  # it slips no more: the last piece lasts for ever
    contact: float  # share of the period in which the normal load presses


def path_in_space(motions: Real, load: Real, kt: float, second: float, mu: float) -> SpacePath:
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
    row[[KT, KT_SECOND, MU]] = kt, second, mu
    tables = grid_tables(grid_size(top), top)
    found, intervals = np.zeros(1, FOUND), np.empty((top + 2, 2))
    state, pieces, panels = whole_path(sliding, ks, load, load_ks, row, *tables, found, intervals)
    if state < 0 or state == FAILED:
        raise SettingError("motions", "of this contact", "must be ones that can be followed")
    (here,) = found.view(np.recarray)
    count = 0 if state == SEPARATED else here.pieces
    pressed = intervals[: here.intervals]
    share = float((pressed[:, 1] - pressed[:, 0]).sum()) / _TURN if len(pressed) else 1.0
    return SpacePath(
        motions=sliding, load=load, kt=(kt, second), mu=mu, pieces=pieces[:count].copy().view(np.recarray),
        panels=panels.view(np.recarray), settles=bool(here.how == SETTLES),
        contact=0.0 if state == SEPARATED else share,
    )  # fmt: skip


def shares_in_space(path: SpacePath) -> Shares:
    """Return the shares of the period in stick, slip and separation."""
    if path.settles or not len(path.pieces):
        return Shares(stick=path.contact, slip=0.0, separation=1.0 - path.contact)
    slips = path.pieces[path.pieces.motion == SLIP]
    slip = float((slips.end - slips.begin).sum()) / _TURN
    return Shares(stick=max(path.contact - slip, 0.0), slip=slip, separation=1.0 - path.contact)


def force_in_space(path: SpacePath, tau: Real) -> Real:
    """Return both components of the friction force [N] at the angles `tau` [rad], (2, n)."""
    force = np.zeros((2, tau.size))
    pieces = path.pieces[-1:] if path.settles else path.pieces
    for piece in pieces:
        since = (tau - piece.begin) % _TURN
        inside = np.full(tau.size, True) if path.settles else since <= piece.end - piece.begin
        here = piece.begin + since[inside]
        force[:, inside] = (_slip if piece.motion == SLIP else _stick)(path, piece, here)
    return force


def _stick(path: SpacePath, piece: Row, tau: Real) -> Real:
    begin = np.array([piece.begin])
    moved = _at(path.motions, tau) - _at(path.motions, begin)
    return np.asarray(np.array([[piece.tx], [piece.ty]]) + np.array(path.kt)[:, None] * moved)


def _slip(path: SpacePath, piece: Row, tau: Real) -> Real:
    angles = directions(path, piece, tau)
    limit = path.mu * _at(path.load[None], tau)[0]
    return np.asarray(limit * np.array([np.cos(angles), np.sin(angles)]))


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


def _at(coefficients: Real, tau: Real) -> Real:
    """Return the values of rows of full coefficients at the angles `tau`, (rows, n)."""
    return np.asarray(coefficients @ fourier.basis(tau, (coefficients.shape[1] - 1) // 2).T)
