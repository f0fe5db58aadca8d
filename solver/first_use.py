"""Public names of a package that are loaded on first use, so that importing the package costs nothing.

The names stand once, in the stub that type checkers and editors read: ``from .module import Name as Name``.
(The library lazy_loader does the same by `ast`, whose import alone takes 8 ms of every start.)
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module


def names_of(package: str, file: str) -> dict[str, str]:
    """The module of every public name of a package, from the stub beside its ``__init__``."""
    return names_in(f"{file.rpartition('.')[0]}.pyi", package)


def names_in(file: str, package: str) -> dict[str, str]:
    """The module of every name that a file of such statements passes on; the file itself is not imported."""
    with open(file, encoding="utf-8") as stub:
        statements = [part.partition(" import ") for part in f"\n{stub.read()}".split("\nfrom ")[1:]]
    return {
        name.split()[0]: f"{package}{module}" if module.startswith(".") else module
        for module, _, names in statements
        for name in names.partition(")")[0].strip("( \n").split(",")
        if name.strip()
    }


def on_first_use(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package, of the module of every name."""

    def load(name: str) -> object:
        if name not in homes:
            known = sys.modules[package]  # what Python reads to ask "Did you mean …?"
            raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name, obj=known)
        value = getattr(import_module(homes[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return load, lambda: sorted({*vars(sys.modules[package]), *homes}), sorted(homes)
