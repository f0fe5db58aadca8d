"""Laws, terms, formats, criteria and the like from outside the package, named by the environment.

``STICKSLIP_EXTENSIONS='["module:NAME", …]'`` names objects that every process imports, the command, the
service and its workers alike; each registry takes those of its own kind.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Iterable
from functools import cache
from importlib import import_module
from typing import Generic, TypeVar

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


class Kinds(Generic[T]):
    """The classes of one sort by their words: those of the package, then those from outside.

    Parameters
    ----------
    base : what they are made from.
    attribute : where each has its word.
    noun : what messages call one.
    shipped : gives those of the package.
    """

    def __init__(
        self, base: type[T], attribute: str, noun: str, shipped: Callable[[], Iterable[type[T]]]
    ) -> None:
        self._base, self._attribute, self._noun, self._shipped = base, attribute, noun, shipped
        self.added: list[type[T]] = []

    def known(self) -> dict[str, type[T]]:
        """Every class by its word.

        Raises
        ------
        SettingError
            One from outside has the word of another.
        """
        found: dict[str, type[T]] = {}
        for one in (*self._shipped(), *extension_classes(self._base), *self.added):
            word = self._word(one)
            if found.setdefault(word, one) is not one:
                wanted = f"must be the word of one {self._noun}, not of {one.__name__} too"
                raise SettingError(self._attribute.lower(), word, wanted)
        return found

    def register(self, one: type[T]) -> type[T]:
        """Add one in this process; what starts processes of its own, as the service does, needs extensions.

        Raises
        ------
        ValueError
            There is one of this word.
        """
        if self._word(one) in self.known():
            raise ValueError(f"there is a {self._noun} {self._word(one)!r} already")
        self.added.append(one)
        _changed()
        return one

    def unregister(self, one: type[T]) -> None:
        """Take back what `register` added."""
        self.added.remove(one)
        _changed()

    def _word(self, one: type[T]) -> str:
        word: str = getattr(one, self._attribute)
        return word


_listeners: list[Callable[[], object]] = []


def on_change(listener: Callable[[], object]) -> None:
    """Have a function called whenever scenes may hold something else, to make anew what it made of it."""
    _listeners.append(listener)


def _changed() -> None:
    for listener in _listeners:
        listener()
