"""From the words of the command line to values; every refusal names the option and quotes what was given."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from service.errors import InputError
from solver.errors import Place, SettingError
from solver.results import units
from solver.results.told import UNIT
from solver.scene.descriptions import DISK_LOAD
from solver.wording import comma_hint

if TYPE_CHECKING:
    from pydantic import BaseModel

    from solver.scene.scene import Scene


def number(text: str, unit: str = "") -> float:
    """A number, for an option (NaN is refused later, with the range that holds there)."""
    try:
        return units.read(str(text), unit)  # a default is one
    except ValueError as error:
        raise typer.BadParameter(f"{error}, got {text!r}{comma_hint(text)}") from None


def unit_said(words: str) -> str | None:
    """The unit that the words of an option say, ``[Hz]``."""
    unit = UNIT.search(words)
    return None if unit is None else unit[1]


def number_in(words: str) -> Callable[[str], float]:
    """Read a number in the unit that the words of an option say, or with another one behind it."""
    unit = unit_said(words)
    return number if unit is None else partial(number, unit=unit)


def in_units(given: Any, scene: Scene, place: Place = ()) -> Any:
    """What was given of parameter paths, its numbers with a unit behind them in those of the paths."""
    if isinstance(given, Mapping):
        return {key: in_units(value, scene, (*place, key)) for key, value in given.items()}
    if isinstance(given, list):
        return [in_units(value, scene, place) for value in given]
    if not (isinstance(given, str) and units.has_suffix(given)):
        return given
    from solver.scene.parameter_paths import find_parameter

    paths = (str(key).partition(",")[0] for key in reversed(place))
    found = next(filter(None, (find_parameter(scene, path) for path in paths)), None)
    try:
        return given if found is None else units.read(given, found.unit)
    except ValueError as error:
        raise SettingError(place, given, str(error)) from error


def whole_number(text: str) -> int:
    """A whole number, for an option."""
    try:
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"must be a whole number, got {text!r}") from None


def amount(flag: str, metavar: str, words: str) -> Any:
    """An option that takes a real number, with the words of its help."""
    return typer.Option(flag, metavar=metavar, parser=number_in(words), help=words)


def count(flag: str, metavar: str, words: str) -> Any:
    """An option that takes a whole number, with the words of its help."""
    return typer.Option(flag, metavar=metavar, parser=whole_number, help=words)


def text(flag: str, metavar: str, words: str) -> Any:
    """An option that takes a text, with the words of its help."""
    return typer.Option(flag, metavar=metavar, help=words)


_UNITS = {"d": 86400.0, "h": 3600.0, "min": 60.0, "s": 1.0}


def age(text: str) -> float:
    """A length of time with its unit, in seconds."""
    digits = text.rstrip("dhmins")
    unit = _UNITS.get(text[len(digits) :])
    with suppress(ValueError):
        if unit is not None and 0.0 <= float(digits) * unit <= 1e10:
            return float(digits) * unit
    raise typer.BadParameter(f"must be a length of time such as 30d, 12h or 90min, got {text!r}")


_ALIAS = "--unknown"  # of ``--variable`` in commands that look for values in data


def join_words(arguments: Sequence[str]) -> list[str]:
    """Make one argument of the words that follow ``--variable PATH LO HI`` and the like.

    Repeatable options of several words each are what Typer does not have.
    """
    several = _several(arguments)
    if _ALIAS in several:
        arguments = ["--variable" if argument == _ALIAS else argument for argument in arguments]
    if not several.keys() & set(arguments):
        return list(arguments)
    joined: list[str] = []
    waiting, first = 0, False
    for argument in arguments:
        if waiting and argument.startswith("--"):
            waiting = 0
        if not waiting:
            joined.append(argument)
            waiting = several.get(argument, 0)
            first = True
            continue
        if first:
            joined.append(argument)
        else:
            joined[-1] += f" {argument}"
        first = False
        waiting -= 1
    return joined


def _several(arguments: Sequence[str]) -> dict[str, int]:
    """How many words follow an option of a command each time, where that is more than one."""
    named = [word for word in arguments[:2] if word != "submit"][:1]
    if named in (["identify"], ["posterior"]):
        return {"--variable": 3, _ALIAS: 3, "--prior": 3}
    if not arguments or arguments[0] not in ("design", "pareto", "submit"):
        return {}
    from optim.problem.problem_keys import DesignKeys, FrontKeys, options

    model: type[BaseModel] = DesignKeys if arguments[0] == "design" else FrontKeys
    if arguments[0] == "submit":
        from service.settings.kinds import registry_here

        registry = registry_here()
        if arguments[1:2] == [] or arguments[1] not in registry:
            return {}
        model = registry[arguments[1]].request
    return {one.flag: one.several for one in options(model).values() if one.several > 1}


def bounds(option: str, texts: Sequence[str], wanted: str = "LO HI") -> dict[str, list[Any]]:
    """Paths with two numbers each, such as the variables of a design with their bounds."""
    variables: dict[str, list[Any]] = {}
    for text in texts:
        words = text.split()
        if len(words) != 3:
            raise InputError(f"`{option}` takes PATH {wanted}, for example {DISK_LOAD} 20 3000, got {text!r}")
        path, low, high = words
        if path in variables:
            raise InputError(f"`{option}` names {path!r} twice; keep one")
        variables[path] = [part(option, text, low), part(option, text, high)]
    return variables


def by_name(
    option: str, texts: Sequence[str], example: str, wanted: str = "PATH=VALUE", *, once: bool = False
) -> dict[str, str]:
    """The texts NAME=WORD of a repeatable option; where a name may come again the last one counts."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, word = (part.strip() for part in text.partition("="))
        if not equals or not name:
            raise InputError(f"`{option}` takes {wanted}, for example {example}, got {text!r}")
        if once and name in found:
            raise InputError(f"`{option}` names {name!r} twice; keep one")
        found.pop(name, None)
        found[name] = word
    return found


