"""What an amplitude is of, how well the numbers of a result are known, and what is to be said of them.

Axes, tables, reports, notebooks, the command and the page take them from here, the page from the JSON.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

from solver.arrays import FloatOrNaN
from solver.results import units
from solver.results.told import Piece, json_keys

MAX_ABS, HALF_PEAK_TO_PEAK = "max_abs", "half_peak_to_peak"
WORDS: Mapping[str, str] = MappingProxyType(
    {MAX_ABS: "max|x|", HALF_PEAK_TO_PEAK: "half peak to peak", "mean": "mean"}
)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Measured(Piece):
    """What the amplitudes, peaks and limits of a result are of."""

    JSON: ClassVar = "name dof measure harmonic unit"

    dof: Annotated[str, "The DOF, or the recovered sum, that is observed; ``x`` if it is not known."] = "x"
    measure: Annotated[str, "``max_abs`` or ``half_peak_to_peak``."] = MAX_ABS
    harmonic: Annotated[int | None, "The harmonic that is measured alone; None: the whole motion."] = None
    unit: Annotated[str, "Unit of it: m, or that of a recovered sum."] = "m"

    @classmethod
    def of_result(cls, found: Mapping[str, Any]) -> Measured:
        """Return what the JSON of a result says; of one of an earlier version the DOF, if it is there."""
        known = found.get("measured") or {"dof": found.get("dof", "x")}
        return cls(**{key: value for key, value in known.items() if key != "name"})

    @property
    def subject(self) -> str:
        """The DOF, or one harmonic of it."""
        return self.dof if self.harmonic is None else f"harmonic {self.harmonic} of {self.dof}"

    @property
    def name(self) -> str:
        """It with what it is of, as on an axis."""
        return f"max |{self.subject}|" if self.measure == MAX_ABS else f"{self.word} of {self.subject}"

    @property
    def word(self) -> str:
        """The measure alone."""
        return WORDS[self.measure]

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """What texts say of it: nothing of max|x| of the whole motion."""
        plain = self.measure == MAX_ABS and self.harmonic is None
        return [] if plain else [("amplitudes", self.name)]

    def unit_for(self, largest: float) -> units.ShownUnit:
        """The unit in which `largest` is drawn."""
        return units.shown_unit(largest, self.unit)

    def label(self, what: str, unit: units.ShownUnit) -> str:
        """The name of an axis: `what` stands on it, such as ``amplitude``."""
        return f"{what}, {self.name} [{unit.name}]" if what else f"{self.name} [{unit.name}]"


OF_X = Measured()
"""Of what is not known more than that it is max|x|."""


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


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Known(Piece):
    """How well the highest peak of responses is known."""

    JSON: ClassVar = (
        "measure peak_max_abs error_estimate peak_half_peak_to_peak half_peak_to_peak_error"
        " relative_error=relative flags notes peaks_open"
    )

    measure: Annotated[
        str,
        "What it is to be judged by: ``max_abs``, or ``half_peak_to_peak`` where the mean is free, so that "
        "max|x| depends on the history.",
    ] = MAX_ABS
    peak_max_abs: Annotated[FloatOrNaN, "max|x| of the peak [m]; NaN if not known."] = math.nan
    error_estimate: Annotated[FloatOrNaN, "Estimated error of max|x| of the peak [m]; NaN if not known."] = (
        math.nan
    )
    peak_half_peak_to_peak: Annotated[FloatOrNaN, "Half peak to peak [m], if that is the measure."] = math.nan
    half_peak_to_peak_error: Annotated[FloatOrNaN, "Estimated error of half peak to peak [m], likewise."] = (
        math.nan
    )
    flags: Annotated[tuple[str, ...], "Names of what the responses assume or leave open."] = ()
    notes: Annotated[
        tuple[Note, ...],
        "What is to be known before they are gone by: a highest amplitude at an end of the band, what of the "
        "scene is hardly meant.",
    ] = ()
    peaks_open: Annotated[
        tuple[str, ...],
        "Why of some responses it is not known that no higher peak hides between their points.",
    ] = ()

    @property
    def value(self) -> float:
        """The measure of the peak [m]; NaN without one."""
        return self.peak_max_abs if self.measure == MAX_ABS else self.peak_half_peak_to_peak

    @property
    def error(self) -> float:
        """Estimated error of that [m]; NaN if not known."""
        return self.error_estimate if self.measure == MAX_ABS else self.half_peak_to_peak_error

    @property
    def relative(self) -> FloatOrNaN:
        """Estimated error relative to the peak; infinite if one of them is not known."""
        return _relative(self.error, self.value)

    @property
    def relative_max_abs(self) -> float:
        """The same of max|x|, whatever the measure."""
        return _relative(self.error_estimate, self.peak_max_abs)

    @classmethod
    def of_result(cls, found: Mapping[str, Any]) -> Known:
        """Return what the JSON of a result says of it."""
        return cls.from_json({key: found[key] for key in json_keys(cls) if key in found})

    def pairs(self) -> list[tuple[str, str]]:
        """Return it in words, name and value a line."""
        return known_pairs(self.to_json())


NOTHING_KNOWN = Known()


def _relative(error: float, value: float) -> float:
    if error == 0.0:
        return 0.0
    return error / value if math.isfinite(error) and value > 0.0 else math.inf


def worst_of(parts: Iterable[Known]) -> Known:
    """Return the record of what is least known, with the flags, the notes and the reasons of all."""
    every = list(parts)
    if not every:
        return NOTHING_KNOWN
    worst = max(every, key=lambda one: one.relative)
    flags = tuple(dict.fromkeys(flag for one in every for flag in one.flags))
    reasons = tuple(dict.fromkeys(reason for one in every for reason in one.peaks_open))
    return replace(worst, flags=flags, notes=notes_of_all(one.notes for one in every), peaks_open=reasons)


def known_pairs(found: Mapping[str, Any], *, besides: Sequence[str] = ()) -> list[tuple[str, str]]:
    """Return in words what the JSON of a result says of itself; nothing of one of an earlier version.

    Parameters
    ----------
    found : with the keys of `Known.to_json`.
    besides : keys that are told elsewhere.
    """
    if "measure" not in found:
        return []
    pairs: list[tuple[str, str]] = []
    if "error_estimate" not in besides:
        for error, size, of in (
            (found["error_estimate"], found["peak_max_abs"], WORDS[MAX_ABS]),
            (found["half_peak_to_peak_error"], found["peak_half_peak_to_peak"], WORDS[HALF_PEAK_TO_PEAK]),
        ):
            if error is not None and found["relative_error"] is not None:
                share = f", {units.number(100.0 * error / size, 2)} %" if size else ""
                pairs.append(("estimated error", f"{units.length(error)} of {of}{share}"))
        if found["relative_error"] is None:
            pairs.append(("estimated error", "not known"))
    pairs += [("note", words) for words in flag_words(found["flags"])] + note_pairs(found)
    if "peaks_open" not in besides:
        pairs += [
            ("warning", f"a response may have a higher peak. {reason}") for reason in found["peaks_open"]
        ]
    return pairs


class Stable(Enum):
    """Whether small perturbations die out; the value is the word in answers."""

    YES = "yes"
    NO = "no"
    NOT_KNOWN = "not known"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Verdict(Piece):
    """Whether a response is stable, and how that is known."""

    stable: Annotated[Stable, "Whether small perturbations die out: yes, no, or not known."]
    ground: Annotated[
        str,
        "Why, in one line; of a response that is not stable also a stable one of the same frequency, if "
        "the search of `solve_all` finds one.",
    ]

    def to_json(self) -> dict[str, str]:
        """Return it as entries of an answer."""
        return {"stable": self.stable.value, "stable_ground": self.ground}

    @property
    def line(self) -> str:
        """It in one line."""
        return f"{self.stable.value}: {self.ground}"


TAKES_LONG = "Floquet multipliers would take about"


def stable_pairs(found: Mapping[str, Any], of: str = "stable") -> list[tuple[str, str]]:
    """Return whether a response is stable; nothing where that would take long and was not asked for."""
    known = "stable" in found and found["stable"] and not found["stable_ground"].startswith(TAKES_LONG)
    return [(of, f"{found['stable']}: {found['stable_ground']}")] if known else []


def worst(verdicts: Sequence[Verdict]) -> Verdict:
    """Return the verdict of several responses: no if one is not stable, yes if all are."""
    if not verdicts:
        return Verdict(stable=Stable.NOT_KNOWN, ground="there is no response")
    order = (Stable.NO, Stable.NOT_KNOWN, Stable.YES)
    return min(verdicts, key=lambda each: order.index(each.stable))
