"""The exceptions of the solver: one root, and one class for each thing a caller can mend."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from numbers import Integral
from types import MappingProxyType
from typing import NamedTuple, Self

Place = tuple[str | int, ...]
"""Keys and indices that lead to a field of nested tables and lists."""


class SolverError(Exception):
    """Root of every error the solver raises on purpose.

    Attributes
    ----------
    place : tuple of str and int
        Where the cause stands in a description; empty where none was read. See `at`.
    """

    place: Place = ()


class Shown(str):
    """What was given as a message shows it, where that is not its `repr`."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


UNSAID = Shown("")


class Naming(str):
    """What would be right with other keys in braces, ``needs {accuracy}``: each face names them too."""

    __slots__ = ()


class _Names(dict[str, str]):
    def __missing__(self, key: str) -> str:
        return f"`{key}`"


class Issue(NamedTuple):
    """One thing wrong with a description or an argument; each face says it with its own name of the subject.

    Attributes
    ----------
    subject : tuple of str and int
        Keys and indices that lead to the bad field, ``("contacts", 0, "mu")``; empty: the whole.
    wanted : str
        What would be right, as it follows the name of the subject: ``must be > 0``.
    got : object
        What was given; `UNSAID` where that says nothing.
    named : bool
        Whether `wanted` follows the name; otherwise it is a whole sentence.
    """

    subject: Place
    wanted: str
    got: object = UNSAID
    named: bool = True

    @property
    def pointer(self) -> str:
        """RFC 6901 JSON pointer of the subject, for example ``/contacts/0/mu``."""
        return pointer(*self.subject)

    @property
    def name(self) -> str:
        """The last key with its indices: ``mu``, ``contacts[1]``."""
        keys = [i for i, step in enumerate(self.subject) if isinstance(step, str)]
        return written(self.subject[keys[-1] if keys else 0 :])

    @property
    def message(self) -> str:
        """The sentence, with the subject by its own name."""
        return self.said()

    def words(self, names: Mapping[str, str]) -> str:
        """Return what would be right, with what a face calls other keys."""
        if isinstance(self.wanted, Naming):
            return self.wanted.format_map(_Names({key: f"`{one}`" for key, one in names.items()}))
        return self.wanted

    def said(self, name: str = "", names: Mapping[str, str] = MappingProxyType({})) -> str:
        """Return the sentence, with what a face calls the subject, and other keys."""
        shown, words = repr(self.got), self.words(names)
        sentence = f"{words}, got {shown}" if shown else words
        if self.named:
            return f"`{name or self.name}` {sentence}"
        return f"`{name}`: {sentence}" if name else sentence

    def at(self, *place: str | int) -> Issue:
        """Return the same of another subject."""
        return self._replace(subject=place)

    def below(self, *place: str | int) -> Issue:
        """Return the same where the description stands inside another one."""
        return self.at(*place, *self.subject)


class SceneError(SolverError):
    """A scene that cannot be used; `issues` lists everything that is wrong with it."""

    def __init__(self, issues: Sequence[Issue]) -> None:
        self.issues = tuple(issues)
        super().__init__("; ".join(issue.said() for issue in self.issues))

    @classmethod
    def of(cls, subject: Place, wanted: str, got: object = UNSAID, *, named: bool = True) -> Self:
        """Return the error of one `Issue`."""
        return cls([Issue(subject, wanted, got, named)])


class StoppedError(SolverError):
    """The caller ended a computation that has no answer before it is done."""


class SettingError(SolverError):
    """A bad argument of a computation (a frequency, a number of harmonics, a parameter path).

    The message is "`name` wanted, got value", followed by `hint`; `name` is the argument, or the keys and
    indices that lead to a part of it.
    """

    def __init__(self, name: str | Place, value: object, wanted: str, hint: str = "") -> None:
        place = (name,) if isinstance(name, str) else name
        self.name = written(place)
        self.value = value
        self.issue = Issue(place, wanted, Shown(f"{value!r}{hint}") if hint else value)
        super().__init__(self.issue.said())


def check_count(name: str | Place, value: object, least: int, most: int | None = None, more: str = "") -> int:
    """Return a whole number within bounds, as an int; SettingError else, which ends as `more` says."""
    whole = int(value) if isinstance(value, Integral) and not isinstance(value, bool) else least - 1
    if least <= whole and (most is None or whole <= most):
        return whole
    bounds = f">= {least}" if most is None else f"from {least} to {most}"
    raise SettingError(name, value, f"must be a whole number {bounds}{more}")


class FieldError(ValueError):
    """A field that cannot be read, said before it is known in which description it stands."""

    def __init__(self, subject: Place, wanted: str, got: object = UNSAID, *, named: bool = True) -> None:
        self.issue = Issue(subject, wanted, got, named)
        super().__init__(self.issue.said())


@contextmanager
def at(*place: str | int) -> Iterator[None]:
    """Say of what the solver refuses meanwhile where in a description its cause stands."""
    try:
        yield
    except SolverError as error:
        error.place = error.place or place
        raise


def pointer(*steps: object) -> str:
    """Return the JSON pointer (RFC 6901) of keys and indices."""
    return "".join("/" + str(step).replace("~", "~0").replace("/", "~1") for step in steps)


_LONGEST = 200  # characters of a key that somebody made up


def written(place: Place) -> str:
    """Return a place as text, ``cases[0].band``; keys are cut where they are too long to be read."""
    steps = "".join(f"[{step}]" if isinstance(step, int) else f".{step[:_LONGEST]}" for step in place)
    return steps.removeprefix(".")


class MissingExtraError(SolverError):
    """A package that comes with an extra of the installation is needed and not there."""

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(f"this needs {package}, which is not installed: pip install 'stickslip[{extra}]'")


class ResultFileError(SolverError):
    """A file of results that cannot be written or read; the message names it and says what would be right."""
