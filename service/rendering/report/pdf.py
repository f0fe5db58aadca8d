"""A report as a PDF: the headings, tables, pictures and texts of its page, laid out on sheets of A4.

ReportLab does it, which needs neither a browser nor packages of the system; the letters are those of
matplotlib.
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Callable, Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.errors import InputError
from service.rendering.report.page_parts import Heading, Part, Picture, Said, Table, Text, parts_of

if TYPE_CHECKING:
    from reportlab.platypus import Flowable

MISSING = (
    "a PDF needs the extra `pdf`, which is not installed (pip install 'stickslip[pdf]'): install it, or "
    "write a file that ends in .html"
)
MOST_LINES = 90
"""Of a text such as a scene file; the page has all of them."""
_MARGIN, _HIGHEST, _PLAIN, _SMALL = 40.0, 215.0, 7.6, 6.0  # points
_PADDING = 6.0  # of a frame, by ReportLab
_UNBROKEN = 18  # characters of a cell that stay on one line: a number with its unit
_INK, _QUIET, _LINE, _SHADE = "#1b1f24", "#505a66", "#cfd6de", "#f4f6f8"


def require_pdf() -> None:
    """Have what writes a PDF.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        import reportlab  # noqa: F401 - whether it is there
    except ImportError as error:
        raise InputError(MISSING) from error


def pdf_of(page: str) -> bytes:
    """A page of HTML whose pictures are PNG, as a PDF.

    Raises
    ------
    InputError
        What writes it is not installed.
    """
    require_pdf()
    from reportlab.lib.pagesizes import A4
    from reportlab.platypus import SimpleDocTemplate

    title, parts = parts_of(page)
    _letters()
    file = io.BytesIO()
    sheet = SimpleDocTemplate(
        file, pagesize=A4, leftMargin=_MARGIN, rightMargin=_MARGIN, topMargin=_MARGIN,
        bottomMargin=_MARGIN + 6.0, title=title, author="stickslip",
        subject="Design of a friction damper", invariant=1,
    )  # fmt: skip
    sheet.build(_laid_out(parts, sheet.width), canvasmaker=_numbered(title))
    return file.getvalue()


def _letters() -> None:
    import matplotlib
    from reportlab.pdfbase import pdfmetrics
    from reportlab.pdfbase.ttfonts import TTFont

    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    for name, file in (("Plain", "DejaVuSans"), ("Bold", "DejaVuSans-Bold"), ("Mono", "DejaVuSansMono")):
        if name not in pdfmetrics.getRegisteredFontNames():
            pdfmetrics.registerFont(TTFont(name, str(folder / f"{file}.ttf")))


def _numbered(title: str) -> Callable[..., Any]:
    """A canvas that writes title, version and number of the page at the foot of each."""
    from reportlab.pdfgen.canvas import Canvas

    foot = f"stickslip {version('stickslip')} · {date.today().isoformat()}"

    class Numbered(Canvas):  # type: ignore[misc]
        def __init__(self, *args: Any, **values: Any) -> None:
            super().__init__(*args, **values)
            self._pages: list[dict[str, Any]] = []

        def showPage(self) -> None:
            self._pages.append(dict(self.__dict__))
            self._startPage()

        def save(self) -> None:
            for number, page in enumerate(self._pages, start=1):
                self.__dict__.update(page)
                width = self._pagesize[0]
                self.setFont("Plain", _SMALL)
                self.setFillColor(_QUIET)
                self.drawString(_MARGIN + _PADDING, 26.0, f"{title} · {foot}")
                self.drawRightString(width - _MARGIN - _PADDING, 26.0, f"{number} / {len(self._pages)}")
                super().showPage()
            super().save()

    return Numbered


def _style(**more: Any) -> Any:
    from reportlab.lib.styles import ParagraphStyle

    size = more.pop("fontSize", _PLAIN)
    given = {
        "fontName": "Plain",
        "fontSize": size,
        "leading": 1.28 * size,
        "textColor": _INK,
        "spaceAfter": 3.0,
    }
    return ParagraphStyle("report", **{**given, **more})


