"""What becomes of an error on the command line: a message on standard error and an exit status."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping

from service import errors
from service.settings.logs import CONTROL
from solver.errors import Issue, SceneError, SettingError, SolverError

FELL_SHORT = 1
BAD_INPUT = 2

# What is not the user's input: the state of a file or of a service.
_STATE = (
    errors.DamagedDatabaseError,
    errors.DatabaseInUseError,
    errors.WrongRevisionError,
    errors.ConflictError,
    errors.RetryLaterError,
    errors.JobFailedError,
)


def refused(
    issues: Iterable[Issue], flags: Mapping[str, str], file: object = None
) -> errors.InputError:  # fmt: skip
    """Return what is wrong with options, and with keys of a file, as the user of the command knows them.

    Parameters
    ----------
    issues : by the keys of a body, or the arguments of a function.
    flags : key to its option; a part of what an option takes stands behind it, ``--variable damper.N0``.
    file : where the other keys stand.
    """
    return errors.InputError("\nstickslip: ".join(_worded(one, flags, file) for one in issues))


def _worded(issue: Issue, flags: Mapping[str, str], file: object) -> str:
    key, *parts = issue.subject or ("",)
    if key not in flags:
        if file is None:
            return _told(issue) if parts else issue.said()
        return f"{file}: {_told(issue)}"
    named = [flags[str(key)], *(part for part in parts if isinstance(part, str))]
    return issue.said(" ".join(named), flags)


class ShortfallError(Exception):
    """The computation did not reach its goal; the message is its status, with what to try."""


def end(reached: bool, status: str) -> None:
    """Raise ShortfallError if the goal of a computation was not reached."""
    if not reached:
        raise ShortfallError(status)


REPORTED = (SolverError, errors.ServiceError, errors.InputError, ShortfallError)


def report(error: Exception) -> int:
    """Print an error of `REPORTED`; return the exit status."""
    for line in _lines(error):
        sys.stderr.write(CONTROL.sub("?", f"stickslip: {line}") + "\n")
    return _status(error)


def _status(error: Exception) -> int:
    if isinstance(error, (SceneError, SettingError, errors.InputError)):
        return BAD_INPUT
    if isinstance(error, errors.ServiceProblem):
        return BAD_INPUT if 400 <= error.status < 500 and error.status != 409 else FELL_SHORT
    if isinstance(error, errors.ServiceError) and not isinstance(error, _STATE):
        return BAD_INPUT
    return FELL_SHORT


def _lines(error: Exception) -> list[str]:
    if isinstance(error, (SceneError, errors.InvalidRequestError)):
        return [_told(issue) for issue in error.issues]
    if isinstance(error, errors.ServiceProblem):
        return _problem(error)
    return [str(error)]


def _told(issue: Issue) -> str:
    return f"{issue.pointer}: {issue.said()}" if issue.subject else issue.said()


def _problem(error: errors.ServiceProblem) -> list[str]:
    issues = error.problem.get("errors")
    if not isinstance(issues, list) or not issues:
        return [str(error)]
    return [
        f"{issue.get('pointer') or issue.get('parameter', '')}: {issue.get('detail', '')}" for issue in issues
    ]
