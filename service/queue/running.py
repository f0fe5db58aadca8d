"""Attempts that run here, and how far they are."""

from __future__ import annotations

import enum
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, field

from service.db.repositories import Attempt
from service.jobs.outputs import Best, Point


class StopReason(enum.Enum):
    """Why an attempt was told to stop."""

    CANCEL = "its cancel was asked for"
    TIME = "it ran too long"
    LEASE = "the job is not ours any more"
    SHUTDOWN = "the service stops"


@dataclass(slots=True)
class Running:
    """An attempt that an executor has; `unwritten` if its row does not know its best design yet."""

    attempt: Attempt
    started: float
    written: float
    fraction: float = 0.0
    points: int = 0
    best: Best | None = None
    unwritten: bool = False
    stop: StopReason | None = None
    tag: str = field(default_factory=lambda: secrets.token_hex(4))
    found: list[Point] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class Live:
    """How far an attempt is that runs here, newer than its row.

    Attributes
    ----------
    tag : str
        Of this run alone; another one has found other points.
    attempt : int
        Which attempt at the job it is.
    fraction, points : float, int
        Share of its path, points computed.
    best : table or None
        The best design so far, if its kind tells one.
    found : list of (value, amplitude)
        The points of its branch so far, if its kind tells them; grows while it runs.
    """

    tag: str
    attempt: int
    fraction: float
    points: int
    best: Best | None
    found: Sequence[Point]
