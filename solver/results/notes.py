"""What a result says of itself beside its numbers, in words: flags, notes, what is known between points."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Annotated, Any

from solver.results import units
from solver.results.told import Piece

ABOVE_FRICTION = "mean_load_above_friction"
WORST_MEAN, MEAN_STRESS_OPEN = "worst_mean", "mean_stress_open"
NOTHING_DAMPS = (
    "In the range there is a resonance and no damping, so that nothing bounds the response: give the "
    "structure some (damping_ratio = 0.001, say)."
)
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


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Note(Piece):
    """What is to be known before numbers are gone by: of the peak of a response, or of a scene."""

    name: Annotated[str, "What it is of, in one word for programs, such as ``band_end``."]
    words: Annotated[str, "What people read."]
    numbers: Annotated[Mapping[str, float], "The numbers in the words, by name, in Hz, m, N/m or 1."]


_SOME = "in some of the responses "


def notes_of_all(parts: Iterable[Iterable[Note]]) -> tuple[Note, ...]:
    """The notes of several responses, one of each name, which says so where not all of them have it."""
    every = [{note.name: note for note in notes} for notes in parts]
    first: dict[str, Note] = {}
    for notes in every:
        first = {**notes, **first}
    return tuple(
        note
        if note.words.startswith(_SOME) or all(name in notes for notes in every)
        else replace(note, words=_SOME + note.words)
        for name, note in first.items()
    )


def note_pairs(found: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The notes in the JSON of a result as names with values; none of one of an earlier version."""
    return [("note", one["words"]) for one in found.get("notes") or ()]


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
    known, reason : of a `solver.continuation.branch.PeakCertificate`.
    """
    return NONE_HIGHER if known else reason[:1].lower() + reason[1:]