def _laid_out(parts: Sequence[Part], width: float) -> list[Flowable]:
    """What stands on the sheets: a heading stays with what follows it."""
    from reportlab.platypus import KeepTogether, Paragraph

    flow: list[Flowable] = []
    heads: list[Flowable] = []
    for part in parts:
        if isinstance(part, Heading):
            size = {1: 15.0, 2: 10.0}.get(part.level, 8.4)
            style = _style(
                fontName="Bold",
                fontSize=size,
                spaceBefore=0.0 if part.level == 1 else 0.7 * size,
                spaceAfter=2.5,
            )
            heads.append(Paragraph(_safe(part.text), style))
            continue
        made = _flowables(part, width)
        if heads and isinstance(part, Said):
            heads += made  # a sentence under a heading stays with what it introduces
            continue
        # Of a picture its caption stays with it too; what is long may be broken after its beginning.
        kept = len(made) if isinstance(part, Picture) else 1
        flow += [KeepTogether([*heads, *made[:kept]]), *made[kept:]] if heads or kept > 1 else made
        heads = []
    return flow + heads


def _flowables(part: Part, width: float) -> list[Flowable]:
    from reportlab.platypus import Paragraph

    match part:
        case Picture():
            return _picture(part, width)
        case Table():
            return [_pairs(part, width) if part.pairs else _table(part, width)]
        case Text():
            return _text(part, width)
        case Said():
            return [Paragraph(_safe(part.text), _style(textColor=_QUIET if part.quiet else _INK))]
    raise TypeError(f"{type(part).__name__} has no form on a sheet")


def _safe(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _picture(part: Picture, width: float) -> list[Flowable]:
    from reportlab.lib.utils import ImageReader
    from reportlab.platypus import Image, Paragraph

    wide, high = ImageReader(io.BytesIO(part.png)).getSize()
    scale = min(width / wide, _HIGHEST / high)
    image = Image(io.BytesIO(part.png), width=scale * wide, height=scale * high)
    caption = Paragraph(_safe(part.caption), _style(fontSize=6.8, textColor=_QUIET, alignment=1))
    return [image, caption] if part.caption else [image]


def _cells(rows: Sequence[Sequence[str]], numeric: Sequence[bool], **more: Any) -> list[list[Any]]:
    from reportlab.platypus import Paragraph

    left, right = _style(spaceAfter=0.0, **more), _style(spaceAfter=0.0, alignment=2, **more)
    return [
        [Paragraph(_safe(cell), right if numeric[i] else left) for i, cell in enumerate(row)] for row in rows
    ]


def _unbroken(cell: str) -> list[int]:
    """How long what is not broken in a cell is."""
    return [len(cell)] if len(cell) <= _UNBROKEN else [len(word) for word in cell.split()]


def _widths(rows: Sequence[Sequence[str]], width: float, *, most: float = 46.0) -> list[float]:
    """Columns as wide as their longest words need, the rest shared by what stands in them."""
    columns = list(zip(*rows, strict=True))
    need = [max((length for cell in column for length in _unbroken(cell)), default=1) for column in columns]
    wish = [min(max(len(cell) for cell in column), most) for column in columns]
    least = [4.9 * n + 8.0 for n in need]
    spare = max(width - sum(least), 0.0)
    more = [max(4.6 * w + 8.0 - low, 0.0) for w, low in zip(wish, least, strict=True)]
    share = min(spare / sum(more), 1.0) if sum(more) > 0.0 else 0.0
    found = [low + share * extra for low, extra in zip(least, more, strict=True)]
    return [width / sum(found) * one for one in found] if sum(found) > width else found


def _table(part: Table, width: float) -> Flowable:
    from reportlab.platypus import LongTable

    rows = [list(row) for row in part.rows]
    numeric = [all(one[i] for one in part.numeric) if part.numeric else False for i in range(len(part.heads))]
    body = _cells(rows, numeric)
    head = _cells([part.heads], numeric, fontName="Bold", fontSize=7.0)
    table = LongTable(
        [*head, *body], colWidths=_widths([part.heads, *rows], width), repeatRows=1, hAlign="LEFT"
    )
    table.setStyle([
        ("VALIGN", (0, 0), (-1, -1), "TOP"), ("LINEBELOW", (0, 0), (-1, 0), 0.8, _QUIET),
        ("LINEBELOW", (0, 1), (-1, -1), 0.3, _LINE), ("TOPPADDING", (0, 0), (-1, -1), 1.6),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 1.8), ("LEFTPADDING", (0, 0), (-1, -1), 0.0),
        ("RIGHTPADDING", (0, 0), (-1, -1), 7.0),
    ])  # fmt: skip
    table.spaceAfter = 4.0
    return table


