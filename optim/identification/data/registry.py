"""The kinds of measured data; a further one is one module and one line here."""

from __future__ import annotations

from functools import cache
from importlib import import_module

from optim.identification.data.measured import Column, DataKind

SHIPPED = (
    "optim.identification.data.response",
    "optim.identification.data.loop",
    "optim.identification.data.mode",
)


@cache
def data_kinds() -> tuple[DataKind, ...]:
    """Return every kind of data there is."""
    return tuple(import_module(module).KIND for module in SHIPPED)


def known_columns() -> dict[str, Column]:
    """Return the columns of all kinds by name; a name means the same in each."""
    return {column.name: column for kind in data_kinds() for column in kind.columns}


def known_words() -> dict[str, str]:
    """Return what the heads of all kinds may say."""
    return {word: text for kind in data_kinds() for word, text in kind.words.items()}
