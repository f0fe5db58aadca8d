"""The registry of contact laws.

To add a law, write a module with `LAW` and name it in `SHIPPED`; one from outside the package is named by
`solver.extensions`, or registered for one process.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module

from solver.contacts.laws.base import AnyContact
from solver.errors import SettingError
from solver.extensions import extension_classes

SHIPPED = (
    "solver.contacts.laws.coulomb",
    "solver.contacts.laws.elastic_normal",
    "solver.contacts.laws.coulomb_2d",
    "solver.contacts.laws.coulomb_3d",
    "solver.contacts.laws.gap",
    "solver.contacts.laws.polynomial",
    "solver.contacts.laws.history.iwan",
    "solver.contacts.laws.history.bouc_wen",
    "solver.contacts.laws.history.dahl",
    "solver.contacts.laws.history.coulomb_tanh",
)
_added: list[type[AnyContact]] = []
_listeners: list[Callable[[], object]] = []


def laws() -> dict[str, type[AnyContact]]:
    """Every law by its word: those that come with the package, then those from outside.

    Raises
    ------
    SettingError
        A law from outside has the word of another.
    """
    found: dict[str, type[AnyContact]] = {}
    for law in (*_shipped(), *extension_classes(AnyContact), *_added):
        if found.setdefault(law.LAW, law) is not law:
            raise SettingError("law", law.LAW, f"must be the word of one law, not of {law.__name__} too")
    return found


DEFAULT = "coulomb"
"""The law of a contact that names none."""


@cache
def _shipped() -> tuple[type[AnyContact], ...]:
    return tuple(import_module(module).LAW for module in SHIPPED)


def register(law: type[AnyContact]) -> type[AnyContact]:
    """Add a law in this process; what starts processes of its own, as the service does, needs extensions.

    Raises
    ------
    ValueError
        There is one of this name.
    """
    if law.LAW in laws():
        raise ValueError(f"there is a law {law.LAW!r} already")
    _added.append(law)
    announce()
    return law


def unregister(law: type[AnyContact]) -> None:
    """Take back what `register` added."""
    _added.remove(law)
    announce()


def on_change(listener: Callable[[], object]) -> None:
    """Have a function called whenever scenes may hold something else, to make anew what it made of it."""
    _listeners.append(listener)


def announce() -> None:
    """Tell whoever listens that scenes may hold something else: a law or a kind of coupling."""
    for listener in _listeners:
        listener()
