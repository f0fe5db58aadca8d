"""The modules of the packages, those of the lab among them."""

from collections.abc import Iterator
from importlib import import_module
from pkgutil import walk_packages
from types import ModuleType


def every_module(*packages: ModuleType) -> Iterator[ModuleType]:
    """Import and give each module below some packages; tests that stand there are left out."""
    for package in packages:
        for found in walk_packages(package.__path__, f"{package.__name__}."):
            parts = found.name.split(".")
            if "tests" not in parts:
                yield import_module(found.name)
