"""What a result says of itself beside its numbers, in words: flags, and what is known between points."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from solver.results import units

ABOVE_FRICTION = "mean_load_above_friction"
WORST_MEAN, MEAN_STRESS_OPEN = "worst_mean", "mean_stress_open"
FLAGS: Mapping[str, str] = MappingProxyType(
    {
        "mean_undetermined": "the mean, and with it max|x|, depends on the history: go by half peak to peak",
        "history_dependent": (
            "half peak to peak depends on the history too: march from the starts that may occur"
        ),
        "all_stuck": "every contact sticks all the time",
        "separation": "a contact opens during the period",
        ABOVE_FRICTION: (
            "mean load above friction: dashpots alone, or nothing, hold a part that contacts alone touch"
        ),
        "not_unique": "its mirror image is a response too, and the symmetric one is unstable",
        "symmetric_unstable": (
            "a half-wave symmetric response is unstable: another one, with a mean, is seen"
        ),
        "travelling_wave_assumed": (
            "the response is assumed to be the travelling wave, compare with --effects every-sector"
        ),
        WORST_MEAN: (
            "where the mean depends on the history, a stress is judged by the worst mean that stuck contacts "
            "may hold"
        ),
        MEAN_STRESS_OPEN: (
            "how large a mean stress stuck contacts hold is not known: margins are those of an unloaded start"
        ),
    }
)
BAND_OPEN = "the band may have further pieces between points: it was not settled everywhere by solutions"
NONE_HIGHER = "known, none is higher than those listed"


def flag_words(flags: Iterable[str]) -> list[str]:
    """What each flag says; one of a newer version as it is."""
    return [FLAGS.get(flag, flag.replace("_", " ")) for flag in flags]


def drift_words(drift: float | None, flags: Iterable[str]) -> str:
    """What is known of how far a part that ratchets drifts in a period [m]; None or NaN: nothing."""
    if drift is not None and math.isfinite(drift):
        return f"{units.length(drift)} a period"
    endless = drift is not None and math.isinf(drift)
    return "ever faster" if endless or ABOVE_FRICTION in flags else "not known"


def between_points(*, known: bool, reason: str) -> str:
    """What is known of peaks between the points of a branch, by its certificate.

    Parameters
    ----------
    known, reason : of a `solver.continuation.certificate.PeakCertificate`.
    """
    return NONE_HIGHER if known else reason[:1].lower() + reason[1:]
