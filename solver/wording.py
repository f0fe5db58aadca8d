"""Words of messages: known names, what is near to a wrong one, values cut short."""

from __future__ import annotations

import difflib
import re
from ast import literal_eval
from collections.abc import Mapping, Sequence
from inspect import cleandoc, get_annotations
from typing import TypeVar

Documented = TypeVar("Documented")
_DECIMAL_COMMA = re.compile(r"(?:^|[=:])\s*\x22?([+-]?\d+,\d+(?:[eE][+-]?\d+)?)\s*(?:[}#\x22A-Za-zµ°%]|$)")
_DESCRIBED = re.compile(r"""Annotated\[(.+?)(?:, Field\(.+\))?, ('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")\]""")


def nearest(name: str, known: Sequence[str]) -> str:
    """A hint ``; did you mean `x`?``, or nothing when no known name is near (or there are too many)."""
    if not known or len(known) > 300 or len(name) > 200:
        return ""
    alike = difflib.SequenceMatcher(b=name.casefold())

    def ratio(one: str) -> float:
        alike.set_seq1(one.casefold())
        return alike.ratio()

    near = max(known, key=ratio)
    alike_enough = 0.5 if len(name) in (2, 3) else 0.65
    return f"; did you mean `{near}`?" if ratio(near) >= alike_enough else ""


def comma_hint(text: str) -> str:
    """A hint ``; 0,3: a decimal point, as in 0.3`` where a text has, or ends a line with, a decimal comma."""
    found = _DECIMAL_COMMA.search(text)
    return f"; {found[1]}: a decimal point, as in {found[1].replace(',', '.')}" if found else ""


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


def fields_said(kind: type) -> dict[str, tuple[str, str]]:
    """The fields that a class says in its annotations, ``mass: Annotated[float, "Mass [kg]."]``.

    Returns
    -------
    Name to type and words, of the class itself without those it is made from.
    """
    annotations = get_annotations(kind).items()
    found = {name: _DESCRIBED.fullmatch(str(text)) for name, text in annotations}
    return {name: (said[1], literal_eval(said[2])) for name, said in found.items() if said is not None}


def every_field_said(kind: type) -> dict[str, tuple[str, str]]:
    """The same of a class and of those it is made from."""
    return {key: said for base in reversed(kind.__mro__) for key, said in fields_said(base).items()}


def with_attributes(doc: str | None, said: Mapping[str, tuple[str, str]]) -> str:
    """A docstring with a section of attributes: names with their types and words."""
    rows = [f"{name} : {kind}\n    {words}" for name, (kind, words) in said.items()]
    return "\n".join([cleandoc(doc or ""), *(["\nAttributes\n----------", *rows] if rows else [])])


def documented(kind: type[Documented]) -> type[Documented]:
    """Give a class a docstring with what its annotations say of its fields."""
    kind.__doc__ = with_attributes(kind.__doc__, every_field_said(kind))
    return kind
