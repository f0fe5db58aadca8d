"""The scene that `stickslip import` writes: contacts and forces, its band, its text."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from service.errors import InputError


def contacts(texts: Sequence[str] | None) -> list[dict[str, Any]]:
    """The tables [[contacts]] of texts such as ``shroud=tip:ground,kt=1e6,mu=0.3,N0=100``.

    Raises
    ------
    InputError
        A text that is none.
    """
    example = "shroud=tip:ground,kt=1e6,mu=0.3,N0=100"
    return [
        {"name": name, "between": list(ends), **values}
        for name, ends, values in (split("--contact", text, example) for text in texts or ())
    ]


def excitation(texts: Sequence[str] | None, excite: str | None, first: str) -> dict[str, Any]:
    """What the table [excitation] says of place and amplitude.

    Parameters
    ----------
    texts : such as ``tip=20``, each a DOF and its force [N].
    excite : the DOF of `--excite`.
    first : the DOF of the force if nothing is said.

    Raises
    ------
    InputError
        A text that is none, a DOF named twice, or both options.
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
    """Name, ends and values of a text ``NAME=A:B,key=value,...``.

    Raises
    ------
    InputError
        A text that is none.
    """
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
