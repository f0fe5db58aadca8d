"""Friction dampers: scenes, periodic responses, designs, and the client of the service, under one name.

    import stickslip

    scene = stickslip.load_scene("bladed-disk")
    best = stickslip.design(scene, variables={"shroud.N0": (20.0, 3000.0)})

Every public name of `solver` and of `optim` stands here too, the very same object; no name is in both.
`Client` talks to a running service. A name is loaded on first use, so that importing costs nothing.
"""

import optim
import solver
from solver.first_use import on_first_use

_homes = {"Client": "service.client.client", "ServiceProblem": "service.errors"}
_homes |= dict.fromkeys(solver.__all__, "solver") | dict.fromkeys(optim.__all__, "optim")
_load, __dir__, __all__ = on_first_use(__name__, _homes)


def __getattr__(name: str) -> object:
    """Load a public name on first use."""
    if name != "__version__":
        return _load(name)
    from importlib.metadata import version

    return version("stickslip")
