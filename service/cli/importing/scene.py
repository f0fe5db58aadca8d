"""The scene that `stickslip import` writes: its table, its band, its text."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from service.errors import InputError

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
