"""From the keys of a request to options of the command: those of the local command, or made of the schema."""

from __future__ import annotations

import inspect
import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin

import typer
from typer.models import OptionInfo

from service.cli import completion
from service.cli.options import inputs
from service.cli.options import parameters as options
from service.cli.options.inputs import number, whole_number
from service.cli.options.parameters import Command, keyword, parameters_of
from service.errors import InputError
from service.jobs.kind_registry import Flag, JobKind
from solver.scene.descriptions import DISK_LOAD

SCENE = "scene"
Schema = Mapping[str, Any]

_PAIR, _PATH = "LO HI", "PATH"
_KEY = "key"
_TAKEN = ("--wait", "--json", "--url", "--key-file", "--help")
_SCALARS: dict[str, tuple[Any, Callable[[str], Any] | None, str]] = {
    "number": (float, number, "X"),
    "integer": (int, whole_number, "N"),
    "string": (str, None, "TEXT"),
}


@dataclass(frozen=True, slots=True)
class KeyOption:
    """An option that stands for a key of a body.

    Attributes
    ----------
    key, name : of the body, and of the field that is called so there.
    flag : as it is written, with its hyphens.
    parameter : inspect.Parameter
        Of the command.
    schema : JSON schema of the key, without null.
    metavar : what stands for its value, where that is said.
    """

    key: str
    name: str
    flag: str
    parameter: inspect.Parameter
    schema: Schema
    metavar: str = ""

    def in_body(self, given: Any) -> Any:
        """What stands in the body for what was given; None if the key is to be left out.

        InputError if it cannot be read, or is not finite.
        """
        if given is None or given == [] or given == self.parameter.default:
            return None
        for one in given if isinstance(given, (list, tuple)) else (given,):
            if isinstance(one, float) and not math.isfinite(one):
                raise InputError(f"`{self.flag}` must be a finite number, got {one!r}")
        kind = self.schema.get("type")
        if kind == "boolean":
            return given is not (self.schema.get("default") is True)
        if isinstance(given, tuple):
            return list(given) if _is_pair(self.schema) else [list(given)]
        if kind == "object" and isinstance(given, list):
            return self._by_path(given)
        return self._read(given) if isinstance(given, str) and kind in (None, "array", "object") else given

    def _by_path(self, texts: Sequence[str]) -> Mapping[str, Any]:
        """What stands in a table of parameter paths: numbers, pairs, lists or words, as its schema says."""
        # Paths of a given form stand under patternProperties.
        known = [
            self.schema.get("additionalProperties"), *(self.schema.get("patternProperties") or {}).values()
        ]  # fmt: skip
        of_each: Schema = next((one for one in known if isinstance(one, Mapping)), {})
        if of_each.get("type") == "array" and of_each.get("maxItems") == 2:
            return inputs.bounds(self.flag, texts, self.metavar.partition(" ")[2] or _PAIR)
        if of_each.get("type") == "array":
            lists = inputs.by_name(self.flag, texts, f"{DISK_LOAD}=100,400", "PATH=V,V,…")
            return {
                path: [inputs.part(self.flag, f"{path}={words}", word) for word in words.split(",")]
                for path, words in lists.items()
            }
        if "enum" in of_each:
            return inputs.by_name(self.flag, texts, f"{DISK_LOAD}=logarithmic", "PATH=WORD")
        return inputs.settings(texts, self.flag)

    def _read(self, text: str) -> Any:
        try:
            return json.loads(text)
        except ValueError as error:
            raise InputError(f"`{self.flag}` takes JSON, got {text!r}: {error}") from error


def key_options(kind: JobKind, local: Command | None, *, free: bool = False) -> list[KeyOption]:
    """An option for every key of a kind but its scene, those of the local command first.

    Parameters
    ----------
    kind : what is submitted.
    local : the command that computes the same here, if there is one; its options are reused.
    free : none is needed: what the scene suggests stands for those left out.
    """
    described = kind.request.model_json_schema()
    needed = described.get("required", ())
    known = {} if local is None else options_of(local)
    asked = {f.alias or name: (name, f) for name, f in kind.request.model_fields.items() if name != SCENE}
    schemas = {key: _without_null(described["properties"][key]) for key in asked}
    said = {
        key: next((one for one in f.metadata if isinstance(one, Flag)), Flag())
        for key, (_, f) in asked.items()
    }
    flags = {key: said[key].name or _flag(kind, key, schema) for key, schema in schemas.items()}
    found = []
    for key, flag in flags.items():
        whole, schema = described["properties"][key], schemas[key]
        words = as_options(whole.get("description", ""), flags)
        words = f"{words.rstrip('.')}; the scene suggests it." if free and key in needed else words
        mine = known.get(flag) or _made(
            flag, said[key], schema, whole, words, needed=not free and key in needed
        )
        parameter = mine.replace(name=f"key_{key}", kind=inspect.Parameter.KEYWORD_ONLY)
        found.append(KeyOption(key, asked[key][0], flag, parameter, schema, said[key].metavar))
    order = [*known, *(one.flag for one in found)]
    return sorted(found, key=lambda one: order.index(one.flag))


