"""How people see a kind of job: its options, what is printed and drawn of it, what the documentation says."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Json = Mapping[str, Any]


class PeakPlace(Protocol):
    """The highest peak of a stored sweep."""

    @property
    def at(self) -> float:
        """Value of the parameter."""

    @property
    def value(self) -> float:
        """Amplitude [m]."""


class StoredSweep(Protocol):
    """What is drawn of a stored sweep, without its arrays."""

    @property
    def id(self) -> str:
        """By which it is read."""

    @property
    def points(self) -> int:
        """How many points it has."""

    @property
    def peak(self) -> PeakPlace | None:
        """The highest peak, if there is one."""


class StoredCurve(StoredSweep, Protocol):
    """What is drawn of a stored sweep with its arrays."""

    @property
    def scene(self) -> str:
        """Name of the scene."""

    @property
    def parameter(self) -> str:
        """Path of the parameter."""

    @property
    def limit(self) -> float | None:
        """Amplitude that bounds the resonance band [m]."""

    @property
    def arrays(self) -> Mapping[str, Sequence[Any]]:
        """Name to values."""


ReadSweep = Callable[[str], StoredCurve]
"""Gives a stored sweep with its arrays."""
Draw = Callable[[Json, Sequence[StoredSweep], ReadSweep], "Figure"]
"""From a result, the sweeps stored with it and the way to their arrays, to a picture."""


class NothingToDrawError(Exception):
    """A result without anything a picture could show; the message says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedResult:
    """What is printed of a result: a title, and names with their values."""

    title: str
    pairs: Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True, kw_only=True)
class KindView:
    """What people see of a kind; all of it has a plain default.

    Attributes
    ----------
    result : str
        What a job computes, for the documentation; Markdown.
    sweeps : str
        Which sweeps it stores; empty for none.
    keys : str
        In place of the list of its keys, where they are described elsewhere.
    flags : mapping
        Options of ``stickslip submit KIND`` that are not called as the key: key to ``--option``.
    tell : callable or None
        What is printed of a result; its numbers and words, by their keys, if left out.
    draw : callable or None
        The picture of a result, NothingToDrawError if it has none; the stored sweep with the peak of the
        result if left out.
    """

    result: str = ""
    sweeps: str = ""
    keys: str = ""
    flags: Mapping[str, str] = field(default_factory=dict)
    tell: Callable[[Json], PrintedResult] | None = None
    draw: Draw | None = None
