"""Text of scene files: where every value stands, and changes that leave the rest as it was written.

The text must be TOML: `tomllib` says whether it is, and is the judge of what it means. Reading it once more
takes a time that grows with its length alone.

The text and the tables it holds are walked together with the tables wanted. What is equal is copied letter by
letter; entries of lists that were added or taken out are told by the longest common parts of both lists. The
result is read again: where it would not hold exactly what is wanted, the whole is written anew instead.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from enum import Enum
from itertools import pairwise
from typing import Annotated, Any

from solver.scene.toml import MOST_INLINE, key_text, toml_text, value_text

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


class WritingKind(Enum):
    """How something is written."""

    VALUE = "a text, number, truth or date"
    LIST = "in brackets"
    INLINE = "a table in braces"
    TABLE = "a table under a header, or the whole"
    TABLES = "tables under double headers"
    DOTTED = "a table made by dotted keys"


@dataclass(slots=True)
class TextPlace:
    """Where one part of a text stands."""

    kind: WritingKind
    start: Annotated[int, "Offset at which it is told: its key, its header, or itself in a list."]
    first: Annotated[int, "Its value is ``text[first:last]``; of a table under a header the lines below it."]
    last: int
    keys: Annotated[dict[str, TextPlace], "The places in a table."] = field(default_factory=dict)
    items: Annotated[list[TextPlace], "The places in a list."] = field(default_factory=list)
    blocks: Annotated[
        list[list[int]],
        "The lines of its headers, with comments right above them, to where the next one's begin.",
    ] = field(default_factory=list)

    def parts(self) -> Iterator[TextPlace]:
        """Itself and everything in it."""
        yield self
        for below in (*self.keys.values(), *self.items):
            yield from below.parts()


def places(text: str) -> TextPlace:
    """The places of a TOML text whose lines end in a line feed."""
    return _Reader(text).whole()


def place_at(root: TextPlace, pointer: str) -> TextPlace:
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

    def whole(self) -> TextPlace:
        root = TextPlace(WritingKind.TABLE, 0, 0, 0)
        table = root
        while self._skip(_BLANK) < len(self._text):
            begin = self._at
            if self._text[begin] != "[":
                self._pair(table)
                self._end_of_line()
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

    def _opened(self, root: TextPlace, path: list[str], begin: int, *, many: bool) -> TextPlace:
        """The table that a header opens."""
        above = root
        for word in path[:-1]:
            above = above.keys.setdefault(word, TextPlace(WritingKind.TABLE, begin, begin, begin))
            if above.kind is WritingKind.TABLES:
                above = above.items[-1]
        table = TextPlace(WritingKind.TABLE, begin, self._at, self._at)
        if many:
            above.keys.setdefault(path[-1], TextPlace(WritingKind.TABLES, begin, begin, begin)).items.append(
                table
            )
        else:
            # An outer table may come after one that is in it.
            before = above.keys.get(path[-1])
            table.keys = before.keys if before is not None else {}
            above.keys[path[-1]] = table
        # From the beginning of the comment lines right above the header.
        while begin:
            line = self._text.rfind("\n", 0, begin - 1) + 1
            if not self._text[line:begin].lstrip(" \t").startswith("#"):
                break
            begin = line
        table.blocks.append([begin, len(self._text)])
        return table

    @staticmethod
    def _close_blocks(root: TextPlace) -> None:
        blocks = sorted(block for place in root.parts() for block in place.blocks)
        for block, following in pairwise(blocks):
            block[1] = following[0]

    def _pair(self, table: TextPlace) -> None:
        """``key = value``."""
        begin = self._at
        path = self._key()
        self._at += 1  # the equals sign
        self._skip(_SPACE)
        for word in path[:-1]:
            table = table.keys.setdefault(word, TextPlace(WritingKind.DOTTED, begin, begin, begin))
        table.keys[path[-1]] = value = self._value()
        value.start = begin

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

    def _value(self) -> TextPlace:
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
        return TextPlace(WritingKind.VALUE, begin, begin, self._at)

    def _list(self) -> TextPlace:
        found = TextPlace(WritingKind.LIST, self._at, self._at, self._at)
        self._at += 1
        while self._text[self._skip(_BLANK)] != "]":
            found.items.append(self._value())
            if self._text[self._skip(_BLANK)] == ",":
                self._at += 1
        self._at += 1
        found.last = self._at
        return found

    def _inline(self) -> TextPlace:
        found = TextPlace(WritingKind.INLINE, self._at, self._at, self._at)
        self._at += 1
        while self._text[self._skip(_BLANK)] != "}":
            self._pair(found)
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


Tables = Mapping[str, Any]
_MOST_COMPARED = 250_000
"""Pairs of entries of two lists; longer ones are paired in their order."""


class _UnwritableError(Exception):
    """The way the text is written has no place for the change."""


def edited(text: str, wanted: Tables, read: Callable[[str], Tables] = tomllib.loads) -> str:
    """Return the text changed so that it holds `wanted`.

    Parameters
    ----------
    text : TOML.
    wanted : tables, lists, texts, numbers and booleans, without null.
    read : reads the tables of a text, as both are compared.
    """
    lines = text.replace("\r\n", "\n")
    lines += "" if not lines or lines.endswith("\n") else "\n"
    held = read(lines)
    if _same(held, wanted):
        return lines
    try:
        changed = _Edits(lines).of_document(held, wanted)
        if _same(read(changed), wanted):
            return changed
    except (_UnwritableError, tomllib.TOMLDecodeError):
        pass  # written anew below: comments are lost, nothing else
    return toml_text(wanted, _leading_comments(lines))


def _leading_comments(text: str) -> tuple[str, ...]:
    found = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        found.append(line[1:].removeprefix(" "))
    return tuple(found)


def _same(one: object, other: object) -> bool:
    """Whether two values of JSON are equal; 1 and 1.0 are, 1 and true are not."""
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_same(value, other[key]) for key, value in one.items())
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    return isinstance(one, bool) == isinstance(other, bool) and one == other


def _paired(held: Sequence[Any], wanted: Sequence[Any]) -> list[int | None]:
    """For every entry wanted the one held that it comes from, in rising order; None of a new one."""
    if len(held) == len(wanted) or len(held) * len(wanted) > _MOST_COMPARED:
        return [i if i < len(held) else None for i in range(len(wanted))]
    a, b = ([json.dumps(one, sort_keys=True, default=str) for one in many] for many in (held, wanted))
    found: list[int | None] = [None] * len(wanted)
    for word, low, high, start, end in SequenceMatcher(None, a, b, autojunk=False).get_opcodes():
        if word in ("equal", "replace"):
            for i in range(min(high - low, end - start)):
                found[start + i] = low + i
    return found


class _Edits:
    """Changes of one text."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._cuts: list[tuple[int, int, str]] = []
        self._root = places(text)
        blocks = [block[0] for place in self._root.parts() for block in place.blocks]
        # Behind the lines of the whole, before the first header and what is said above it.
        self._root_end = self._root.last or min(blocks, default=len(text))

    def of_document(self, held: Tables, wanted: Tables) -> str:
        """Return the text that holds `wanted` in place of `held`."""
        self._table(self._root, held, wanted, ())
        out, at = [], 0
        for begin, end, new in sorted(self._cuts, key=lambda cut: cut[:2]):
            if begin < at:
                raise _UnwritableError
            out += [self._text[at:begin], new]
            at = end
        return "".join(out).lstrip("\n") + self._text[at:]

    # Tables under headers

    def _table(self, place: TextPlace, held: Tables, wanted: Tables, path: tuple[str, ...]) -> None:
        for key, below in place.keys.items():
            if key not in wanted:
                self._remove(below)
            elif not _same(held[key], wanted[key]):
                self._change(below, held[key], wanted[key], (*path, key))
        added = {key: value for key, value in wanted.items() if key not in held}
        if not path:
            self._add(added)
        elif added:
            if not place.blocks:
                raise _UnwritableError
            self._cuts.append((place.last, place.last, _lines(added)))

    def _add(self, added: Tables) -> None:
        """Keys of the whole: lines before the first header, tables at the end."""
        lines = {key: value for key, value in added.items() if not _has_header(value)}
        sections = {key: value for key, value in added.items() if key not in lines}
        if lines:
            self._cuts.append((self._root_end, self._root_end, _lines(lines)))
        if sections:
            end = len(self._text)
            self._cuts.append((end, end, "\n" + toml_text(sections)))

    def _change(self, place: TextPlace, held: Any, wanted: Any, path: tuple[str, ...]) -> None:
        if place.kind in (WritingKind.TABLE, WritingKind.DOTTED) and isinstance(wanted, Mapping):
            self._table(place, held, wanted, path)
        elif (
            place.kind is WritingKind.TABLES
            and isinstance(wanted, list)
            and all(map(_is_table, wanted))
            and wanted
        ):
            # The entries of ``[[path]]``.
            sources = _paired(held, wanted)
            for i, item in enumerate(place.items):
                if i not in sources:
                    self._remove(item)
            last = max(block[1] for part in place.items[0].parts() for block in part.blocks)
            at = place.items[0].blocks[0][0] if sources[0] is None else last
            name = ".".join(map(key_text, path))
            new: dict[int, list[str]] = {}
            for source, value in zip(sources, wanted, strict=True):
                if source is None:
                    new.setdefault(at, []).append(f"[[{name}]]\n{_lines(value)}")
                    continue
                item = place.items[source]
                at = max(block[1] for part in item.parts() for block in part.blocks)
                if not _same(held[source], value):
                    self._table(item, held[source], value, path)
            for where, texts in new.items():
                before = "" if not where or self._text[:where].endswith("\n\n") else "\n"
                after = "\n" if where < len(self._text) else ""
                self._cuts.append((where, where, before + "\n".join(texts) + after))
        elif len(path) == 1 and (place.blocks or place.kind is WritingKind.TABLES or held == []):
            self._remove(place)
            self._add({path[0]: wanted})
        elif place.kind in (WritingKind.VALUE, WritingKind.LIST, WritingKind.INLINE):
            self._cuts.append((place.first, place.last, self._value(place, held, wanted)))
        else:
            raise _UnwritableError

    def _remove(self, place: TextPlace) -> int:
        """Take out what stands at a place; where it began."""
        blocks = sorted(block for part in place.parts() for block in part.blocks)
        if blocks:
            self._cuts += [(begin, end, "") for begin, end in blocks]
            return blocks[0][0]
        if place.kind is WritingKind.DOTTED:
            for below in place.keys.values():
                self._remove(below)
            return place.start
        begin = self._text.rfind("\n", 0, place.start) + 1
        end = self._text.find("\n", place.last)
        self._cuts.append((begin, end + 1, ""))
        return begin

    # Values

    def _value(self, place: TextPlace, held: Any, wanted: Any) -> str:
        """The text of a value."""
        if _same(held, wanted):
            return self._text[place.first : place.last]
        if place.kind is WritingKind.INLINE and isinstance(wanted, Mapping) and wanted:
            return self._inline(place, held, wanted)
        if place.kind is WritingKind.LIST and isinstance(wanted, list) and wanted and held:
            return self._list(place, held, wanted)
        if isinstance(held, float) and isinstance(wanted, int) and not isinstance(wanted, bool):
            return value_text(float(wanted))
        return value_text(wanted)

    def _inline(self, place: TextPlace, held: Tables, wanted: Tables) -> str:
        if any(below.kind is WritingKind.DOTTED for below in place.keys.values()):
            return value_text(wanted)
        pieces = []
        for key, value in wanted.items():
            if key in held:
                below = place.keys[key]
                pieces.append(self._text[below.start : below.first] + self._value(below, held[key], value))
            else:
                pieces.append(f"{key_text(key)} = {value_text(value)}")
        return f"{{ {', '.join(pieces)} }}"

    def _list(self, place: TextPlace, held: list[Any], wanted: list[Any]) -> str:
        """Entries with what stands around them: comments above and behind, and how far they are moved in."""
        sources = _paired(held, wanted)
        words = [
            value_text(value) if source is None else self._value(place.items[source], held[source], value)
            for source, value in zip(sources, wanted, strict=True)
        ]
        if "\n" not in self._text[place.first : place.last]:
            line = f"[{', '.join(words)}]"
            if None in sources and len(line) > MOST_INLINE:
                return "[\n" + "".join(f"  {word},\n" for word in words) + "]"
            return line
        around, rest = self._around(place)
        indent = around[0][0].rpartition("\n")[2]
        out: list[str] = []
        for j, source in enumerate(sources):
            lead, trail = (indent, ",\n") if source is None else around[source]
            if j + 1 < len(wanted) and "," not in trail.partition("#")[0]:
                trail = f",{trail}"
            if source is None and out and not out[-1].endswith("\n"):
                lead = f"\n{lead}"
            out.append(lead + words[j] + trail)
        opening = "\n" if self._text[place.first + 1] == "\n" else ""
        return f"[{opening}{''.join(out)}{rest}]"

    def _around(self, place: TextPlace) -> tuple[list[tuple[str, str]], str]:
        """What stands before and behind each entry of a list, and what is left behind the last one.

        The end of a line belongs to its last entry.
        """
        found = []
        at = place.first + 1
        if self._text[at] == "\n":
            at += 1
        for i, item in enumerate(place.items):
            lead = self._text[at : item.first]
            following = place.items[i + 1].first if i + 1 < len(place.items) else place.last - 1
            line = self._text.find("\n", item.last, following)
            comma = self._text.find(",", item.last, following)
            at = line + 1 if line >= 0 else comma + 1 if comma >= 0 else item.last
            found.append((lead, self._text[item.last : at]))
        return found, self._text[at : place.last - 1]


def _is_table(value: object) -> bool:
    return isinstance(value, Mapping)


def _has_header(value: object) -> bool:
    """Whether `toml_text` gives it headers."""
    return _is_table(value) or (isinstance(value, list) and bool(value) and all(map(_is_table, value)))


def _lines(table: Tables) -> str:
    return "".join(f"{key_text(key)} = {value_text(value)}\n" for key, value in table.items())
