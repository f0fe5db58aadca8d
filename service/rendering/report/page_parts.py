"""The parts of a report's page, read back from its HTML: what another form of it is laid out from."""

from __future__ import annotations

import base64
from dataclasses import dataclass, field
from html.parser import HTMLParser

_PNG = "data:image/png;base64,"
_HEADINGS = {"h1": 1, "h2": 2, "h3": 3}


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading."""

    level: int
    text: str


@dataclass(frozen=True, slots=True)
class Said:
    """A paragraph."""

    text: str
    quiet: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture with what is said below it."""

    png: bytes
    caption: str


@dataclass(frozen=True, slots=True)
class Text:
    """A text that stands as it is."""

    text: str


@dataclass(slots=True)
class Table:
    """A table: rows of cells, and which of them are numbers; without heads it is of names and values."""

    heads: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)
    numeric: list[list[bool]] = field(default_factory=list)

    @property
    def pairs(self) -> bool:
        """Whether it is of names and values."""
        return not self.heads


Part = Heading | Said | Picture | Text | Table


def parts_of(page: str) -> tuple[str, list[Part]]:
    """Read a page as `solver.views.plots.html` writes it, its pictures as PNG.

    Returns
    -------
    Its title, and its parts in their order.
    """
    reader = _Reader()
    reader.feed(page)
    reader.close()
    return reader.title, reader.parts


class _Reader(HTMLParser):
    """Collects the text between tags."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.title = ""
        self.parts: list[Part] = []
        self._text: list[str] = []
        self._png = b""
        self._table: Table | None = None
        self._row: list[str] = []
        self._numbers: list[bool] = []
        self._in_head = False
        self._class = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag in (*_HEADINGS, "p", "pre", "title", "th", "td", "figcaption", "style"):
            self._text = []
            self._class = given.get("class") or ""
        if tag == "table":
            self._table = Table()
        elif tag == "thead":
            self._in_head = True
        elif tag == "tr":
            self._row, self._numbers = [], []
        elif tag == "figure":
            self._text = []
        elif tag == "img":
            source = given.get("src") or ""
            if not source.startswith(_PNG):
                raise ValueError(f"a picture of the report must be PNG, got {source[:30]!r}")
            self._png = base64.b64decode(source[len(_PNG) :])

    def handle_data(self, data: str) -> None:
        self._text.append(data)

    def handle_endtag(self, tag: str) -> None:
        text = "".join(self._text)
        match tag:
            case "title":
                self.title = text.strip()
            case "h1" | "h2" | "h3":
                self.parts.append(Heading(_HEADINGS[tag], text.strip()))
            case "p" if text.strip():
                self.parts.append(Said(text.strip(), quiet="quiet" in self._class))
            case "pre":
                self.parts.append(Text(text))
            case "figure":
                self.parts.append(Picture(self._png, text.strip()))
                self._text = []
            case _:
                self._of_a_table(tag, text.strip())

    def _of_a_table(self, tag: str, text: str) -> None:
        if self._table is None:
            return
        if tag in ("th", "td"):
            self._row.append(text)
            self._numbers.append("number" in self._class)
        elif tag == "thead":
            self._in_head = False
        elif tag == "tr" and self._in_head:
            self._table.heads = self._row
        elif tag == "tr":
            self._table.rows.append(self._row)
            self._table.numeric.append(self._numbers)
        elif tag == "table":
            if self._table.rows:
                self.parts.append(self._table)
            self._table = None
