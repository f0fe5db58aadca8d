"""The exceptions of the solver: one root, and one class for each thing a caller can mend."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Issue:
    """One thing wrong with a scene.

    Attributes
    ----------
    pointer : str
        RFC 6901 JSON pointer of the bad field, for example ``/contacts/0/mu``.
    message : str
        Names the key, quotes the value and says what would be right.
    """

    pointer: str
    message: str


class SceneError(SolverError):
    """A scene that cannot be used; `issues` lists everything that is wrong with it."""

    def __init__(self, issues: Sequence[Issue]) -> None:
        self.issues = tuple(issues)
        super().__init__("; ".join(issue.message for issue in self.issues))


class StoppedError(SolverError):
    """The caller ended a computation that has no answer before it is done."""


class SettingError(SolverError):
    """A bad argument of a computation (a frequency, a number of harmonics, a parameter path).

    The message is "`name` wanted, got value", followed by `hint`.
    """

    def __init__(self, name: str, value: object, wanted: str, hint: str = "") -> None:
        self.name = name
        self.value = value
        super().__init__(f"`{name}` {wanted}, got {value!r}{hint}")


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


class MissingExtraError(SolverError):
    """A package that comes with an extra of the installation is needed and not there."""

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(f"this needs {package}, which is not installed: pip install 'stickslip[{extra}]'")


class ResultFileError(SolverError):
    """A file of results that cannot be written or read; the message names it and says what would be right."""
