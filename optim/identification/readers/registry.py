"""The formats of files with measured data; a further one is one module and one line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path

from optim.errors import DataError
from optim.identification.data.table import Table

SHIPPED = (
    "optim.identification.readers.csv_text",
    "optim.identification.readers.parquet",
    "optim.identification.readers.universal",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DataFormat:
    """A format of files with measured data.

    Attributes
    ----------
    name : str
        What people call it.
    suffixes : tuple of str
        Endings, lower case, with their dots.
    help : str
        How units and conditions stand in it, a sentence of Markdown.
    read : callable
        From a path and the names a scene has (parameter paths) to the tables in it.
    """

    name: str
    suffixes: tuple[str, ...]
    help: str
    read: Callable[[Path, frozenset[str]], list[Table]]


@cache
def data_formats() -> tuple[DataFormat, ...]:
    """Return every format there is."""
    return tuple(import_module(module).FORMAT for module in SHIPPED)


def read_file(path: Path, paths: frozenset[str]) -> list[Table]:
    """Read the tables of a file by its ending.

    Parameters
    ----------
    path : of the file.
    paths : parameter paths, which columns and lines of a head may name.

    Raises
    ------
    DataError
        A file that is not there or has an unknown ending, or what is wrong in it.
    """
    formats = {suffix: one for one in data_formats() for suffix in one.suffixes}
    if path.suffix.lower() not in formats:
        raise DataError(str(path), path.suffix, f"must end in {', '.join(formats)}")
    if not path.is_file():
        raise DataError(str(path), str(path), "must be a file that is there")
    return formats[path.suffix.lower()].read(path, paths)
