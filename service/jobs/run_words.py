"""What people say of runs and projects: how long it may be, and which characters it may hold."""

from __future__ import annotations

import unicodedata
from typing import Annotated

from pydantic import AfterValidator, Field

LONGEST_NAME, LONGEST_NOTES, LONGEST_TAG, MOST_TAGS = 200, 10_000, 50, 20
_LINES = frozenset("\n\r\t")
# Characters that hide or turn round what stands beside them.
_TURNING = frozenset("\u200e\u200f\u061c\u2028\u2029") | {
    chr(code) for code in (*range(0x202A, 0x202F), *range(0x2066, 0x206A))
}


def _refuse(text: str, allowed: frozenset[str]) -> None:
    for character in text:
        control = unicodedata.category(character) in ("Cc", "Cs") or character in _TURNING
        if control and character not in allowed:
            words = "besides tabs and ends of lines" if allowed else "and be one line"
            raise ValueError(f"must hold no control characters {words}, it has U+{ord(character):04X}")


def _one_line(text: str) -> str:
    _refuse(text, frozenset())
    return text.strip()


def _lines(text: str) -> str:
    _refuse(text, _LINES)
    return text


def _some(text: str) -> str:
    if not text:
        raise ValueError("must hold more than spaces")
    return text


def _each_once(tags: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(sorted(set(tags)))


RunName = Annotated[str, Field(max_length=LONGEST_NAME), AfterValidator(_one_line)]
ProjectName = Annotated[
    str, Field(min_length=1, max_length=LONGEST_NAME), AfterValidator(_one_line), AfterValidator(_some)
]
Notes = Annotated[str, Field(max_length=LONGEST_NOTES), AfterValidator(_lines)]
Tag = Annotated[
    str, Field(min_length=1, max_length=LONGEST_TAG), AfterValidator(_one_line), AfterValidator(_some)
]
Tags = Annotated[tuple[Tag, ...], Field(max_length=MOST_TAGS), AfterValidator(_each_once)]
