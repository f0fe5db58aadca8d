"""What the service says of contact laws."""

from __future__ import annotations

from dataclasses import asdict

from pydantic import Field

from service.schemas.answers import AnswerModel
from solver.contacts.laws.law_registry import DEFAULT, laws
from solver.scene.json_schema import scene_schema


class SpanAnswer(AnswerModel):
    """What a slider of a parameter covers."""

    low: float
    high: float
    of: str | None = Field(
        description="The parameter of whose absolute value both ends are multiples; null: they are values."
    )
    logarithmic: bool


class LawParameter(AnswerModel):
    """A parameter of a contact law: `CONTACT.name` is its path in a scene."""

    name: str
    symbol: str
    unit: str = Field(description="Empty of a pure number.")
    words: str
    otherwise: list[str] | None = Field(
        description="The parameters whose product it is where a scene leaves it out; null: it is not there."
    )
    slider: SpanAnswer | None


class LawAnswer(AnswerModel):
    """A contact law."""

    name: str
    default: bool = Field(description="Whether a contact that names no law has this one.")
    parameters: list[LawParameter]


class LawList(AnswerModel):
    """All contact laws."""

    items: list[LawAnswer]


def law_list() -> LawList:
    """Return every law of this process, with what the schema of scenes says of its parameters."""
    defined = scene_schema()["$defs"]
    items = []
    for word, law in laws().items():
        keys = defined[law.__name__]["properties"]
        parameters = [
            LawParameter(
                name=key, symbol=quantity.symbol or key, unit=quantity.unit,
                words=keys[key].get("description", ""),
                otherwise=None if quantity.otherwise is None else list(quantity.otherwise),
                slider=None if (span := quantity.span(key)) is None else SpanAnswer(**asdict(span)),
            )
            for key, quantity in law.PARAMETERS.items()
        ]  # fmt: skip
        items.append(LawAnswer(name=word, default=word == DEFAULT, parameters=parameters))
    return LawList(items=items)
