"""The kinds of job of this machine: those that come with the service, and those the environment names."""

from __future__ import annotations

import os

from service.jobs.kinds import SHIPPED
from service.jobs.kinds.registry.loading import registry_of
from service.jobs.registry import Registry


def registry_here() -> Registry:
    """The kinds that the settings of the environment name beside those that come with the service.

    Raises
    ------
    ConfigurationError
        As `service.jobs.kinds.registry.loading.registry_of`, or a setting is wrong.
    """
    if "STICKSLIP_KINDS" not in os.environ:
        return SHIPPED
    # Loaded here: the settings bring the database's packages along.
    from service.settings.settings import load_settings

    return registry_of(load_settings().kinds)
