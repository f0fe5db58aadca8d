"""Words of messages: known names, what is near to a wrong one, values cut short."""

from __future__ import annotations

import difflib
from collections.abc import Sequence


def nearest(name: str, known: Sequence[str]) -> str:
    """A hint ``; did you mean `x`?``, or nothing when no known name is near (or there are too many)."""
    few = len(known) <= 300 and len(name) <= 200
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5) if few else []
    return f"; did you mean `{near[0]}`?" if near else ""


def listing(known: Sequence[str]) -> str:
    """The known names for a message, cut after twenty."""
    more = f", … ({len(known) - 20} more)" if len(known) > 20 else ""
    return ", ".join(known[:20]) + more


def quoted(value: object) -> str:
    """A value for a message, cut at 80 characters."""
    if isinstance(value, dict | list) and len(value) > 8:
        return f"a {'table' if isinstance(value, dict) else 'list'} of {len(value)}"
    try:
        text = repr(value)
    except (RecursionError, ValueError):
        text = f"a {type(value).__name__}"
    return text if len(text) <= 80 else text[:77] + "..."
