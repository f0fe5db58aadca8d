"""Whether a highest amplitude is a maximum or stands at an end of its band, and where a resonance is then.

Every study that names a peak asks here. At an end of the band the response still rises outwards: its height
says where the band was cut, not how high a resonance is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from solver.balance.parameter import Kind
from solver.jit.fourier import Real
from solver.linear.natural_frequencies import resonances
from solver.results.notes import Note
from solver.results.units import number
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from solver.continuation.branch import AnyBranch

BAND_END = "band_end"
_SAME = 1e-9  # relative distance from an end within which a frequency is that end
_DIGITS = 6


def is_band_end(branch: AnyBranch) -> bool:
    """Whether the highest amplitude over a frequency is at an end of the range, and no maximum."""
    peak = branch.peak
    if peak is None or peak.interior or branch.posed.parameter.kind is not Kind.FREQUENCY:
        return False
    return _at_end(peak.at, (branch.start, branch.stop))


def of_branch(branch: AnyBranch) -> tuple[Note, ...]:
    """Return the note of a branch whose highest amplitude is at an end of its band; else none."""
    if branch.peak is None or not is_band_end(branch):
        return ()
    return of_frequency(branch.scene, branch.peak.at, (branch.start, branch.stop))


def of_frequency(scene: Scene, at_hz: float, band: tuple[float, float]) -> tuple[Note, ...]:
    """Return the note of a highest amplitude of which no more is known than its place; none inside the band.

    Parameters
    ----------
    scene : what vibrates.
    at_hz : where the highest amplitude over the band is [Hz].
    band : ends of the band looked at [Hz].
    """
    if not _at_end(at_hz, band):
        return ()
    low, high = sorted(band)
    numbers = {"at_hz": at_hz}
    found = resonances(scene)
    if found is not None:
        for name, each in (("open_hz", found.open_hz), ("stuck_hz", found.stuck_hz)):
            outside = each[(each < low) | (each > high)]
            if outside.size:
                numbers[name] = nearest(outside, low, high)
    words = (
        f"the highest amplitude is at an end of the band, {number(at_hz, _DIGITS)} Hz, and no maximum"
        f"{_outside(numbers) if found is not None else ''}"
    )
    return (Note(name=BAND_END, words=words, numbers=numbers),)


def nearest(frequencies: Real, low: float, high: float) -> float:
    """Return which of some frequencies is nearest to a band, in Hz."""
    return float(min(frequencies.tolist(), key=lambda each: max(low - each, each - high)))


def _at_end(at_hz: float, band: tuple[float, float]) -> bool:
    return any(abs(at_hz - end) <= _SAME * abs(end) for end in band)


def _outside(numbers: dict[str, float]) -> str:
    """Where the nearest linear resonances are."""
    told = [
        f"{number(numbers[name], _DIGITS)} Hz with all contacts {words}"
        for name, words in (("open_hz", "open"), ("stuck_hz", "stuck"))
        if name in numbers
    ]
    if not told:
        return "; no linear resonance lies outside it"
    if numbers.get("open_hz") == numbers.get("stuck_hz"):
        told = [f"{number(numbers['open_hz'], _DIGITS)} Hz"]
    return f"; the nearest linear resonance outside it is {' or '.join(told)}"
