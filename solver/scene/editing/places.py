"""Where everything stands in a TOML text: the places of its tables, lists and values.

The text must be TOML: `tomllib` says whether it is, and is the judge of what it means. Reading it once more
takes a time that grows with its length alone.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise

_SPACE = re.compile(r"[ \t]*")
_BLANK = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_BARE_VALUE = re.compile(r"\d{4}-\d\d-\d\d[ Tt]\d\d:[^\s,\]}#]*|[^\s,\]}#]+")
_STRINGS = tuple(
    re.compile(form)
    for form in (
        r'"""(?:[^"\\]|\\[\s\S]|"(?!""))*"{3,5}', r"'''(?:[^']|'(?!''))*'{3,5}",
        r'"(?:[^"\\\n]|\\.)*"', r"'[^'\n]*'",
    )
)  # fmt: skip


class Kind(Enum):
    """How something is written."""

    VALUE = "a text, number, truth or date"
    LIST = "in brackets"
    INLINE = "a table in braces"
    TABLE = "a table under a header, or the whole"
    TABLES = "tables under double headers"
    DOTTED = "a table made by dotted keys"


@dataclass(slots=True)
class Place:
    """Where one part of a text stands.

    Attributes
    ----------
    kind : Kind
    start : int
        Offset at which it is told: its key, its header, or itself in a list.
    first, last : int
        Its value is ``text[first:last]``; of a table under a header these are the lines below it.
    keys : dict
        The places in a table.
    items : list
        The places in a list.
    blocks : list of (int, int)
        The lines of its headers, with comments right above them, to where the next one's begin.
    """

    kind: Kind
    start: int
    first: int
    last: int
    keys: dict[str, Place] = field(default_factory=dict)
    items: list[Place] = field(default_factory=list)
    blocks: list[list[int]] = field(default_factory=list)

    def parts(self) -> Iterator[Place]:
        """Itself and everything in it."""
        yield self
        for below in (*self.keys.values(), *self.items):
            yield from below.parts()


def places(text: str) -> Place:
    """The places of a TOML text whose lines end in a line feed."""
    return _Reader(text).whole()


def place_at(root: Place, pointer: str) -> Place:
    """The place of an RFC 6901 pointer, or of the nearest part around it that is there."""
    place = root
    for word in pointer.split("/")[1:]:
        key = word.replace("~1", "/").replace("~0", "~")
        if key in place.keys:
            place = place.keys[key]
        elif key.isdecimal() and len(key) < len("10000000") and int(key) < len(place.items):
            place = place.items[int(key)]
        else:
            break
    return place


class _Reader:
    """Reads a text from its beginning to its end."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0

    def whole(self) -> Place:
        root = Place(Kind.TABLE, 0, 0, 0)
        table = root
        while self._skip(_BLANK) < len(self._text):
            begin = self._at
            if self._text[begin] != "[":
                self._statement(table)
                table.last = self._at
                continue
            many = self._text.startswith("[[", begin)
            self._at += 2 if many else 1
            path = self._key()
            self._at += 2 if many else 1
            self._end_of_line()
            table = self._opened(root, path, begin, many=many)
        self._close_blocks(root)
        return root

    def _opened(self, root: Place, path: list[str], begin: int, *, many: bool) -> Place:
        """The table that a header opens."""
        above = root
        for word in path[:-1]:
            above = above.keys.setdefault(word, Place(Kind.TABLE, begin, begin, begin))
            if above.kind is Kind.TABLES:
                above = above.items[-1]
        table = Place(Kind.TABLE, begin, self._at, self._at)
        if many:
            above.keys.setdefault(path[-1], Place(Kind.TABLES, begin, begin, begin)).items.append(table)
        else:
            # An outer table may come after one that is in it.
            before = above.keys.get(path[-1])
            table.keys = before.keys if before is not None else {}
            above.keys[path[-1]] = table
        table.blocks.append([self._with_comments(begin), len(self._text)])
        return table

    def _with_comments(self, begin: int) -> int:
        """The beginning of the comment lines right above a header."""
        while begin:
            above = self._text.rfind("\n", 0, begin - 1) + 1
            if not self._text[above:begin].lstrip(" \t").startswith("#"):
                break
            begin = above
        return begin

    @staticmethod
    def _close_blocks(root: Place) -> None:
        blocks = sorted(block for place in root.parts() for block in place.blocks)
        for block, following in pairwise(blocks):
            block[1] = following[0]

    def _statement(self, table: Place) -> None:
        """``key = value`` to the end of its line."""
        begin = self._at
        path = self._key()
        self._at += 1  # the equals sign
        self._skip(_SPACE)
        for word in path[:-1]:
            table = table.keys.setdefault(word, Place(Kind.DOTTED, begin, begin, begin))
        value = self._value()
        value.start = begin
        table.keys[path[-1]] = value
        self._end_of_line()

    def _key(self) -> list[str]:
        """A key, its words between dots."""
        words = []
        while True:
            self._skip(_SPACE)
            begin = self._at
            if self._text[begin] in "\"'":
                self._string()
                words.append(str(tomllib.loads(f"k = {self._text[begin : self._at]}")["k"]))
            else:
                words.append(self._text[begin : self._skip(_BARE_KEY)])
            self._skip(_SPACE)
            if self._text[self._at] != ".":
                return words
            self._at += 1

    def _value(self) -> Place:
        begin = self._at
        here = self._text[begin]
        if here == "[":
            return self._list()
        if here == "{":
            return self._inline()
        if here in "\"'":
            self._string()
        else:
            self._skip(_BARE_VALUE)
        return Place(Kind.VALUE, begin, begin, self._at)

    def _list(self) -> Place:
        found = Place(Kind.LIST, self._at, self._at, self._at)
        self._at += 1
        while self._text[self._skip(_BLANK)] != "]":
            found.items.append(self._value())
            if self._text[self._skip(_BLANK)] == ",":
                self._at += 1
        self._at += 1
        found.last = self._at
        return found

    def _inline(self) -> Place:
        found = Place(Kind.INLINE, self._at, self._at, self._at)
        self._at += 1
        while self._text[self._skip(_BLANK)] != "}":
            begin, table = self._at, found
            path = self._key()
            self._at += 1
            self._skip(_SPACE)
            for word in path[:-1]:
                table = table.keys.setdefault(word, Place(Kind.DOTTED, begin, begin, begin))
            table.keys[path[-1]] = value = self._value()
            value.start = begin
            if self._text[self._skip(_BLANK)] == ",":
                self._at += 1
        self._at += 1
        found.last = self._at
        return found

    def _string(self) -> None:
        found = next(match for form in _STRINGS if (match := form.match(self._text, self._at)))
        self._at = found.end()

    def _skip(self, form: re.Pattern[str]) -> int:
        found = form.match(self._text, self._at)
        if found is not None:
            self._at = found.end()
        return self._at

    def _end_of_line(self) -> None:
        end = self._text.find("\n", self._at)
        self._at = len(self._text) if end < 0 else end + 1
