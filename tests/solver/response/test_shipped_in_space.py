"""The shipped scenes in space: responses beside time marching, from rest and from the response itself."""

from __future__ import annotations

import pytest

import solver
from solver.marching.start import Start
from solver.response.instant import start_of

# Half peak to peak [m] by `solver.march` from rest, steps halved.
MARCHED = {
    ("platform-wedge", 400.0): 9.395008091e-5,
}


@pytest.mark.parametrize(("name", "frequency_hz"), MARCHED)
def test_responses_agree_with_the_march_within_their_error(name: str, frequency_hz: float) -> None:
    solution = solver.solve(solver.load_scene(name), frequency_hz=frequency_hz, harmonics=7)
    assert solution.converged
    error = abs(solution.half_peak_to_peak - MARCHED[name, frequency_hz])
    assert error <= solution.error_estimate <= 0.1 * solution.half_peak_to_peak
