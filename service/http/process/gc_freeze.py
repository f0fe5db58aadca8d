"""The collector of cycles, told to leave alone what lasts as long as the process."""

from __future__ import annotations

import gc
import sys
from typing import Any


class Sparing:
    """A callback of the collector that takes loaded modules out of its work.

    A service has a quarter of a million objects of modules, many loaded by the first request that needs
    them. A full collection walks through them all, and every request waits for it: 0.1 s on an idle machine.
    Here the first one after modules were loaded is the last that sees them.
    """

    def __init__(self) -> None:
        self._modules = 0

    def __call__(self, phase: str, info: dict[str, Any]) -> None:
        """After a full collection, spare what it left, if modules were loaded since the last time."""
        if phase == "stop" and info["generation"] == 2 and len(sys.modules) != self._modules:
            self._modules = len(sys.modules)
            gc.freeze()


def spare_modules() -> None:
    """Begin, with what is loaded now."""
    gc.callbacks.append(Sparing())
    gc.collect()
