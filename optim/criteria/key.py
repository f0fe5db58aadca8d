"""Keys by which criteria are limited, and how the command writes any key of a design problem."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from solver.wording import documented

WORD = re.compile(r"[a-z][a-z0-9_]*")
_FLAG = re.compile(r"--[a-z][a-z0-9-]*")


class Form(Enum):
    """How the option of a key is written."""

    NUMBER = "one number"
    WHOLE_NUMBER = "one whole number"
    WORD = "one word"
    RANGES = "LO HI, repeatable"
    BOUNDS = "PATH LO HI, repeatable"
    NUMBER_OR_TABLE = "one number, or NAME=NUMBER, repeatable"
    NUMBERS_BY_PATH = "PATH=NUMBER, repeatable"
    NUMBERS_BY_WORD = "WORD=NUMBER, repeatable"
    WORDS_BY_PATH = "PATH=WORD, repeatable"
    NAMES = "NAME, repeatable"
    FLAG = "no word"


@dataclass(frozen=True, slots=True)
class Option:
    """The option of the command that stands for a key."""

    form: Annotated[Form, "How it is written."]
    flag: Annotated[str, "Its name."]
    metavar: Annotated[str, "What stands behind it in the help."]
    help: Annotated[str, "What it means."]
    word: Annotated[
        str, "What each name of an option of `Form.NAMES` stands for in the table of the key."
    ] = ""
    example: Annotated[str, "Of its text."] = ""
    words: Annotated[tuple[str, ...], "Those it takes, of `Form.WORD`."] = ()

    @property
    def several(self) -> int:
        """How many words follow it each time it is given."""
        return {Form.BOUNDS: 3, Form.RANGES: 2}.get(self.form, 1)


@documented
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Key:
    """A key that limits a criterion: of problem files, REST bodies and `optim.design`, with its option."""

    name: Annotated[str, "The key."]
    help: Annotated[str, "What it means, with its unit; a sentence."]
    annotation: Annotated[Any, "Its values in a body: a type that pydantic understands, without None."]
    form: Annotated[Form, "That of its option, see `Option`."]
    flag: Annotated[str, "Likewise."]
    metavar: Annotated[str, "Likewise."]
    option_help: Annotated[str, "Help of the option; `help` if empty."] = ""
    word: Annotated[str, "Likewise."] = ""
    example: Annotated[str, "Likewise."] = ""
    examples: Annotated[tuple[Any, ...], "Values of the key."] = ()
    needs_limit: Annotated[bool, "Whether it is refused without the key ``limit``."] = False
    beside: Annotated[str, "Another key of its criterion that it is read with."] = ""

    def __post_init__(self) -> None:
        if not WORD.fullmatch(self.name):
            raise ValueError(f"`name` of a key must be such as max_peak, got {self.name!r}")
        if not _FLAG.fullmatch(self.flag):
            raise ValueError(f"`flag` of {self.name} must be such as --max-peak, got {self.flag!r}")

    @property
    def option(self) -> Option:
        """Its option."""
        words = self.option_help or self.help
        return Option(self.form, self.flag, self.metavar, words, word=self.word, example=self.example)


LEAST, LARGEST = 1e-30, 1e15
"""Of what is not 0: with these, their squares and inverses floating-point numbers compute."""
LEAST_HZ, MOST_HZ = 1e-9, 1e9
MAX_RANGES = 200


def _told_from_zero(number: float) -> float:
    if 0.0 < abs(number) < LEAST:
        raise ValueError(f"must be 0 or at least {LEAST:g}, up to the sign")
    return number


Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST), AfterValidator(_told_from_zero)]
NotNegative = Annotated[Number, Field(ge=0.0)]
Share = Annotated[float, Field(strict=True, ge=LEAST, lt=1.0)]
PositiveNumber = Annotated[float, Field(strict=True, ge=LEAST, le=LARGEST)]
MAX_HARMONICS = 200
Harmonics = Annotated[int, Field(strict=True, ge=1, le=MAX_HARMONICS)]
ParameterPath = Annotated[str, Field(max_length=210, pattern=r"^[A-Za-z0-9_@-]+(\.[A-Za-z0-9_@-]+)?$")]
FrequencyHz = Annotated[float, Field(strict=True, ge=LEAST_HZ, le=MOST_HZ)]
SpeedRpm = Annotated[float, Field(strict=True, ge=1e-7, le=60.0 * MOST_HZ)]
Name = Annotated[str, Field(strict=True, min_length=1, max_length=200)]
_Two = Field(min_length=2, max_length=2)
_Some = Field(min_length=1, max_length=MAX_RANGES)
Pair = Annotated[list[Number], _Two]
Ranges = Annotated[list[Pair], _Some]
BandHz = Annotated[list[FrequencyHz], _Two]
BandsHz = Annotated[list[BandHz], _Some]
RangeRpm = Annotated[list[SpeedRpm], _Two]
RangesRpm = Annotated[list[RangeRpm], _Some]


def number_or_table(unit: str, of: str) -> Any:
    """Return the type of a positive number, or a table of them; what is read looks at the numbers.

    Parameters
    ----------
    unit : of the numbers.
    of : what the keys of the table name.
    """

    def checked(value: object) -> object:
        few = value.values() if isinstance(value, dict) and 1 <= len(value) <= 1000 else [value]
        # What is read looks at what is no number, and says where.
        if all(LEAST <= one <= LARGEST for one in few if isinstance(one, int | float)) and (
            isinstance(value, dict) or (isinstance(value, int | float) and not isinstance(value, bool))
        ):
            return value
        bounds = f"from {LEAST:g} to {LARGEST:g}"
        raise ValueError(f"must be a number {bounds} [{unit}], or a table of {of} with one each")

    one = {"type": "number", "minimum": LEAST, "maximum": LARGEST}
    schema = {"anyOf": [one, {"type": "object", "additionalProperties": one}]}
    return Annotated[Any, BeforeValidator(checked), WithJsonSchema(schema)]
