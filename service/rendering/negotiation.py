"""Which of several representations a client prefers (RFC 9110, section 12.5.1)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

_RANGE = re.compile(r"([!#$%&'*+.^_`|~0-9a-z-]+)/([!#$%&'*+.^_`|~0-9a-z-]+)")
_QUALITY = re.compile(r"(?:0(?:\.[0-9]{0,3})?|1(?:\.0{0,3})?)")


@dataclass(frozen=True, slots=True)
class _Range:
    kind: str
    subkind: str
    quality: float

    def specificity(self, offered: str) -> int:
        """How exactly it means a media type; 0 if it does not."""
        if f"{self.kind}/{self.subkind}" == offered:
            return 3
        if self.subkind == "*" and self.kind == offered.partition("/")[0]:
            return 2
        return int(self.kind == self.subkind == "*")


def preferred(accept: str | None, offered: Sequence[str]) -> str | None:
    """The media type of `offered` that an `Accept` header prefers, the first among equals.

    None if none will do; without the header every one will. What cannot be read in it is passed over.
    """
    if accept is None or not accept.strip():
        return offered[0] if offered else None
    ranges = [found for part in accept.lower().split(",") if (found := _range(part)) is not None]
    rated = [(_quality(ranges, media), media) for media in offered]
    best = max(rated, key=lambda pair: pair[0], default=(0.0, ""))
    return best[1] if best[0] > 0.0 else None


def _quality(ranges: Sequence[_Range], offered: str) -> float:
    """The quality that the most specific range gives a media type; 0 if none means it."""
    specificity, quality = 0, 0.0
    for one in ranges:
        exact = one.specificity(offered)
        if exact > specificity or (exact == specificity > 0 and one.quality > quality):
            specificity, quality = exact, one.quality
    return quality


def _range(text: str) -> _Range | None:
    media, *parameters = (part.strip() for part in text.split(";"))
    found = _RANGE.fullmatch(media)
    if found is None:
        return None
    quality = 1.0
    for parameter in parameters:
        name, _, value = parameter.partition("=")
        if name.strip() == "q":
            if not _QUALITY.fullmatch(value.strip()):
                return None
            quality = float(value)
    return _Range(found[1], found[2], quality)
