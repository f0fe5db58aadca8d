"""Sensitivities in engineering form: per cent of the peaks and of the band for one per cent of a parameter.

From the exact gradients through the whole solve (`optim.criteria.response_gradients`), all parameters from
one adjoint a peak or band edge. An elasticity is (p / a) da/dp: it has no unit, and says what matters. Of a
homogeneous system of degree one the elasticities of a peak by f0 and by all normal loads add up to 1 (Euler).
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np

from optim.criteria.amplitudes import COMPETES
from optim.criteria.response_gradients import Sensitivity
from optim.problem.variables import Real
from solver.balance.parameter import resolve
from solver.balance.parameter_derivatives import resolved
from solver.balance.simplifications import Effects, even_harmonics_reason
from solver.contacts.laws.harmonics import is_phase
from solver.continuation.branch import Branch, BranchStatus
from solver.continuation.branches.sweep import sweep
from solver.continuation.extrema.extrema import HALF_POWER
from solver.continuation.peaks import Peak
from solver.errors import SettingError
from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import Known
from solver.results.told import json_number
from solver.results.views import Views
from solver.scene.cyclic.annulus import check_in_annulus
from solver.scene.parameter_paths import PHASE
from solver.scene.scene import Scene


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


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterSensitivity:
    """What one parameter does to the peaks and the band.

    Attributes
    ----------
    path, unit : str
        The parameter.
    value : float
        Its value.
    relative : bool
        Whether per cent of it mean something: not of angles, and not of what is 0.
    peaks : tuple of float
        Derivative of every competing peak [m per unit], in the order of the result.
    band : float
        Derivative of the band's width [Hz per unit]; NaN without a band.
    """

    path: str
    unit: str
    value: float
    relative: bool
    peaks: tuple[float, ...]
    band: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SensitivityResult(MadeOfResponses, Drawn):
    """Sensitivities of a design.

    Attributes
    ----------
    scene : Scene
        With the values of the design.
    status : SensitivityStatus
        Whether there are sensitivities.
    branch : Branch
        The response.
    peaks : tuple of Peak
        Those that compete, highest first.
    rows : tuple of ParameterSensitivity
        What matters most for the highest peak first; those without per cents last.
    band_by_limit : float
        Derivative of the band's width by the limit it is measured at [Hz/m], the peaks held; NaN without.
    left_out : tuple of (str, str)
        Paths with the reason why they have no derivative.
    seconds : float
        Time in all.
    """

    scene: Scene
    status: SensitivityStatus
    branch: Branch
    peaks: tuple[Peak, ...]
    rows: tuple[ParameterSensitivity, ...]
    band_by_limit: float
    left_out: tuple[tuple[str, str], ...]
    seconds: float

    @property
    def reached(self) -> bool:
        """Whether there are sensitivities."""
        return self.status not in (SensitivityStatus.NO_RESPONSE, SensitivityStatus.UNDAMPED)

    @property
    def band_hz(self) -> float:
        """Width of the resonance band [Hz]; NaN without one."""
        return math.nan if self.branch.band is None else self.branch.band.width

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

    VIEWS: ClassVar = Views(
        "optim.views", "of_sensitivities", "sensitivities_dataset", "designs:sensitivities_figure"
    )

    def known_parts(self) -> Iterable[Known]:
        """The response."""
        return (self.branch.known,)

    def own_json(self) -> dict[str, object]:
        """Return the result as one JSON object."""
        band = self.branch.band
        return {
            "scene": self.scene.name,
            "peaks": [{"value": peak.value, "at": peak.at} for peak in self.peaks],
            "band_hz": json_number(self.band_hz),
            "limit": None if band is None else band.limit,
            "band_by_limit": json_number(self.band_by_limit),
            "rows": [
                {
                    "path": row.path,
                    "unit": row.unit,
                    "value": row.value,
                    "peak_percent": json_number(self.peak_elasticities(row)[0]),
                    "peaks_percent": [json_number(share) for share in self.peak_elasticities(row)],
                    "band_percent": json_number(self.band_elasticity(row)),
                    "peak_slope": json_number(row.peaks[0]),
                    "peak_slopes": [json_number(slope) for slope in row.peaks],
                    "band_slope": json_number(row.band),
                }
                for row in self.rows
            ],
            "left_out": [{"path": path, "reason": reason} for path, reason in self.left_out],
            "peak_certificate": self.branch.peak_certificate.to_json(),
            "seconds": self.seconds,
            "reached": self.reached,
            "status": self.status.value,
        }


def sensitivities(
    scene: Scene, values: Mapping[str, float] | None = None, limit: float | None = None, harmonics: int = 11
) -> SensitivityResult:
    """Return what one per cent of every parameter does to the highest peaks and to the resonance band.

    Parameters
    ----------
    scene : what vibrates; `observe` says which DOF and which band.
    values : the design, parameter path to value; the scene as it is if left out.
    limit : amplitude [m] above which the band is measured; half power of the peak, which moves with it, if
        left out.
    harmonics : highest harmonic kept.

    Raises
    ------
    SettingError
        A bad path, value, limit or number of harmonics.
    """
    begun = time.perf_counter()
    here = scene if values is None else scene.with_values(values)
    known = here.parameter_paths()
    effects = Effects(even_harmonics=even_harmonics_reason(here, known) is not None)
    branch = sweep(here, harmonics=harmonics, limit=limit, effects=effects)
    if not branch.completed or branch.peak is None:
        undamped = branch.status is BranchStatus.UNDAMPED
        status = SensitivityStatus.UNDAMPED if undamped else SensitivityStatus.NO_RESPONSE
        return SensitivityResult(
            scene=here, status=status, branch=branch, peaks=(), rows=(),
            band_by_limit=math.nan, left_out=(), seconds=time.perf_counter() - begun,
        )  # fmt: skip
    paths, left_out = _differentiable(here, branch, known)
    peaks = tuple(peak for peak in branch.peaks if peak.value >= COMPETES * branch.peak.value)
    rows, by_limit = _rows(here, branch, peaks, paths, fixed=limit is not None)
    exist = all(np.isfinite([*row.peaks, row.band]).all() for row in rows)
    found = SensitivityResult(
        scene=here, status=SensitivityStatus.KNOWN if exist else SensitivityStatus.SINGULAR, branch=branch,
        peaks=peaks, rows=rows, band_by_limit=by_limit, left_out=left_out, seconds=0.0,
    )  # fmt: skip
    return _sorted(found, begun)


def _differentiable(
    scene: Scene, branch: Branch, known: tuple[str, ...]
) -> tuple[list[str], tuple[tuple[str, str], ...]]:
    """Return the paths with a value and a derivative, and the others with the reason."""
    paths, left_out = [], []
    for path in known:
        try:
            scene.value(path)
            if branch.balance.scene is not scene:
                check_in_annulus(scene, path)
            resolved(branch.balance, [path])
        except SettingError as error:
            left_out.append((path, str(error)))
        else:
            paths.append(path)
    return paths, tuple(left_out)


def _rows(
    scene: Scene, branch: Branch, peaks: tuple[Peak, ...], paths: list[str], *, fixed: bool
) -> tuple[tuple[ParameterSensitivity, ...], float]:
    """Return the derivatives by every path, and that of the band by its limit."""
    sensitivity = Sensitivity(branch.balance, paths)
    by_peak = [sensitivity.peak(peak) for peak in peaks]
    band: Real = np.full(len(paths), math.nan)
    by_limit = math.nan
    if branch.band is not None and paths:
        edges, nothing = branch.band.edges, np.zeros(len(paths))
        band = sensitivity.band(edges, nothing if fixed else HALF_POWER * by_peak[0])
        by_limit = float((sensitivity.band(edges, nothing + 1.0) - sensitivity.band(edges, nothing))[0])
    rows = []
    for i, path in enumerate(paths):
        value = scene.value(path)
        rows.append(
            ParameterSensitivity(
                path=path, unit=resolve(scene, path).unit, value=value,
                relative=value != 0.0 and path != PHASE and not is_phase(path.rpartition(".")[2]),
                peaks=tuple(float(slopes[i]) for slopes in by_peak), band=float(band[i]),
            )
        )  # fmt: skip
    return tuple(rows), by_limit


def _sorted(found: SensitivityResult, begun: float) -> SensitivityResult:
    """Return the result with what matters most first."""

    def rank(row: ParameterSensitivity) -> tuple[bool, float]:
        share = found.peak_elasticities(row)[0]
        return math.isnan(share), -abs(share) if math.isfinite(share) else 0.0

    return SensitivityResult(
        scene=found.scene, status=found.status, branch=found.branch, peaks=found.peaks,
        rows=tuple(sorted(found.rows, key=rank)), band_by_limit=found.band_by_limit, left_out=found.left_out,
        seconds=time.perf_counter() - begun,
    )  # fmt: skip
