"""What the commands about things of a service print: a list of them, or what became of one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

from service.errors import InputError
from service.rendering.tables.text import print_json, print_table, say

if TYPE_CHECKING:
    from service.schemas.answers import AnswerModel

MOST = 50
_T = TypeVar("_T")


def listed(ask: Callable[..., Iterator[_T]], count: int | None, **filters: Any) -> list[_T]:
    """The first of what a list holds, as many as ``--count`` says.

    Raises
    ------
    InputError
        It says less than one.
    """
    most = MOST if count is None else count
    if most < 1:
        raise InputError(f"`--count` must be >= 1, got {most!r}")
    return list(islice(ask(**filters, limit=min(most, 1000)), most))


def tell_list(
    found: Sequence[AnswerModel], title: str, columns: Sequence[str], rows: Iterable[Sequence[str]],
    *, right: str, as_json: bool,
) -> None:  # fmt: skip
    """Print a list: one JSON object, or a table as of `print_table`."""
    if as_json:
        print_json({"items": [one.model_dump(mode="json") for one in found]})
    else:
        print_table(title, columns, rows, right=right)


def tell(answer: AnswerModel, words: str, *, as_json: bool) -> None:
    """Print one JSON object, or `words`."""
    if as_json:
        print_json(answer.model_dump(mode="json"))
    else:
        say(words)
