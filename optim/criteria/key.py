"""The keys by which criteria are limited: the same in problem files, REST bodies, Python and the command."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from typing import Any

WORD = re.compile(r"[a-z][a-z0-9_]*")
_FLAG = re.compile(r"--[a-z][a-z0-9-]*")


class Form(Enum):
    """How the option of a key is written."""

    NUMBER = "one number"
    RANGES = "LO HI, repeatable"
    NUMBER_OR_TABLE = "one number, or NAME=NUMBER, repeatable"
    NAMES = "NAME, repeatable"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Key:
    """A key of problem files, REST bodies and `optim.design`, with its option of the command.

    Attributes
    ----------
    name : str
        The key.
    help : str
        What it means, with its unit; a sentence.
    annotation : type
        Its values in a body: a type that pydantic understands, without None.
    form : Form
        How the option is written.
    flag : str
        The option.
    metavar : str
        What stands behind the option in its help.
    option_help : str
        Help of the option; `help` if empty.
    word : str
        What each name of an option of `Form.NAMES` stands for in the table of the key.
    example : str
        Of the option's text.
    examples : tuple
        Values of the key.
    needs_limit : bool
        Whether it is refused without the key ``limit``.
    """

    name: str
    help: str
    annotation: Any
    form: Form
    flag: str
    metavar: str
    option_help: str = ""
    word: str = ""
    example: str = ""
    examples: tuple[Any, ...] = ()
    needs_limit: bool = False

    def __post_init__(self) -> None:
        if not WORD.fullmatch(self.name):
            raise ValueError(f"`name` of a key must be such as max_peak, got {self.name!r}")
        if not _FLAG.fullmatch(self.flag):
            raise ValueError(f"`flag` of {self.name} must be such as --max-peak, got {self.flag!r}")
