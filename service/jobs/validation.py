"""From a request body to a checked request, with one sentence and one JSON pointer for each thing wrong."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from service.errors import InvalidRequestError
from service.jobs.strict_json import MOST_TOLD
from solver.errors import Issue, pointer

ModelT = TypeVar("ModelT", bound=BaseModel)

_SHOULD = re.compile(r"^(?:Input|String|List|Tuple) should (be|have)\b")
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
        message = f"the body must be a JSON object, got {type(body).__name__}"
        raise InvalidRequestError([Issue(pointer="", message=message)])
    try:
        return model.model_validate(dict(body))
    except ValidationError as error:
        raise InvalidRequestError(issues_of(error.errors(include_url=False)[:MOST_TOLD]), source) from error


def issues_of(errors: Sequence[Any]) -> list[Issue]:
    """Pydantic's errors as issues."""
    return [_issue(error) for error in errors]


def _issue(error: Mapping[str, Any]) -> Issue:
    location = [part for part in error["loc"] if part != "[key]"]
    kind = error["type"]
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        return _unknown_tag(error, location)
    key = _cut(str(location[-1])) if location else "body"
    message = _MESSAGES.get(kind) or str(error["msg"]).removeprefix("Value error, ")
    message = _SHOULD.sub(r"must \1", message)
    if not message.startswith("`"):
        message = f"`{key}` {message}"
        if kind not in ("missing", "extra_forbidden"):
            message += f", got {_short(error.get('input'))}"
    return Issue(pointer=pointer(*location), message=message)


def _unknown_tag(error: Mapping[str, Any], location: Sequence[object]) -> Issue:
    """The key that tells the members of a union apart is missing, or names none of them."""
    context = error["ctx"]
    key = str(context["discriminator"]).strip("'")
    message = f"`{key}` is missing"
    if error["type"] == "union_tag_invalid":
        known = str(context["expected_tags"]).replace("'", "")
        message = f"`{key}` must be one of {known}, got {_short(error['input'][key])}"
    return Issue(pointer=pointer(*location, key), message=message)


def _short(value: object) -> str:
    # What is large is not written out to be cut.
    if isinstance(value, str | list | tuple | dict) and len(value) > _SHOWN:
        value = value[:_SHOWN] if isinstance(value, str | list | tuple) else f"an object of {len(value)} keys"
    return _cut(repr(value))


def _cut(text: str) -> str:
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."
