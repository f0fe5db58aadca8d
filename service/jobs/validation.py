"""From a request body to a checked request, with one sentence and one JSON pointer for each thing wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from service.errors import InvalidRequestError
from service.jobs.strict_json import MOST_TOLD
from solver.errors import UNSAID, Issue, Place, Shown

ModelT = TypeVar("ModelT", bound=BaseModel)

_SHOWN = 80  # characters of what was given
_MESSAGES = {
    "extra_forbidden": "is not a known key",
    "missing": "is missing",
    "finite_number": "must be a finite number",
    "bool_type": "must be true or false",
    "int_type": "must be a whole number",
    "float_type": "must be a number",
    "string_type": "must be a string",
}


def validated(model: type[ModelT], body: object, source: str = "body") -> ModelT:
    """`body` as a checked `model`; `source` says what it is.

    Raises
    ------
    InvalidRequestError
        Lists everything that is wrong.
    """
    if not isinstance(body, Mapping):
        raise InvalidRequestError.of(
            (), f"the body must be a JSON object, got {type(body).__name__}", named=False
        )
    try:
        return model.model_validate(dict(body))
    except ValidationError as error:
        raise InvalidRequestError(issues_of(error.errors(include_url=False)[:MOST_TOLD]), source) from error


def issues_of(errors: Sequence[Any]) -> list[Issue]:
    """Pydantic's errors as issues."""
    return [_issue(error) for error in errors]


def _issue(error: Mapping[str, Any]) -> Issue:
    location = tuple(part for part in error["loc"] if part != "[key]")
    kind = error["type"]
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        return _unknown_tag(error, location)
    if kind == "value_error":
        wanted = str(error["ctx"]["error"])
    else:
        _, _, should = str(error["msg"]).partition(" should ")
        wanted = _MESSAGES.get(kind) or (f"must {should}" if should else str(error["msg"]))
    # The validator of several keys says itself which it means.
    named = not wanted.startswith("`")
    told = named and kind not in ("missing", "extra_forbidden")
    return Issue(location, wanted, Shown(_short(error.get("input"))) if told else UNSAID, named)


def _unknown_tag(error: Mapping[str, Any], location: Place) -> Issue:
    """The key that tells the members of a union apart is missing, or names none of them."""
    context = error["ctx"]
    key = str(context["discriminator"]).strip("'")
    if error["type"] == "union_tag_not_found":
        return Issue((*location, key), "is missing")
    known = str(context["expected_tags"]).replace("'", "")
    return Issue((*location, key), f"must be one of {known}", Shown(_short(error["input"][key])))


def _short(value: object) -> str:
    # What is large is not written out to be cut.
    if isinstance(value, str | list | tuple | dict) and len(value) > _SHOWN:
        value = value[:_SHOWN] if isinstance(value, str | list | tuple) else f"an object of {len(value)} keys"
    return _cut(repr(value))


def _cut(text: str) -> str:
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."
