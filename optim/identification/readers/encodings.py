"""Encodings of text files: told by a byte order mark, else by what the bytes can be."""

from __future__ import annotations

import codecs
from pathlib import Path

from optim.problem.checks import DataError

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_LOOKED_AT = 4096  # bytes


def text_of(path: Path) -> str:
    """Return the text of a file.

    Raises
    ------
    DataError
        It cannot be read.
    """
    try:
        return decoded(path.read_bytes())
    except OSError as error:
        raise DataError(str(path), str(error), "must be a text file") from error


def decoded(raw: bytes) -> str:
    """Return bytes as text: in UTF-8, UTF-16 or UTF-32, else in the code page of western Windows."""
    for mark, encoding in _MARKS:
        if raw.startswith(mark):
            return raw.decode(encoding, errors="replace")
    first = raw[:_LOOKED_AT]
    # Of letters and digits in UTF-16 every other byte is zero; text in one byte each has none.
    for at, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        if 2 * first[at::2].count(0) > len(first[at::2]) > 0:
            return raw.decode(encoding, errors="replace")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")
