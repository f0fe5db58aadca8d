"""What one per cent of every parameter does: what `optim.studies.elasticities` returns."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

from solver.arrays import FloatOrNaN
from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import Known
from solver.results.told import Piece
from solver.results.views import Views
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from solver.continuation.branch import Branch, Peak


class SensitivityStatus(Enum):
    """Whether there are sensitivities; the value is a sentence a user can act on."""

    KNOWN = "Every derivative is exact for the harmonics kept."
    SINGULAR = (
        "Some derivatives do not exist at this design (the peak or a band edge sits on a change of contact "
        "state): those are left out; look at a design beside it."
    )
    NO_RESPONSE = (
        "The frequency response could not be computed over the whole band: use more harmonics or a narrower "
        "band."
    )
    UNDAMPED = (
        "There is a resonance in the band and no damping, so that nothing bounds the response: give the "
        "structure some (damping_ratio = 0.001, say), or a band without the resonance."
    )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ParameterSensitivity(Piece):
    """What one parameter does to the peaks and the band."""

    path: Annotated[str, "The parameter."]
    unit: Annotated[str, "Its unit."]
    value: Annotated[float, "Its value."]
    relative: Annotated[bool, "Whether per cent of it mean something: not of angles, and not of what is 0."]
    peaks: Annotated[
        tuple[float, ...], "Derivative of every competing peak [m per unit], in the order of the result."
    ]
    band: Annotated[float, "Derivative of the band's width [Hz per unit]; NaN without a band."]


class WithoutDerivative(NamedTuple):
    """A parameter without a derivative, and why."""

    path: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SensitivityResult(MadeOfResponses, Drawn):
    """Sensitivities of a design."""

    VIEWS: ClassVar = Views(
        "optim.views", "studies:shares", "designs:sensitivities_figure", "sensitivities_dataset"
    )
    JSON: ClassVar = (
        "scene peaks band_hz limit band_by_limit rows left_out peak_certificate=branch.peak_certificate"
        " seconds reached status"
    )

    scene: Annotated[Scene, "With the values of the design."]
    status: Annotated[SensitivityStatus, "Whether there are sensitivities."]
    branch: Annotated[Branch, "The response."]
    peaks: Annotated[tuple[Peak, ...], "Those that compete, highest first."]
    rows: Annotated[
        tuple[ParameterSensitivity, ...],
        "What matters most for the highest peak first; those without per cents last.",
    ]
    band_by_limit: Annotated[FloatOrNaN, "Of the band's width by the limit [Hz/m], the peaks held."]
    left_out: Annotated[tuple[WithoutDerivative, ...], "Parameters without a derivative, with the reason."]
    seconds: Annotated[float, "Time in all [s]."]

    @property
    def reached(self) -> bool:
        """Whether there are sensitivities."""
        return self.status not in (SensitivityStatus.NO_RESPONSE, SensitivityStatus.UNDAMPED)

    @property
    def band_hz(self) -> FloatOrNaN:
        """Width of the resonance band [Hz]; NaN without one."""
        return math.nan if self.branch.band is None else self.branch.band.width

    @property
    def limit(self) -> FloatOrNaN:
        """Amplitude above which the band is measured [m]; NaN without one."""
        return math.nan if self.branch.band is None else self.branch.band.limit

    def peak_elasticities(self, row: ParameterSensitivity) -> tuple[float, ...]:
        """Return the per cent of every competing peak for one per cent of a parameter; NaN where none."""
        factor = row.value if row.relative else math.nan
        return tuple(
            slope * factor / peak.value if peak.value > 0.0 else math.nan
            for slope, peak in zip(row.peaks, self.peaks, strict=True)
        )

    def band_elasticity(self, row: ParameterSensitivity) -> float:
        """Return the per cent of the band for one per cent of a parameter; NaN where none."""
        return row.band * row.value / self.band_hz if row.relative and self.band_hz > 0.0 else math.nan

    def known_parts(self) -> Iterable[Known]:
        """The response."""
        return (self.branch.known,)

    def to_json(self) -> dict[str, Any]:
        """Return the result as one JSON object."""
        shares = {row.path: self.peak_elasticities(row) for row in self.rows}
        rows = [
            {
                "path": row.path, "unit": row.unit, "value": row.value,
                "peak_percent": shares[row.path][0], "peaks_percent": shares[row.path],
                "band_percent": self.band_elasticity(row), "peak_slope": row.peaks[0],
                "peak_slopes": row.peaks, "band_slope": row.band,
            }
            for row in self.rows
        ]  # fmt: skip
        return self._json(rows=rows)