def options_of(command: Command) -> dict[str, inspect.Parameter]:
    """The options of a command by how they are written."""
    return {
        flag: parameter for parameter in parameters_of(command) for flag in flags_of(parameter.annotation)
    }


def flags_of(annotation: Any) -> list[str]:
    """How an annotated option is written; empty for an argument."""
    found = []
    for told in get_args(annotation)[1:]:
        if isinstance(told, OptionInfo):
            # Without a default before them, Typer keeps the first of the names in its place.
            found += [told.default, *(told.param_decls or ())]
    return [flag for flag in found if isinstance(flag, str) and flag.startswith("--")]


def _flag(kind: JobKind, key: str, schema: Schema) -> str:
    """How the option of a key is written."""
    word = key.replace("_", "-")
    if schema.get("type") == "boolean" and schema.get("default") is True:
        word = f"no-{word}"
    flag = kind.view.flags.get(key, f"--{word}")
    return f"{flag}-key" if flag in _TAKEN else flag


def as_options(words: str, flags: Mapping[str, str]) -> str:
    """Return words with the options in place of the keys."""
    # One of several values of a key has its number behind the name.
    return re.sub(
        r"`(\w+)(?:\[\d+\])?", lambda found: f"`{flags[found[1]]}" if found[1] in flags else found[0], words
    )


def _made(
    flag: str, said: Flag, schema: Schema, whole: Schema, words: str, *, needed: bool
) -> inspect.Parameter:
    """An option of the schema of its key."""
    if flag == "--set":
        return keyword(_KEY, options.Values, None)
    kind, default = schema.get("type"), whole.get("default")
    if kind == "boolean" and needed:
        both = f"{flag}/--no-{flag.removeprefix('--')}"
        return keyword(_KEY, Annotated[bool, typer.Option(both, help=words)], inspect.Parameter.empty)
    if kind == "boolean":
        words = f"Switch off: {words}" if default is True else words
        return keyword(_KEY, Annotated[bool, typer.Option(flag, help=words)], False)
    type_, parser, shown = _read_as(schema)
    parser = inputs.number_in(words) if parser is number else parser
    if said.metavar and kind == "object":  # told by the metavariable
        type_, parser = list[str], None
    if said.metavar == _PAIR:  # one of the ranges that a list may hold
        type_, parser = tuple[float, float], None
    if get_origin(type_) is list:
        words = f"{words} Repeatable."
    offered = completion.offered(said.words, paths=said.metavar == _PATH)
    told = typer.Option(
        flag, metavar=said.metavar or shown, parser=parser, help=words, autocompletion=offered
    )
    if needed:
        return keyword(_KEY, Annotated[type_, told], inspect.Parameter.empty)
    return keyword(
        _KEY, Annotated[type_ | None, told], default if isinstance(default, (int, float, str)) else None
    )


def _read_as(schema: Schema) -> tuple[Any, Callable[[str], Any] | None, str]:
    """Type, parser and metavariable of an option."""
    kind = schema.get("type")
    if _is_pair(schema):
        return tuple[float, float], None, _PAIR
    if kind in _SCALARS:
        type_, parser, metavar = _SCALARS[kind]
        return type_, parser, "|".join(map(str, schema.get("enum", ()))) or metavar
    if kind == "array" and schema["items"].get("type") in _SCALARS:
        one, parser, metavar = _read_as(schema["items"])
        several: Any = list.__class_getitem__(one)
        return several, parser, metavar
    if kind == "object" and _of_numbers(schema):
        return list[str], None, "NAME=VALUE"
    return str, None, "JSON"


def _without_null(schema: Schema) -> Schema:
    """The schema of what a key may hold beside null; of several the list, else nothing that is known."""
    choices = [one for one in schema.get("anyOf", ()) if one.get("type") != "null"]
    if not choices:
        return schema
    listed = [one for one in choices if one.get("type") == "array"]
    return choices[0] if len(choices) == 1 else (listed[0] if len(listed) == 1 and len(choices) == 2 else {})


def _is_pair(schema: Schema) -> bool:
    """Whether it is a list of two numbers."""
    two = schema.get("minItems") == schema.get("maxItems") == 2
    return schema.get("type") == "array" and two and schema["items"].get("type") == "number"


def _of_numbers(schema: Schema) -> bool:
    """Whether it is a table of names with a number each."""
    named: list[Any] = list(schema.get("patternProperties", {}).values())
    each = schema.get("additionalProperties") or next(iter(named), None)
    return isinstance(each, Mapping) and each.get("type") == "number"
