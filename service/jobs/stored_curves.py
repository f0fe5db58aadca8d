"""From stored sweeps to the curves that are drawn."""

from __future__ import annotations

import numpy as np

from service.jobs.kind_view import StoredCurve
from solver.views.plots.curves import Response, above, with_peak


def response_of(sweep: StoredCurve) -> Response:
    """The curve of a stored sweep with at least one point; its band is that of the polyline."""
    peak = None if sweep.peak is None else (sweep.peak.at, sweep.peak.value)
    values = np.asarray(sweep.arrays["parameter"], dtype=np.float64)
    amplitude = np.asarray(sweep.arrays["amplitude"], dtype=np.float64)
    unstable = np.asarray(sweep.arrays.get("unstable", np.zeros(values.size)), dtype=np.bool_)
    values, amplitude, unstable = with_peak(values, amplitude, peak, unstable)
    limit = sweep.limit
    return Response(
        scene=sweep.scene,
        parameter=sweep.parameter,
        values=values,
        amplitude=amplitude,
        peak=peak,
        limit=limit,
        intervals=() if limit is None else above(values, amplitude, limit),
        unstable=unstable,
    )
