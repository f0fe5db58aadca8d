"""The source of `optim.problem.keyword_types`: the keys of a design problem as static types.

A type checker does not run `optim.problem.keys`, so what it shall know stands in a file, which
``python -m service.rendering.docs_tables`` brings up to date. A type is read from a key's JSON Schema, and as
wide as Python takes it: tuples stand for lists, names of variables and of criteria are texts.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from textwrap import fill
from typing import Any, get_args

from pydantic import BaseModel

from optim.problem.keys import ROBUST, DesignKeys, FrontKeys
from optim.problem.words import MethodWord, ScalingWord

_HEAD = '''"""The keys of a design problem as keyword arguments, for type checkers: ``**problem: Unpack[…]``.

Written by ``python -m service.rendering.docs_tables`` from `optim.problem.keys`; not to be edited. A key of a
criterion from outside the package is none of these: pass it in a ``**dict[str, Any]``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict

from optim.problem.words import Method, MethodWord, ScalingWord
'''
_INDENT, _WIDTH = " " * 4, 110
_NUMBERS = {"number": "float", "integer": "int", "boolean": "bool", "string": "str", "null": "None"}
_WORDS = {get_args(MethodWord): "MethodWord | Method", get_args(ScalingWord): "ScalingWord"}


def keyword_source() -> str:
    """Return the text of the module."""
    design, front = _keys(DesignKeys, ROBUST), _keys(FrontKeys, ("points",))
    both = {key: lines for key, lines in design.items() if key in front}
    classes = (
        _class("ProblemKeywords(TypedDict", "Those of a design and of a front.", both),
        _class("DesignKeywords(ProblemKeywords", "Those of a design without uncertainty.", design, both),
        _class(
            "FrontKeywords(ProblemKeywords", "Those of a front but the number of its points.", front, both
        ),
    )
    return "\n\n".join((_HEAD, *classes))


def _class(begin: str, summary: str, keys: Mapping[str, str], inherited: Container[str] = ()) -> str:
    """A class with keys, but for those it inherits."""
    lines = [f"class {begin}, total=False):", f'    """{summary}"""']
    own = [text for key, text in keys.items() if key not in inherited]
    return "\n".join([*lines, *([""] if own else []), *own]) + "\n"


def _keys(model: type[BaseModel], without: Container[str]) -> dict[str, str]:
    """Each key of a model with the lines of its type and its words."""
    properties = model.model_json_schema()["properties"]
    said = {key: f'"""{schema["description"]}"""' for key, schema in properties.items()}
    return {
        key: f"{_INDENT}{key}: {_optional(schema)}\n"
        + fill(said[key], _WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT)
        for key, schema in properties.items()
        if key not in without
    }


def _optional(schema: Mapping[str, Any]) -> str:
    """The type of a key, which is None where it is left out."""
    found = _type(schema)
    return found if found.endswith("| None") else f"{found} | None"


def _type(schema: Mapping[str, Any]) -> str:
    """The type that a JSON Schema describes."""
    if "anyOf" in schema:
        return " | ".join(map(_type, schema["anyOf"]))
    words = tuple(schema.get("enum", ())) or ((schema["const"],) if "const" in schema else ())
    if words:
        return _WORDS.get(words) or f"Literal[{', '.join(map(_quoted, words))}]"
    if schema.get("type") == "array":
        return f"Sequence[{_type(schema['items'])}]"
    if "$ref" in schema or schema["type"] == "object":
        values = [schema.get("additionalProperties"), *schema.get("patternProperties", {}).values()]
        known = next((one for one in values if isinstance(one, Mapping)), None)
        return f"Mapping[str, {'object' if known is None else _type(known)}]"
    return _NUMBERS[schema["type"]]


def _quoted(word: str) -> str:
    return f'"{word}"'
