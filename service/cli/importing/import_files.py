"""The files of `stickslip import`, the rows of the DOFs, and the text of the scene that is written."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from service.cli.options.inputs import relative
from service.errors import InputError

if TYPE_CHECKING:
    from service.cli.importing.import_reduction import ImportOptions
    from solver.matrices.load_set import MatrixSet


MOST_UNNAMED = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class Sources:
    """What a scene is made of."""

    roles: Annotated[dict[str, Path], "File of each of M, K and C, or of ``modes``."]
    mapping: Annotated[Path | None, "File of the labels of the rows."]
    units: Annotated[str, "Of the files."]
    parts: Annotated[
        dict[str, Path | None],
        "File of each part of the sector that mistuning may scale; None for K and M of the whole.",
    ] = field(default_factory=dict)

    def table(self, target: Path) -> dict[str, object]:
        """The table [structure] of a scene at `target` that refers to the files."""
        table: dict[str, object] = {"kind": "matrices"}
        table |= {role: relative(path, target) for role, path in self.roles.items()}
        if self.mapping is not None:
            table["mapping"] = relative(self.mapping, target)
        if self.units != "SI":
            table["units"] = self.units
        return table


def sources(asked: ImportOptions) -> Sources:
    """Sort the files given by what they are."""
    from solver.matrices.load_set import MAPPING, MatrixFileError, sorted_files
    from solver.matrices.values import UNITS

    if asked.units not in UNITS:
        raise InputError(
            f"`--units` must be one of {', '.join(UNITS)} (mm: mm, t, N, s; in: in, lbf s²/in, lbf, s), "
            f"got {asked.units!r}"
        )
    given = [path for name in asked.files if (path := existing_file("FILES", name)) is not None]
    mapping = existing_file("FILES", asked.mapping or None)
    try:
        roles = sorted_files(given, mapping)
    except MatrixFileError as error:
        raise InputError(f"`FILES`: {error}") from error
    rows = roles.pop(MAPPING, None)
    return Sources(roles=roles, mapping=rows, units=asked.units, parts=_parts(asked.mistune))


def _parts(texts: Sequence[str] | None) -> dict[str, Path | None]:
    """What --mistune names, with the file of each."""
    from solver.matrices.sectors.sector_parts import WHOLE, check_part_names

    found: dict[str, Path | None] = {}
    for text in texts or ():
        name, equals, file = text.partition("=")
        if (name in WHOLE) == bool(equals) or (equals and not Path(file).is_file()):
            got = f"there is no file {file!r}" if equals and name not in WHOLE else f"got {text!r}"
            raise InputError(
                f"`--mistune` must be K, M, or the name of a part and its file, NAME=FILE: {got}"
            )
        if name in found:
            raise InputError(f"`--mistune` names {name!r} twice; keep one")
        try:
            check_part_names([] if name in WHOLE else [name])
        except ValueError as error:
            raise InputError(f"`--mistune`: {error}") from error
        found[name] = Path(file) if equals else None
    return found


def read_sources(found: Sources, deck: Path | None) -> MatrixSet | None:
    """The matrices in SI units, along the global axes whatever frames the deck has; None for modes."""
    from solver.matrices.load_set import PART, MatrixFileError, in_global, in_si, read_set
    from solver.matrices.readers.numbers_in_text import FormatError
    from solver.matrices.sectors.loading import read_deck

    if "modes" in found.roles:
        return None
    parts = {PART + name: path for name, path in found.parts.items() if path is not None}
    try:
        given = in_si(read_set(found.roles | parts, found.mapping), found.units)
    except MatrixFileError as error:
        raise InputError(f"`FILES`: {error}") from error
    try:
        return in_global(given, None if deck is None else read_deck(deck, elements=True))
    except (FormatError, OSError, ValueError) as error:
        raise InputError(f"`--nodes`: {error}") from error


def existing_file(option: str, text: str | None) -> Path | None:
    """A file that is to be read; None if none was named.

    InputError if there is no such file.
    """
    if text is not None and not Path(text).is_file():
        raise InputError(f"`{option}`: there is no file {text!r}")
    return None if text is None else Path(text)


def dof_table(
    texts: Sequence[str] | None, found: Sources, given: MatrixSet | None, *, patches: bool = False
) -> dict[str, int | str]:
    """Names of DOFs, each with its row or label; all rows of a small model if none is named.

    `patches` says whether patches name DOFs too, so that none need be named here.
    """
    if not texts:
        return {} if patches else _all_rows(found, given)
    table: dict[str, int | str] = {}
    for text in texts:
        name, row = _dof(text)
        if name in table:
            raise InputError(f"`--dof` names {name!r} twice; keep one")
        table[name] = row
    return table


def _dof(text: str) -> tuple[str, int | str]:
    from solver.matrices.readers.numbers_in_text import label

    name, equals, row = text.rpartition("=")
    if equals and name and re.fullmatch(r"[0-9]{1,12}", row):
        return name, int(row)
    wanted = label(row)
    if wanted is None or bool(equals) != bool(name):
        raise InputError(
            "`--dof` takes NAME=ROW with a row from 0 or a label, for example tip=399 or tip=1203.UX, "
            f"got {text!r}"
        )
    return name or str(wanted).replace(".", "-"), str(wanted)


def _all_rows(found: Sources, given: MatrixSet | None) -> dict[str, int | str]:
    from solver.matrices.load_set import MatrixFileError, read_modes

    if given is not None:
        size = given.size
    else:
        try:
            size = read_modes(found.roles["modes"]).size
        except MatrixFileError as error:
            raise InputError(f"`FILES`: {error}") from error
    if size > MOST_UNNAMED:
        example = "tip=399" if given is None or given.labels is None else f"tip={given.labels[-1]}"
        raise InputError(f"`--dof` is needed: the model has {size} rows, name those that you use ({example})")
    if given is not None and given.labels is not None:
        return {str(label).replace(".", "-"): str(label) for label in given.labels}
    return {f"x{row}": row for row in range(size)}


def rows_of(table: Mapping[str, int | str], given: MatrixSet) -> dict[str, int]:
    """The rows that a table of DOFs names."""
    from solver.matrices.readers.numbers_in_text import label

    rows: dict[str, int] = {}
    for name, row in table.items():
        wanted = label(row) if isinstance(row, str) else None
        at = row if isinstance(row, int) else None if wanted is None else given.row(wanted)
        if at is None:
            raise InputError(f"`--dof`: {name!r} {given.no_row(str(row))}")
        rows[name] = at
    return rows


def contacts(texts: Sequence[str] | None) -> list[dict[str, Any]]:
    """The tables [[contacts]] of texts such as ``shroud=tip:ground,kt=1e6,mu=0.3,N0=100``.

    InputError for a text that is none.
    """
    example = "shroud=tip:ground,kt=1e6,mu=0.3,N0=100"
    return [
        {"name": name, "between": list(ends), **values}
        for name, ends, values in (split("--contact", text, example) for text in texts or ())
    ]


def excitation(texts: Sequence[str] | None, excite: str | None, first: str) -> dict[str, Any]:
    """What the table [excitation] says of place and amplitude.

    InputError for a text that is none, a DOF named twice, or both options.

    Parameters
    ----------
    texts : such as ``tip=20``, each a DOF and its force [N].
    excite : the DOF of `--excite`.
    first : the DOF of the force if nothing is said.
    """
    if not texts:
        return {"dof": excite or first, "amplitude": 1.0}
    if excite is not None:
        raise InputError("`--excite` and `--force` exclude each other: `--force` names the DOF too")
    found: dict[str, float] = {}
    for text in texts:
        name, equals, number = text.rpartition("=")
        value = _number(number)
        if not (name and equals and isinstance(value, float)):
            raise InputError(f"`--force` takes DOF=NEWTON, for example tip=20, got {text!r}")
        if name in found:
            raise InputError(f"`--force` names {name!r} twice; keep one")
        found[name] = value
    if len(found) == 1:
        ((name, amplitude),) = found.items()
        return {"dof": name, "amplitude": amplitude}
    return {"forces": found, "amplitude": 1.0}


def split(option: str, text: str, example: str) -> tuple[str, tuple[str, str], dict[str, Any]]:
    """Name, ends and values of a text ``NAME=A:B,key=value,...`` (InputError for a text that is none)."""
    head, *rest = text.split(",")
    name, equals, joined = head.partition("=")
    ends = joined.split(":")
    pairs = [part.partition("=") for part in rest]
    if not (name and equals and len(ends) == 2 and all(ends)) or not all(k and e and v for k, e, v in pairs):
        raise InputError(f"`{option}` takes NAME=A:B,KEY=VALUE,…, for example {example}, got {text!r}")
    keys = [key for key, _, _ in pairs]
    if len(set(keys)) < len(keys):
        raise InputError(f"`{option}` {name!r} names a key twice: {', '.join(keys)}")
    return name, (ends[0], ends[1]), {key: _number(value) for key, _, value in pairs}


def _number(text: str) -> float | bool | str:
    if text in ("true", "false"):
        return text == "true"
    try:
        value = float(text)
    except ValueError:
        return text
    return value if math.isfinite(value) else text


_CONTACT = """
# A contact joins two DOFs, or one and "ground"; take away the # and give your values.
# [[contacts]]
# name = "damper"
# between = ["{dof}", "ground"]
# kt = 1e6     # N/m
# mu = 0.3
# N0 = 100.0   # N
"""
_DAMPING = "# The files hold no damping; this is that of every mode. Or: stiffness_proportional_damping [s]"


def band(start: float | None, stop: float | None, frequencies: Sequence[float]) -> list[float]:
    """The band asked for; around the first elastic mode if left out."""
    elastic = [f for f in frequencies if f > 1e-5 * frequencies[-1]] or [1.0]
    low = 0.5 * elastic[0] if start is None else start
    high = 2.0 * max(elastic[0], low) if stop is None else stop
    if not 0.0 < low < high < math.inf:
        raise InputError(
            f"`--from` and `--to` must be frequencies with 0 < from < to, got {low:g} and {high:g}"
        )
    return [float(f"{low:.6g}"), float(f"{high:.6g}")]


def _value(value: object) -> str:
    """A value as TOML on one line, lists of tables on a line each."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(key)} = {_value(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + "".join(f"  {_value(one)},\n" for one in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def toml(raw: Mapping[str, Any], remarks: Sequence[str] = ()) -> str:
    """The scene as a file; JSON texts are TOML texts."""
    structure, observe, force = raw["structure"], raw["observe"], raw["excitation"]
    lines = [f"name = {json.dumps(raw['name'])}", "", *(f"# {remark}" for remark in remarks), "[structure]"]
    for key, value in structure.items():
        if key not in ("dofs", "cyclic"):
            lines += [_DAMPING] * (key == "damping_ratio")
            lines.append(f"{key} = {json.dumps(value, ensure_ascii=False)}")
    if "cyclic" in structure:
        lines += ["", "[structure.cyclic]"]
        lines += [f"{key} = {json.dumps(value)}" for key, value in structure["cyclic"].items()]
    lines += ["", "[structure.dofs] # rows of the matrices, zero-based, or node and component"]
    lines += [f"{json.dumps(name)} = {json.dumps(row)}" for name, row in structure["dofs"].items()]
    if not (raw.get("contacts") or raw.get("dampers")):
        used = (force.get("dof"), observe["dof"])
        rubbing = next((name for name in structure["dofs"] if name not in used), observe["dof"])
        lines.append(_CONTACT.format(dof=rubbing).rstrip("\n"))
    for key in ("nodes", "contacts", "dampers"):
        for row in raw.get(key, ()):
            lines += ["", f"[[{key}]]", *(f"{name} = {_value(value)}" for name, value in row.items())]
    lines += ["", "[excitation]", *(f"{key} = {_value(value)}" for key, value in force.items())]
    lines += ["", "[observe]"]
    lines += [f"dof = {json.dumps(observe['dof'])}", f"band = {json.dumps(observe['band'])} # Hz", ""]
    return "\n".join(lines)
