"""Friction dampers: scenes, periodic responses, designs, and the client of the service, under one name.

    import stickslip

    scene = stickslip.load_scene("bladed-disk")
    best = stickslip.design(scene, variables={"shroud.N0": (20.0, 3000.0)})

Every public name of `solver` and of `optim` stands here too, the very same object; no name is in both.
`Client` talks to a running service. A name is loaded on first use, so that importing costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

import optim
import solver

if TYPE_CHECKING:
    from optim import *  # noqa: F403
    from service.client.client import Client
    from service.errors import ServiceProblem
    from solver import *  # noqa: F403

    __version__: str

_OF_THE_SERVICE = {"Client": "service.client.client", "ServiceProblem": "service.errors"}

__all__ = ["Client", "ServiceProblem"]
__all__ += solver.__all__
__all__ += optim.__all__


if not TYPE_CHECKING:  # a checker shall notice a name that is none

    def __getattr__(name: str) -> object:
        """Load a public name on first use."""
        if name == "__version__":
            from importlib.metadata import version

            value: object = version("stickslip")
        elif name in _OF_THE_SERVICE:
            value = getattr(import_module(_OF_THE_SERVICE[name]), name)
        elif name in __all__:
            value = getattr(solver if name in solver.__all__ else optim, name)
        else:
            raise AttributeError(f"module 'stickslip' has no attribute {name!r}")
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """Return the public names, for completion."""
    return sorted(__all__)
