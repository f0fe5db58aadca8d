"""Masses and springs, as the table of a scene."""

from collections.abc import Mapping
from typing import Any


def lumped(masses: Mapping[str, Any], *springs: tuple[Any, ...], **more: Any) -> dict[str, Any]:
    """A lumped structure; a spring is (one end, other end, k) or (one end, other end, k, c)."""
    ends = [{"between": [one, other], **dict(zip("kc", kc, strict=False))} for one, other, *kc in springs]
    return {"kind": "lumped", "masses": dict(masses), "springs": ends, **more}
