"""Files that follow from the code: ``python docs/docs_tables.py`` brings them up to date.

Each table of the docs stands between two marks, ``<!-- NAME: begin -->`` and ``<!-- NAME: end -->``; a source
is written as a whole.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Container, Iterable, Mapping
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from optim.criteria.criterion import criteria, limit_keys
from optim.criteria.key import Key, Option
from optim.identification.data.measured import data_kinds
from optim.identification.data.measured_table import known_units
from optim.identification.readers.data_readers import data_formats
from optim.problem.checks import MethodWord, ScalingWord
from optim.problem.problem_keys import OPTIONS, ROBUST, CaseRequest, DesignKeys, FrontKeys, options
from service.jobs.common.scene_requests import HarmonicRequest, SceneRequest
from service.jobs.kind_registry import ABOUT_THE_JOB, JobKind, JobRequest, Registry
from service.jobs.kinds import SHIPPED
from service.jobs.studies.design_study import Design
from service.jobs.studies.pareto_study import Pareto
from service.settings.settings import ClientLimits, Settings
from solver.contacts.laws.law_registry import DEFAULT, laws
from solver.matrices.readers.reader_registry import readers

_HEAD = '''"""The keys of a design problem as keyword arguments, for type checkers: ``**problem: Unpack[…]``.

Written by ``python docs/docs_tables.py`` from `problem_keys`; not to be edited. A key of a
criterion from outside the package is none of these: pass it in a ``**dict[str, Any]``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict

