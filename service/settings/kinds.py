"""The kinds of job of this machine: those that come with the service, and those of other packages.

Only the settings name modules, which whoever runs the service writes; a request never does. Nothing is
looked for: a package that happens to be installed adds no kind by itself.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable

from service.errors import ConfigurationError
from service.jobs.kind_registry import JobKind, Registry
from service.jobs.kinds import SHIPPED
from service.jobs.study import Study
from solver.first_use import on_demand

_ENTRY = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*")


def registry_of(entries: Iterable[str], base: Registry = SHIPPED) -> Registry:
    """The kinds that come with the service and those of `entries`.

    ConfigurationError if an entry is none, cannot be imported, is no kind, or has a name that is taken.

    Parameters
    ----------
    entries : ``module:NAME`` each: a `Study`, a `JobKind`, or a sequence of them, at the top level of a
        module that can be imported.
    base : the kinds there are without them.
    """
    kinds: dict[str, str] = {kind.name: "the service itself" for kind in base}
    found: list[JobKind] = []
    for entry in entries:
        for kind in _kinds_of(entry):
            if kind.name in kinds:
                raise ConfigurationError(
                    f"`kinds` (STICKSLIP_KINDS): {entry!r} has a kind {kind.name!r}, a name that "
                    f"{kinds[kind.name]} has: call it something else"
                )
            kinds[kind.name] = entry
            found.append(kind)
    return base.extended(*found) if found else base


def _kinds_of(entry: str) -> list[JobKind]:
    if not _ENTRY.fullmatch(entry):
        raise ConfigurationError(
            f"`kinds` (STICKSLIP_KINDS) must list module:NAME, for example mypackage.kinds:FATIGUE, "
            f"got {entry!r}"
        )
    try:
        value = on_demand(entry)
    except Exception as error:
        raise ConfigurationError(
            f"`kinds` (STICKSLIP_KINDS): {entry!r} cannot be imported: {type(error).__name__}: {error}"
        ) from error
    listed = list(value) if isinstance(value, (list, tuple)) else [value]
    kinds = [one.as_kind() if isinstance(one, type) and issubclass(one, Study) else one for one in listed]
    if not all(isinstance(one, JobKind) for one in kinds):
        raise ConfigurationError(
            f"`kinds` (STICKSLIP_KINDS): {entry!r} must be a Study, a JobKind or a list of them, got "
            f"{type(value).__name__}"
        )
    return kinds


def registry_here() -> Registry:
    """The kinds that the settings of the environment name beside those that come with the service.

    ConfigurationError as `service.settings.kinds.registry_of`, or a setting is wrong.
    """
    if "STICKSLIP_KINDS" not in os.environ:
        return SHIPPED
    # Loaded here: the settings bring the database's packages along.
    from service.settings.settings import load_settings

    return registry_of(load_settings().kinds)
