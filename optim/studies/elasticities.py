"""Sensitivities in engineering form: per cent of the peaks and of the band for one per cent of a parameter.

From the exact gradients through the whole solve (`optim.criteria.response_gradients`), all parameters from
one adjoint a peak or band edge. An elasticity is (p / a) da/dp: it has no unit, and says what matters. Of a
homogeneous system of degree one the elasticities of a peak by f0 and by all normal loads add up to 1 (Euler).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from optim.criteria.peak_criterion import COMPETES
from optim.criteria.response_gradients import Sensitivity
from optim.problem.variables import Real
from optim.results.studies_result import (
    ParameterSensitivity,
    SensitivityResult,
    SensitivityStatus,
    WithoutDerivative,
)
from solver.balance.balance import resolve
from solver.balance.parameter_derivatives import reason_without
from solver.balance.simplifications import Effects
from solver.contacts.laws.load_harmonics import is_phase
from solver.continuation.branch import Branch, BranchStatus, Peak
from solver.continuation.branches.sweep import sweep
from solver.continuation.extrema.extrema import HALF_POWER
from solver.jit.timer import clock
from solver.scene.parameter_paths import PHASE
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import even_harmonics_reason


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
    begun = clock()
    here = scene if values is None else scene.with_values(values)
    known = here.parameter_paths()
    effects = Effects(even_harmonics=even_harmonics_reason(here, known) is not None)
    branch = sweep(here, harmonics=harmonics, limit=limit, effects=effects)
    if not branch.reached or branch.peak is None:
        undamped = branch.status is BranchStatus.UNDAMPED
        status = SensitivityStatus.UNDAMPED if undamped else SensitivityStatus.NO_RESPONSE
        return SensitivityResult(
            scene=here, status=status, branch=branch, peaks=(), rows=(),
            band_by_limit=math.nan, left_out=(), seconds=clock() - begun,
        )  # fmt: skip
    reasons = {path: reason_without(here, branch.balance, path) for path in known}
    paths = [path for path, reason in reasons.items() if not reason]
    left_out = tuple(WithoutDerivative(path, reason) for path, reason in reasons.items() if reason)
    peaks = tuple(peak for peak in branch.peaks if peak.value >= COMPETES * branch.peak.value)
    rows, by_limit = _rows(here, branch, peaks, paths, fixed=limit is not None)
    exist = all(np.isfinite([*row.peaks, row.band]).all() for row in rows)
    found = SensitivityResult(
        scene=here, status=SensitivityStatus.KNOWN if exist else SensitivityStatus.SINGULAR, branch=branch,
        peaks=peaks, rows=rows, band_by_limit=by_limit, left_out=left_out, seconds=0.0,
    )  # fmt: skip
    in_order = tuple(sorted(rows, key=partial(_rank, found)))
    return replace(found, rows=in_order, seconds=clock() - begun)


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


def _rank(found: SensitivityResult, row: ParameterSensitivity) -> tuple[bool, float]:
    """Return what brings first what matters most, of equals what the scene names first."""
    share = found.peak_elasticities(row)[0]
    # μ and N0 of a contact matter alike: rounding would put now one first, now the other.
    return math.isnan(share), -float(f"{abs(share):.6g}") if math.isfinite(share) else 0.0
