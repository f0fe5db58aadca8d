"""Laws, formats, criteria and the like from outside the package, named by the environment.

``STICKSLIP_EXTENSIONS='["module:NAME", …]'`` names objects that every process imports, the command, the
service and its workers alike; each registry takes those of its own kind.
"""

from __future__ import annotations

import json
import os
import threading
from functools import cache
from importlib import import_module
from typing import TypeVar

from solver.errors import SettingError

VARIABLE = "STICKSLIP_EXTENSIONS"
T = TypeVar("T")


class ExtensionError(SettingError):
    """The variable does not name objects that can be imported."""

    def __init__(self, value: str, reason: str = "") -> None:
        super().__init__(VARIABLE, value, f'must be a list such as ["module:NAME"]{reason}')


def extensions(kind: type[T]) -> tuple[T, ...]:
    """The objects of a class that the environment names, in order.

    Raises
    ------
    ExtensionError
        The variable is no list of ``module:NAME``, or there is no such module or name.
    """
    return tuple(one for one in _named(os.environ.get(VARIABLE, "")) if isinstance(one, kind))


def extension_classes(kind: type[T]) -> tuple[type[T], ...]:
    """The classes made from a class that the environment names, in order; errors as of `extensions`."""
    return tuple(
        one for one in _named(os.environ.get(VARIABLE, "")) if isinstance(one, type) and issubclass(one, kind)
    )


_here = threading.local()  # whether this thread is importing them


def _named(text: str) -> tuple[object, ...]:
    # A module that registers what it defines asks for what there is while it is being imported itself.
    if not text.strip() or getattr(_here, "importing", False):
        return ()
    _here.importing = True
    try:
        return _read(text)
    finally:
        _here.importing = False


@cache
def _read(text: str) -> tuple[object, ...]:
    try:
        names = json.loads(text)
    except json.JSONDecodeError as error:
        raise ExtensionError(text[:200]) from error
    if not isinstance(names, list) or not all(isinstance(name, str) and ":" in name for name in names):
        raise ExtensionError(text[:200])
    return tuple(_imported(name) for name in names)


def _imported(name: str) -> object:
    module, _, attribute = name.partition(":")
    try:
        return getattr(import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise ExtensionError(name, f" that can be imported ({error})") from error
