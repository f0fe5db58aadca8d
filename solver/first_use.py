"""Public names of a package that are loaded on first use, so that importing the package costs nothing.

The names stand once, in the stub that type checkers and editors read: ``from .module import Name as Name``.
(The library lazy_loader does the same by `ast`, whose import alone takes 8 ms of every start.)
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from functools import cache, wraps
from importlib import import_module
from types import FunctionType
from typing import Any, ParamSpec, TypeVar

from solver.lab import LAB, is_there

_PACKAGES = ("solver", "optim")

_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")


def names_of(package: str, file: str) -> dict[str, str]:
    """The module of every public name of a package or module, from the stub beside it.

    What another package makes public is that package's: where it has a name no more, nobody has.
    """
    found = names_in(f"{file.rpartition('.')[0]}.pyi", package)
    return {name: home for name, home in found.items() if home not in _PACKAGES or name in _passed_on(home)}


@cache
def _passed_on(package: str) -> Mapping[str, str]:
    beside = os.path.dirname(os.path.dirname(__file__))
    return names_in(os.path.join(beside, package, "__init__.pyi"), package)


def names_in(file: str, package: str) -> dict[str, str]:
    """The module of every name that a file of such statements passes on; the file itself is not imported."""
    with open(file, encoding="utf-8") as stub:
        statements = [part.partition(" import ") for part in f"\n{stub.read()}".split("\nfrom ")[1:]]
    return {
        name.split()[0]: f"{package}{module}" if module.startswith(".") else module
        for module, _, names in statements
        if is_there(module)
        for name in names.partition(")")[0].strip("( \n").split(",")
        if name.strip()
    }


def on_demand(place: str) -> Any:
    """Load what stands at a place, ``module:name``; ImportError or AttributeError where nothing does."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def on_first_use(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package, of the module of every name."""

    def load(name: str) -> object:
        if name not in homes:
            known = sys.modules[package]  # what Python reads to ask "Did you mean …?"
            raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name, obj=known)
        if name in _OF_KERNELS and (first := _first_call(package, name)):
            return first
        value = getattr(import_module(homes[name]), name)
        if homes[name].startswith((f"{package}.", LAB)):  # not what another package has made public already
            value = _of_a_scene(value, package)
        setattr(sys.modules[package], name, value)
        return value

    return load, lambda: sorted({*vars(sys.modules[package]), *homes}), sorted(homes)


_OF_KERNELS = ("solve", "sweep", "design")  # what may begin before kernels are compiled


def _first_call(package: str, name: str) -> Callable[..., object] | None:
    """What stands for a function while nothing is compiled: it prepares kernels for what it is asked."""
    if os.environ.get("STICKSLIP_KERNELS") or "solver.jit.way" in sys.modules:
        return None
    compiler_process = import_module("solver.jit.compiler_process")
    if not compiler_process.is_open():
        return None

    def asked(scene: object, *args: object, **kwargs: object) -> object:
        scene = _scene_of(scene)
        compiler_process.prepare(lambda: compiler_process.cost(name, scene, kwargs))
        value: Callable[..., object] = getattr(sys.modules[package], name)
        return value(scene, *args, **kwargs)

    asked.__name__, asked.__module__ = name, package
    return asked


def _of_a_scene(value: object, package: str) -> object:
    """Return a public function of a scene such that its name or file does as well; others as they are.

    One that can be stopped ends with what it has so far at Ctrl-C, if nobody else stops it.
    """
    if not isinstance(value, FunctionType):
        return value
    inner = value
    while isinstance(known := getattr(inner, "__wrapped__", None), FunctionType):
        inner = known
    code = inner.__code__
    if not code.co_argcount or code.co_varnames[0] != "scene":
        return value
    names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    stops = "should_stop" in names[code.co_argcount :]

    @wraps(value)
    def asked(*args: object, **kwargs: object) -> object:
        if args:
            args = (_scene_of(args[0]), *args[1:])
        elif "scene" in kwargs:
            kwargs["scene"] = _scene_of(kwargs["scene"])
        try:
            if not stops or "should_stop" in kwargs:
                return value(*args, **kwargs)
            with import_module("solver.results.watch").stopped_by_interrupt() as should_stop:
                return value(*args, should_stop=should_stop, **kwargs)
        except TypeError as error:
            wrong = next((key for key in kwargs if str(error).endswith(f"keyword argument {key!r}")), None)
            if wrong is None:
                raise
            hint = import_module("solver.wording").nearest(wrong, names)
            raise TypeError(f"{error}{hint}") from None

    asked.__module__ = package  # where it is found by its name, as pickle does
    return asked


def renamed(**words: str) -> Callable[[Callable[_Given, _Found]], Callable[_Given, _Found]]:
    """Let a function take keywords as they were called before, with a warning: ``renamed(low="start")``."""

    def decorate(function: Callable[_Given, _Found]) -> Callable[_Given, _Found]:
        @wraps(function)
        def called(*args: _Given.args, **kwargs: _Given.kwargs) -> _Found:
            for old in words.keys() & kwargs.keys():
                import warnings

                behind = sys._getframe(1).f_code.co_filename == __file__  # a public function stands for it
                told = f"`{old}` is `{words[old]}` now; the old word goes with 0.2"
                warnings.warn(told, DeprecationWarning, stacklevel=3 if behind else 2)
                kwargs[words[old]] = kwargs.pop(old)
            return function(*args, **kwargs)

        return called

    return decorate


def _scene_of(given: object) -> object:
    """Return a scene as it is, or that of a name or file."""
    scenes = import_module("solver.scene.scene")
    if isinstance(given, str | os.PathLike):
        return scenes.load_scene(given)
    if not isinstance(given, scenes.Scene):
        wanted = "must be a Scene (`Scene.from_dict` makes one of a table), a shipped one's name or a file"
        raise import_module("solver.errors").SettingError("scene", type(given).__name__, wanted)
    return given