from optim.problem.checks import Method, MethodWord, ScalingWord
'''
_INDENT, _WIDTH = " " * 4, 110
_NUMBERS = {"number": "float", "integer": "int", "boolean": "bool", "string": "str", "null": "None"}
_WORDS = {get_args(MethodWord): "MethodWord | Method", get_args(ScalingWord): "ScalingWord"}


def keyword_source() -> str:
    """Return the text of the module."""
    design, front = _keys_of(DesignKeys, (OPTIONS, *ROBUST)), _keys_of(FrontKeys, ("points",))
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


def _keys_of(model: type[BaseModel], without: Container[str]) -> dict[str, str]:
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
        return _WORDS.get(words) or f"Literal[{', '.join(map(json.dumps, words))}]"
    if schema.get("type") == "array":
        return f"Sequence[{_type(schema['items'])}]"
    if "$ref" in schema or schema["type"] == "object":
        values = [schema.get("additionalProperties"), *schema.get("patternProperties", {}).values()]
        known = next((one for one in values if isinstance(one, Mapping)), None)
        return f"Mapping[str, {'object' if known is None else _type(known)}]"
    return _NUMBERS[schema["type"]]


_WRITTEN = {"scene": "`SCENE`", "set": "`--set PATH=VALUE`"}
_ON_THE_MACHINE = {"workers": "processors"}
_GIVES = {
    "matrix": "one matrix", "matrices": "one matrix or several", "modes": "modes", "labels": "names of rows",
    "nodes": "nodes",
}  # fmt: skip
_OF_ALL = (HarmonicRequest, SceneRequest, JobRequest)
_WAYS = {
    "goes on": "goes on behind the last point that was kept; the result is the one it would have been, bit "
    "for bit",
    "parts": "computes the parts that are missing; the result is the same bit for bit",
    "anew": "begins anew",
}


def _table(heads: str, rows: Iterable[Iterable[str]]) -> str:
    """A table of Markdown; the heads stand between bars."""
    lines = [f"| {heads} |", f"|{'---|' * (heads.count('|') + 1)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def _quoted(words: Iterable[str]) -> str:
    return ", ".join(f"`{word}`" for word in words)


def criteria_table() -> str:
    """Every criterion with its weight and the keys of its limit."""
    rows = []
    for one in criteria():
        better = "" if one.smaller_is_better else ", larger is better"
        limits = "<br>".join(f"`{key.name}`: {key.help} {_option(key)}" for key in one.keys)
        weight = f"`{one.weight}`{one.per_unit}" if one.weight else ""
        rows.append((f"**{one.name}** [{one.unit}]{better}: {one.help}", weight, limits))
    return _table("criterion | minimised by `weights` | limited by", rows)


def problem_table() -> str:
    """Every key of a design problem but those that limit a criterion."""
    fields = {**Design.model_fields, **Pareto.model_fields}
    keys = options(Design) | options(Pareto)
    apart = {*ABOUT_THE_JOB, *(key.name for key in limit_keys())}
    rows = (
        (f"`{name}`", _meaning(name, field), _WRITTEN.get(name) or _option(keys.get(name)))
        for name, field in fields.items()
        if name not in apart
    )
    return _table("key | meaning | option of the command", rows)


def _meaning(name: str, field: FieldInfo) -> str:
    if name != "cases":
        return str(field.description)
    cases = (f"`{key}`: {one.description}" for key, one in CaseRequest.model_fields.items())
    return f"{field.description} A list of tables with any of<br>{'<br>'.join(cases)}"


def _option(option: Key | Option | None) -> str:
    return "" if option is None else f"`{f'{option.flag} {option.metavar}'.strip()}`".replace("|", "\\|")


def data_columns_table() -> str:
    """Every kind of measured data with its columns, their units and the words of its head."""
    rows: list[tuple[str, ...]] = []
    first: dict[tuple[str, ...], str] = {}  # the column in whose row units are written out
    for kind in data_kinds():
        for column in kind.columns:
            units = tuple(known_units(column.dimension))
            named = first.setdefault(units, column.name)
            told = f"as `{named}`" if named != column.name and len(units) > 1 else ", ".join(units)
            rows.append((f"`{kind.name}`", f"`{column.name}`", told, column.help))
        rows += ((f"`{kind.name}`", f"head: `{word}`", "", text) for word, text in kind.words.items())
    return _table("kind | column | units, the first if none is named | what it is", rows)


def data_formats_table() -> str:
    """Every format of measured data with its endings."""
    rows = ((one.name, _quoted(one.suffixes), one.help) for one in data_formats())
    return _table("format | files end in | how", rows)


def laws_table() -> str:
    """Every contact law with its force and parameters."""
    rows = (
        (f"`{word}`{' (default)' * (word == DEFAULT)}", law.FORCE, _quoted(law.PARAMETERS))
        for word, law in laws().items()
    )
    return _table("`law` | Force | Parameters that can be continued in", rows)


def formats_table() -> str:
    """Every format of matrices with its endings, what it gives, and the word of an upload."""
    rows = (
        (
            _quoted(one.suffixes), one.help, ", ".join(_GIVES[kind] for kind in one.gives),
            _quoted((one.word, *one.media)),
        )
        for one in readers()
    )  # fmt: skip
    return _table("files end in | format | holds | `?format=`", rows)


def settings_table() -> str:
    """The settings with their defaults and what they mean."""
    fields = Settings.model_fields
    # What is inherited comes first there, and last here.
    ordered = sorted(fields, key=lambda name: name in ClientLimits.model_fields)
    return _table("variable | default | ", (_setting(name, fields[name]) for name in ordered))


def _setting(name: str, field: FieldInfo) -> tuple[str, str, str]:
    default = field.get_default(call_default_factory=True)
    shown = str(default).lower() if isinstance(default, bool) else str(default)
    said = _ON_THE_MACHINE.get(name) or ("unset" if default is None else f"`{shown}`")
    return f"`STICKSLIP_{name.upper()}`", said, (field.description or "").replace("|", "\\|")


def kinds_table(registry: Registry) -> str:
    """What each kind takes, computes and stores, as a table of Markdown."""
    rows = (
        (f"`{kind.name}`", _keys(kind), kind.view.result or kind.summary, kind.view.sweeps)
        for kind in registry
    )
    return _table("kind | keys of its own, those needed in bold | result | sweeps stored", rows)


def interrupted_table(registry: Registry) -> str:
    """What becomes of a job of each kind whose worker died, as a table of Markdown."""
    names = {way: _quoted(kind.name for kind in registry if _way(kind) == way) for way in _WAYS}
    return _table(
        "kind | what the next attempt does", ((names[way], _WAYS[way]) for way in _WAYS if names[way])
    )


def _keys(kind: JobKind) -> str:
    """The keys that not every kind has, with those that must be given in bold."""
    if kind.view.keys:
        return kind.view.keys
    shared = next(base for base in _OF_ALL if issubclass(kind.request, base))
    own = [
        (field.alias or name, field.is_required())
        for name, field in kind.request.model_fields.items()
        if shared.model_fields.get(name) is None or shared.model_fields[name].annotation != field.annotation
    ]
    return ", ".join(f"**`{key}`**" if needed else f"`{key}`" for key, needed in own)


def _way(kind: JobKind) -> str:
    if kind.run_on is not None:
        return "goes on"
    return "anew" if kind.parts is None else "parts"


def tables_of_kinds(registry: Registry) -> Mapping[str, Callable[[], str]]:
    """The tables of docs/service.md for some kinds, by their marks."""
    return {"kinds": partial(kinds_table, registry), "interrupted": partial(interrupted_table, registry)}


TABLES: Mapping[str, Mapping[str, Callable[[], str]]] = {
    "design.md": {"keys": problem_table, "criteria": criteria_table},
    "service.md": tables_of_kinds(SHIPPED),
    "identification.md": {"columns": data_columns_table, "formats": data_formats_table},
    "laws.md": {"laws": laws_table},
    "matrices.md": {"formats": formats_table},
    "operations.md": {"settings": settings_table},
}
"""Page of docs/, name of the mark, table."""
SOURCES: Mapping[str, Callable[[], str]] = {"optim/problem/keyword_types.py": keyword_source}
"""File, its text."""


def placed(text: str, name: str, table: str) -> str:
    """A page with a table between its marks (ValueError if one is not there)."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, rest = text.split(begin)
    _, after = rest.split(end)
    return f"{before}{begin}\n\n{table}\n{end}{after}"


def with_tables(text: str, tables: Mapping[str, Callable[[], str]]) -> str:
    """A page with its tables as they are now (ValueError if a mark is not there)."""
    for name, table in tables.items():
        text = placed(text, name, table())
    return text


def main() -> None:
    """Bring tables and sources up to date."""
    for name, tables in TABLES.items():
        page = Path("docs") / name
        page.write_text(with_tables(page.read_text(encoding="utf-8"), tables), encoding="utf-8")
    for file, source in SOURCES.items():
        Path(file).write_text(source(), encoding="utf-8")


if __name__ == "__main__":
    main()
