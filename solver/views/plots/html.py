"""Pictures as files, also as pages that need nothing else: with the numbers behind and how to repeat them."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from solver.results.files import Dataset, whole
from solver.results.told import Block, Summary
from solver.views.plots import style
from solver.views.plots.style import write

MOST_ROWS = 2000
_DIGITS = 6
_SHORT = 16  # characters that stay on one line: a number with its unit
CSS = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; color: #222; background: #fff;
  max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
figure { margin: 1rem 0; } img { max-width: 100%; height: auto; }
figcaption, .quiet { color: #555; font-size: .9rem; }
table { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .7rem .2rem 0; text-align: left; vertical-align: top; }
thead th { border-bottom: 1px solid #999; } td.number { text-align: right; }
tbody th, td.short, td:nth-child(2):not(:last-child) { white-space: nowrap; }
tbody tr + tr > * { border-top: 1px solid #eee; }
pre { background: #f5f5f5; padding: .8rem; font-size: .8rem; white-space: pre-wrap; }
@page { size: A4; margin: 14mm 14mm 16mm; }
@media print { body { margin: 0; max-width: none; padding: 0; font-size: 7.6pt; line-height: 1.3; }
  h1 { font-size: 15pt; } h2 { font-size: 10pt; margin: 7pt 0 3pt; }
  h3 { font-size: 8.4pt; margin: 6pt 0 2pt; }
  h1, h2, h3, h2 + p, h3 + p { break-after: avoid; } h1, p { margin: 0 0 3pt; }
  figure { break-inside: avoid; margin: 3pt 0; text-align: center; } img { max-height: 76mm; }
  figcaption, .quiet { font-size: 7pt; } table { font-size: 7.6pt; margin-bottom: 4pt; }
  thead { font-size: 7pt; }
  th, td { padding: 1.6pt 7pt 1.8pt 0; } tr { break-inside: avoid; }
  tbody th { color: #555; font-weight: normal; }
  pre { columns: 2; font-size: 6pt; padding: 3pt 5pt; margin: 0 0 4pt; } }
"""


def page(title: str, body: str) -> str:
    """A whole page; `body` is HTML, the title is not."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{CSS}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def image(figure: Figure, words: str, caption: str = "") -> str:
    """A picture inside the page; `words` are read to those who do not see it."""
    data = base64.b64encode(style.written(figure, "svg")).decode()
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f'<figure><img src="data:image/svg+xml;base64,{data}" alt="{escape(words)}">{below}</figure>'


def table(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table; numbers are rounded and aligned right."""
    head = "".join(f"<th scope='col'>{escape(one)}</th>" for one in heads)
    body = "".join(f"<tr>{''.join(_cell(value) for value in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def block_html(block: Block, most: int | None = None) -> str:
    """What is told of a result, a table of at most so many rows, without its title."""
    return pairs(block.pairs) if isinstance(block, Summary) else table(block.columns, block.rows[:most])


def pairs(given: Sequence[tuple[str, str]]) -> str:
    """Names with their values."""
    rows = "".join(f"<tr><th scope='row'>{escape(n)}</th><td>{escape(v)}</td></tr>" for n, v in given)
    return f"<table><tbody>{rows}</tbody></table>"


def picture_page(figure: Figure, data: Dataset | None) -> str:
    """The page of ``--plot F.html``."""
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    title = next((text for text in titles if text), "stickslip")
    parts = [f"<h1>{escape(title)}</h1>", image(figure, title)]
    if data is not None:
        # The table behind the picture, and what the dataset says of itself.
        columns = {n: v for n, v in data.table().variables.items() if not n.startswith(_IN_PARTS)}
        heads = [f"{name} [{v.unit}]" if v.unit else name for name, v in columns.items()]
        rows = [list(row) for row in zip(*(v.values.tolist() for v in columns.values()), strict=True)]
        shown = (
            f"{len(rows)} rows" if len(rows) <= MOST_ROWS else f"the first {MOST_ROWS} of {len(rows)} rows"
        )
        about = {name: value for name, value in data.attributes.items() if name != "scene"}
        parts += [
            pairs([(name, _text(value)) for name, value in about.items()]),
            f"<details><summary>Data ({shown})</summary>{table(heads, rows[:MOST_ROWS])}</details>",
        ]
        if "scene" in data.attributes:
            text = escape(str(data.attributes["scene"]))
            parts.append(f"<details><summary>Scene (TOML)</summary><pre>{text}</pre></details>")
    return page(title, "\n".join(parts))


# Cosine and sine parts of every harmonic: in files, not in a table that is read.
_IN_PARTS = ("displacement_cos", "displacement_sin")


def _cell(value: Any) -> str:
    text = _text(value)
    kind = " class=short" if len(text) <= _SHORT else ""
    if isinstance(value, int | float) and not isinstance(value, bool):
        kind = " class=number"
    return f"<td{kind}>{escape(text)}</td>"


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.{_DIGITS}g}" if math.isfinite(value) else ""
    return "" if value is None else str(value)


def save(page: Figure, path: Path, data: Dataset | None = None) -> None:
    """Write a picture, whole or not at all; the suffix chooses the format.

    Parameters
    ----------
    page : what was drawn.
    path : ends in one of `solver.views.plots.SUFFIXES`.
    data : the numbers behind it, which a page of HTML lists.
    """
    with whole(path) as temporary:
        if path.suffix.lower() == ".html":
            temporary.write_text(picture_page(page, data), "utf-8")
            return
        write(page, temporary, path.suffix.lower().removeprefix("."))
