"""What `solver.studies.mistuning` returns: the peaks of many disks, and what becomes of the highest."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from solver.arrays import FloatOrNaN, Real
from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import Known
from solver.results.notes import NOTHING_DAMPS
from solver.results.order_statistics import quantile_json
from solver.results.told import Piece
from solver.results.views import Data, Views

if TYPE_CHECKING:
    from solver.continuation.branch import Branch
    from solver.studies.blades import BladePeaks

QUANTILES = (0.05, 0.5, 0.95, 0.99)


class MistuningStatus(Enum):
    """How a study ended; the value is a sentence a user can act on."""

    COMPLETED = "The peaks of all blades of every disk are known."
    INCOMPLETE = (
        "Some responses did not reach the end of the band, so their disks are left out of the figures: use "
        "more harmonics or another band."
    )
    NO_RESPONSE = (
        "The tuned disk has no peak to compare with, or its response did not reach the end of the band: use "
        "another band or an excitation above 0."
    )
    UNDAMPED = NOTHING_DAMPS
    STOPPED = "The study was stopped by the caller: the figures are those of the disks so far."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MistunedDisk(Piece):
    """One disk of a study."""

    JSON: ClassVar = (
        "seed factors peaks=peaks.value at_hz=peaks.at_hz largest=peaks.largest worst_blade=peaks.worst"
        " magnification error_estimate=peaks.highest.error_estimate magnification_error"
        " measure=peaks.highest.measure flags=peaks.highest.flags"
    )

    seed: Annotated[int, "Of its factors."]
    factors: Annotated[tuple[float, ...], "One for each sector."]
    peaks: Annotated[BladePeaks, "Of every blade; without the branches."]
    magnification: Annotated[
        float, "Its highest peak relative to that of the tuned disk; NaN if a blade's is not known."
    ]
    magnification_error: Annotated[
        float, "Estimated error of that, by those of both peaks; NaN if it is not known."
    ] = math.nan

    @property
    def known(self) -> bool:
        """Whether the peaks of all blades are."""
        return math.isfinite(self.magnification)

    def to_json(self) -> dict[str, Any]:
        """Return the disk as one JSON object."""
        return self._json() if self.known else self._json(largest=None, worst_blade=None)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MistuningStudy(MadeOfResponses, Drawn):
    """What becomes of the highest peak when blades are not quite equal."""

    VIEWS: ClassVar = Views("solver.views", "disks:mistuning", "disks:mistuning_figure")
    DATA: ClassVar = Data(
        "mistuning", {"disk=disks": "seed magnification", "disk sector=disks": "factor=factors"
         " peak=peaks.value frequency=peaks.at_hz"},
        "spread of harmonics=n_harmonics tuned_peak=tuned.largest", index="sector",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene dof=tuned.dof measured=tuned.measured of spread tuned=tuned_peak samples=disks mean mean_error"
        " standard_error deviation quantiles worst n_harmonics seconds completed=reached status"
    )

    scene: Annotated[str, "Its name."]
    of: Annotated[tuple[str, ...], "The parts that have factors."]
    spread: Annotated[float, "Standard deviation of the factors."]
    tuned: Annotated[BladePeaks, "Of the disk without mistuning."]
    disks: Annotated[tuple[MistunedDisk, ...], "In the order of their seeds."]
    branches: Annotated[
        tuple[Branch, ...], "The responses of the worst blade of the tuned disk and of the worst one."
    ]
    n_harmonics: int
    status: MistuningStatus
    seconds: float

    @property
    def magnifications(self) -> Real:
        """The amplitude magnification factors of the disks whose peaks are known, in their order."""
        return np.array([disk.magnification for disk in self.disks if disk.known])

    @property
    def mean(self) -> FloatOrNaN:
        """Mean of the magnifications; NaN if none is known."""
        return float(self.magnifications.mean()) if self.magnifications.size else math.nan

    @property
    def deviation(self) -> FloatOrNaN:
        """Standard deviation of the magnifications; NaN of less than two."""
        return float(self.magnifications.std(ddof=1)) if self.magnifications.size > 1 else math.nan

    @property
    def standard_error(self) -> FloatOrNaN:
        """Of the mean, as that of so many disks; NaN of less than two."""
        return self.deviation / math.sqrt(max(self.magnifications.size, 1))

    @property
    def quantiles(self) -> tuple[Mapping[str, Any], ...]:
        """Quantiles of the magnification, and between what each lies."""
        known = self.magnifications
        return tuple(
            quantile_json("magnification", float(np.quantile(known, share)), known.tolist(), share)
            for share in (QUANTILES if known.size else ())
        )

    @property
    def tuned_peak(self) -> Mapping[str, Any]:
        """The highest peak [m] of the tuned disk and where it is [Hz]; null if it is not known."""
        known = math.isfinite(self.tuned.largest)
        at_hz = self.tuned.at_hz[self.tuned.worst] if known else None
        return {"peak": self.tuned.largest if known else None, "at_hz": at_hz}

    @property
    def mean_error(self) -> FloatOrNaN:
        """Estimated error of the mean magnification, by those of the peaks; NaN if one is not known."""
        errors = [disk.magnification_error for disk in self.disks if disk.known]
        return float(np.mean(errors)) if errors else math.nan

    @property
    def worst(self) -> MistunedDisk | None:
        """The disk with the highest peak."""
        return max((d for d in self.disks if d.known), key=lambda disk: disk.magnification, default=None)

    def known_parts(self) -> Iterable[Known]:
        """The highest blades of the tuned disk and of every other."""
        return (self.tuned.highest, *(disk.peaks.highest for disk in self.disks if disk.known))
