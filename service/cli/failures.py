"""What becomes of an error on the command line: a message on standard error and an exit status."""

from __future__ import annotations

import re
import sys

from optim.criteria.registry import limit_keys
from optim.errors import DesignError
from service import errors
from solver.errors import Issue, SceneError, SettingError, SolverError

FELL_SHORT = 1
BAD_INPUT = 2

# Arguments of the Python interface as the user of the command knows them.
_OPTIONS = {
    "frequency_hz": "--frequency",
    "start": "--from",
    "stop": "--to",
    "to": "--to",
    "harmonics": "--harmonics",
    "accuracy": "--accuracy",
    "effects": "--effects",
    "parameter": "--parameter",
    "limit": "--limit",
    "variables": "--variable",
    "unknowns": "--unknown",
    "priors": "--prior",
    "candidates": "--candidate",
    "orders": "--order",
}
# What is not the user's input: the state of a file or of a service.
_STATE = (
    errors.DamagedDatabaseError,
    errors.DatabaseInUseError,
    errors.WrongRevisionError,
    errors.ConflictError,
    errors.RetryLaterError,
    errors.JobFailedError,
)
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def option_name(name: str) -> str:
    """The option that sets an argument of the Python interface."""
    # One of several values of a repeatable option has its number behind the name.
    plain = name.partition("[")[0]
    of_keys = (key.flag for key in limit_keys() if key.name == plain)
    return _OPTIONS.get(plain) or next(of_keys, name)


class ShortfallError(Exception):
    """The computation did not reach its goal; the message is its status, with what to try."""


def end(reached: bool, status: str) -> None:
    """Raise ShortfallError if the goal of a computation was not reached."""
    if not reached:
        raise ShortfallError(status)


REPORTED = (SolverError, DesignError, errors.ServiceError, errors.InputError, ShortfallError)


def report(error: Exception) -> int:
    """Print an error of `REPORTED`; return the exit status."""
    for line in _lines(error):
        sys.stderr.write(_CONTROL.sub("?", f"stickslip: {line}") + "\n")
    return _status(error)


def _status(error: Exception) -> int:
    if isinstance(error, (SceneError, SettingError, DesignError, errors.InputError)):
        return BAD_INPUT
    if isinstance(error, errors.ServiceProblem):
        return BAD_INPUT if 400 <= error.status < 500 and error.status != 409 else FELL_SHORT
    if isinstance(error, errors.ServiceError) and not isinstance(error, _STATE):
        return BAD_INPUT
    return FELL_SHORT


def _lines(error: Exception) -> list[str]:
    if isinstance(error, (SceneError, errors.InvalidRequestError)):
        return [_issue(issue) for issue in error.issues]
    if isinstance(error, (SettingError, DesignError)):
        return [_as_option(str(error), error.name)]
    if isinstance(error, errors.ServiceProblem):
        return _problem(error)
    return [str(error)]


def _issue(issue: Issue) -> str:
    return f"{issue.pointer}: {issue.message}" if issue.pointer else issue.message


def _as_option(message: str, name: str) -> str:
    return message.replace(f"`{name}`", f"`{option_name(name)}`", 1)


def _problem(error: errors.ServiceProblem) -> list[str]:
    issues = error.problem.get("errors")
    if not isinstance(issues, list) or not issues:
        return [str(error)]
    return [
        f"{issue.get('pointer') or issue.get('parameter', '')}: {issue.get('detail', '')}" for issue in issues
    ]
