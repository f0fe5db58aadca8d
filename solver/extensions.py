"""Laws, terms, formats, criteria and the like from outside the package, named by the environment.

``STICKSLIP_EXTENSIONS='["module:NAME", …]'`` names objects that every process imports, the command, the
service and its workers alike; each registry takes those of its own kind.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from importlib import import_module
from typing import Any, Generic, TypeVar

from solver.errors import SettingError
from solver.first_use import on_demand
from solver.lab import is_there

VARIABLE = "STICKSLIP_EXTENSIONS"
T = TypeVar("T")


class ExtensionError(SettingError):
    """The variable does not name objects that can be imported."""

    def __init__(self, value: str, reason: str = "") -> None:
        super().__init__(VARIABLE, value, f'must be a list such as ["module:NAME"]{reason}')


def extensions(base: type) -> tuple[Any, ...]:
    """The objects and classes made from a class that the environment names, in order.

    Raises
    ------
    ExtensionError
        The variable is no list of ``module:NAME``, or there is no such module or name.
    """
    named = _named(os.environ.get(VARIABLE, ""))
    return tuple(
        one for one in named if isinstance(one, base) or (isinstance(one, type) and issubclass(one, base))
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
    try:
        return on_demand(name)
    except (ImportError, AttributeError) as error:
        raise ExtensionError(name, f" that can be imported ({error})") from error


class Kinds(Generic[T]):
    """What there is of one sort, classes or objects: those of the package, then those from outside.

    Parameters
    ----------
    base : what they are, or are made from.
    noun : what messages call one.
    words : those of one; no other has any of them.
    modules : those of the package, loaded on first use: what only lists endings needs no SciPy.
    name : where a module has its own, one or a tuple of them.
    """

    def __init__(
        self, base: type, noun: str, words: Callable[[T], Iterable[str]], modules: Sequence[str], name: str
    ) -> None:
        self._base, self._noun, self._words, self._modules, self._name = base, noun, words, modules, name
        self._shipped: tuple[T, ...] | None = None
        self.added: list[T] = []

    def every(self) -> tuple[T, ...]:
        """Every one, in order.

        Raises
        ------
        SettingError
            One from outside has the word of another.
        """
        if self._shipped is None:
            found = [
                getattr(import_module(module), self._name) for module in self._modules if is_there(module)
            ]
            self._shipped = tuple(one for own in found for one in (own if isinstance(own, tuple) else (own,)))
        outside = (*extensions(self._base), *self.added)
        taken = {word: one for one in self._shipped for word in self._words(one)} if outside else {}
        for one in outside:
            for word in self._words(one):
                if taken.setdefault(word, one) is not one:
                    called = getattr(one, "__name__", getattr(one, "name", one))
                    wanted = f"must be the word of one {self._noun}, not of {called} too"
                    raise SettingError(self._noun, word, wanted)
        return (*self._shipped, *outside)

    def known(self) -> dict[str, T]:
        """Every one by its words; errors as of `every`."""
        return {word: one for one in self.every() for word in self._words(one)}

    def register(self, one: T) -> T:
        """Add one in this process; what starts processes of its own, as the service does, needs extensions.

        What was made before, bodies and options of a command, does not know it.

        Raises
        ------
        ValueError
            One of its words is taken.
        """
        known = self.known()
        if twice := [word for word in self._words(one) if word in known]:
            raise ValueError(f"there is a {self._noun} {', '.join(map(repr, twice))} already")
        self.added.append(one)
        _changed()
        return one

    def unregister(self, one: T) -> None:
        """Take back what `register` added."""
        self.added.remove(one)
        _changed()


_listeners: list[Callable[[], object]] = []


def on_change(listener: Callable[[], object]) -> None:
    """Have a function called whenever scenes may hold something else, to make anew what it made of it."""
    _listeners.append(listener)


def _changed() -> None:
    for listener in _listeners:
        listener()
