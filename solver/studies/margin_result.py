"""Stress over the excitation for several dampers, and what they allow: what `margin_diagram` returns."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar

from solver.arrays import FloatOrNaN, Real
from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import Known
from solver.results.notes import NOTHING_DAMPS
from solver.results.told import Piece
from solver.results.views import Data, Views


class MarginStatus(Enum):
    """How a diagram ended; the value is a sentence a user can act on."""

    COMPLETED = "Every response was computed."
    HOLES = "Some responses do not cover the band and are empty: use more harmonics or a narrower band."
    UNDAMPED = NOTHING_DAMPS
    STOPPED = "Stopped by the caller: what is empty was not reached."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AllowedExcitation(Piece):
    """What one damper allows."""

    name: Annotated[str, "Of the damper, or ``as it is``."]
    allowed: Annotated[
        FloatOrNaN, "Excitation at which what is allowed is reached first, in its unit; NaN if it is not."
    ]
    end: Annotated[
        str,
        "``within``, ``below``: it is reached before the range begins, ``above``: not up to its end, or "
        "``unknown``: a level below has no response.",
    ]
    row: Annotated[str, "What reaches it, a recovered stress or the observed DOF."]
    at_hz: Annotated[FloatOrNaN, "Frequency of that peak [Hz]."]
    value: Annotated[FloatOrNaN, "Its alternating stress [Pa], or amplitude, there."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MarginDiagram(MadeOfResponses, Drawn):
    """The greatest stress over the excitation of D dampers at n levels."""

    VIEWS: ClassVar = Views("solver.views", "tracks:margin", "tracks:margin_figure")
    DATA: ClassVar = Data(
        "margin", {
            "damper=allowed": "damper=name allowed end row at_hz value", "level": "level",
            "damper level": "stress used",
        },
        "judged_by unit level_unit harmonics=n_harmonics", scene="scene", rows=("damper", "level"),
    )  # fmt: skip
    JSON: ClassVar = (
        "scene judged_by unit level level_unit stress used allowed n_harmonics seconds reached status"
    )

    scene: Annotated[str, "Name of the scene."]
    judged_by: Annotated[str, "``utilisation`` of strengths, or ``amplitude`` of the observed DOF."]
    unit: Annotated[str, "Of `stress`: Pa, or that of the amplitude."]
    level: Annotated[Real, "Excitation amplitudes, (n,)."]
    level_unit: Annotated[str, "Their unit."]
    stress: Annotated[Real, "Alternating stress, or amplitude, of what is used most, (D, n)."]
    used: Annotated[
        Real,
        "Its share of what is allowed; NaN where nothing says what is, inf, which is null in JSON beside a "
        "stress, where the mean stress alone reaches the strength, (D, n).",
    ]
    allowed: Annotated[tuple[AllowedExcitation, ...], "What each damper allows, (D,)."]
    n_harmonics: Annotated[int, "Highest harmonic kept."]
    highest: Annotated[tuple[Known, ...], "How well the responses at the levels are known."]
    status: Annotated[MarginStatus, "How it ended."]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def reached(self) -> bool:
        """Whether every response was computed."""
        return self.status is MarginStatus.COMPLETED

    def known_parts(self) -> Iterable[Known]:
        """The responses at the levels."""
        return self.highest