def _pairs(part: Table, width: float) -> Flowable:
    """Names with their values: two pairs a row where they are short."""
    from reportlab.platypus import LongTable

    rows = [tuple(row) for row in part.rows]
    short = len(rows) > 3 and all(len(name) <= 26 and len(value) <= 44 for name, value in rows)
    if short:
        half = (len(rows) + 1) // 2
        right = [*rows[half:], *[("", "")] * (2 * half - len(rows))]
        rows = [(*one, *other) for one, other in zip(rows[:half], right, strict=True)]
    cells = [
        [
            _cells([[text]], [False], textColor=_QUIET if i % 2 == 0 else _INK)[0][0]
            for i, text in enumerate(row)
        ]
        for row in rows
    ]
    names = 0.19 if short else 0.22
    columns = [names * width, (0.5 - names) * width] * 2 if short else [names * width, (1.0 - names) * width]
    table = LongTable(cells, colWidths=columns, hAlign="LEFT")
    table.setStyle([
        ("VALIGN", (0, 0), (-1, -1), "TOP"), ("TOPPADDING", (0, 0), (-1, -1), 1.0),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 1.2), ("LEFTPADDING", (0, 0), (-1, -1), 0.0),
        ("LINEBELOW", (0, 0), (-1, -1), 0.3, _LINE),
    ])  # fmt: skip
    table.spaceAfter = 4.0
    return table


def _text(part: Text, width: float) -> list[Flowable]:
    """A file: its lines in two columns, the first ones of a long one."""
    from reportlab.platypus import LongTable, Preformatted

    lines = [piece for line in part.text.splitlines() for piece in _broken(line, 62)]
    left_out = len(lines) - MOST_LINES
    if left_out > 0:
        lines = [*lines[:MOST_LINES], f"# … and {left_out} further lines: the report in HTML has them"]
    mono = _style(fontName="Mono", fontSize=_SMALL, spaceAfter=0.0)
    if len(lines) <= 6:
        columns = [lines]
    else:
        half = (len(lines) + 1) // 2
        columns = [lines[:half], lines[half:]]
    cells = [[Preformatted("\n".join(column), mono) for column in columns]]
    table = LongTable(cells, colWidths=[width / len(columns)] * len(columns), hAlign="LEFT")
    table.setStyle([
        ("VALIGN", (0, 0), (-1, -1), "TOP"), ("BACKGROUND", (0, 0), (-1, -1), _SHADE),
        ("TOPPADDING", (0, 0), (-1, -1), 3.0), ("BOTTOMPADDING", (0, 0), (-1, -1), 4.0),
    ])  # fmt: skip
    table.spaceAfter = 4.0
    return [table]


def _broken(line: str, most: int) -> list[str]:
    """A line in pieces of the width, at spaces where there are any; what goes on is set in."""
    inner = " " * (len(line) - len(line.lstrip()) + 4)
    return textwrap.wrap(line, most, subsequent_indent=inner, break_on_hyphens=False) or [""]
