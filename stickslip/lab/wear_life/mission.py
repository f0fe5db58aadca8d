"""What worn contacts run through: hours, at a resonance peak or at given frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real as RealNumber

from solver.errors import SettingError
from solver.scene.parameter_paths import check_frequency

MOST_HOURS = 1e9


@dataclass(frozen=True, slots=True)
class Mission:
    """How long contacts run, and where: if nothing is said, always at the highest peak of the band.

    Attributes
    ----------
    hours : float
        How long it runs [h].
    frequency_hz : float or None
        At which it runs [Hz]; the highest peak of the band, the worst case, if left out.
    blocks : sequence of (float, float), or None
        Several frequencies [Hz], each with the hours of a mission it runs there, repeated often.

    Raises
    ------
    SettingError
        Hours or a frequency out of its range, both kinds of frequencies.
    """

    hours: float
    frequency_hz: float | None = None
    blocks: Sequence[Sequence[float]] | None = None

    def __post_init__(self) -> None:
        if not is_number(self.hours) or not 0.0 < self.hours <= MOST_HOURS:
            raise SettingError("hours", self.hours, f"must be a number > 0 and <= {MOST_HOURS:g}")
        self.shares()

    def shares(self) -> tuple[tuple[float, float], ...] | None:
        """Return frequencies [Hz] with their shares of the time; None for the peak."""
        if self.frequency_hz is not None:
            if self.blocks is not None:
                raise SettingError("frequency_hz", self.frequency_hz, "must not be given beside `blocks`")
            return ((check_frequency("frequency_hz", self.frequency_hz), 1.0),)
        if self.blocks is None:
            return None
        if not self.blocks:
            raise SettingError("blocks", list(self.blocks), "must have a frequency [Hz] with hours at least")
        found = dict[float, float]()
        for i, block in enumerate(self.blocks):
            if len(block) != 2 or not is_number(block[1]) or not 0.0 < block[1] <= MOST_HOURS:
                raise SettingError(("blocks", i), list(block), "must be a frequency [Hz] and hours > 0")
            hertz = check_frequency(f"blocks[{i}]", block[0])
            found[hertz] = found.get(hertz, 0.0) + block[1]
        total = sum(found.values())
        return tuple((hertz, hours / total) for hertz, hours in found.items())


def is_number(value: object) -> bool:
    """Whether something is a real number, which True and False are not."""
    return isinstance(value, RealNumber) and not isinstance(value, bool)
