"""`stickslip import --contact --force`: the parts of a scene beside its structure."""

from __future__ import annotations

import math
from collections.abc import Sequence
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