def numbers(option: str, words: Mapping[str, str], unit: str | None = None) -> dict[str, Any]:
    """The numbers of the words of `by_name`; those with a unit are read where the scene is known."""
    return {name: part(option, f"{name}={word}", word, unit) for name, word in words.items()}


def settings(texts: Sequence[str] | None, option: str = "--set") -> dict[str, Any]:
    """The values of ``--set``, in the given order."""
    return numbers(option, by_name(option, texts or (), f"{DISK_LOAD}=150"))


def scene(name: str, texts: Sequence[str] | None, without: Sequence[str] | None = None) -> Scene:
    """A shipped scene or a file, with the values of ``--set``, without the contacts of ``--without``."""
    import solver

    try:
        return left_out(solver.load_scene(name).with_values(settings(texts)), without)
    except SettingError as error:
        if error.name == "path":
            raise InputError(error.issue.said("--set")) from error
        raise


def left_out(found: Scene, without: Sequence[str] | None) -> Scene:
    """The scene without the contacts of ``--without``."""
    try:
        return found.without(without) if without else found
    except SettingError as error:
        raise InputError(error.issue.said("--without")) from error


def output_path(option: str, text: str | None, suffixes: Sequence[str] = ()) -> Path | None:
    """A file that can be written at the end, checked before the work begins; None if none was asked for."""
    if text is None:
        return None
    path = Path(text)
    if suffixes and path.suffix.lower() not in suffixes:
        raise InputError(f"`{option}` must end in {', '.join(suffixes)}, got {text!r}")
    if path.is_dir():
        raise InputError(f"`{option}` must be a file, but {text!r} is a folder")
    if not path.absolute().parent.is_dir():
        raise InputError(f"`{option}`: there is no folder {str(path.absolute().parent)!r} for {text!r}")
    return path


def new_file(option: str, text: str, suffixes: Sequence[str]) -> Path:
    """As `output_path`, of a file that must not exist yet."""
    path = output_path(option, text, suffixes)
    if path is None or path.exists():
        raise InputError(f"`{option}`: {text!r} exists already; give another name or remove it")
    return path


def part(option: str, text: str, word: str, unit: str | None = None) -> Any:
    """A number that is part of what was given to an option; one with a unit as it is, where none is known."""
    try:
        return word if unit is None and units.has_suffix(word) else units.read(word, unit or "")
    except ValueError:
        wanted = f"`{option}` needs a number where {word.strip()!r} stands, got {text!r}{comma_hint(word)}"
        raise InputError(wanted) from None


def relative(path: Path, target: Path) -> str:
    """The name of a file as a scene at `target` refers to it."""
    return Path(os.path.relpath(path.absolute(), target.absolute().parent)).as_posix()
