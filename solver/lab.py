"""The lab as seen from below: what few ask stands there, a folder a capability, and is named by its place.

`stickslip.lab` lies above everything else, so nothing here or above may import it. Registries, stubs and the
few calls that lead into it name it as text. Where a folder is taken out, so are the names, kinds and commands
it gave.
"""

from __future__ import annotations

import os
from functools import cache
from importlib import import_module
from typing import Any

from solver.errors import SolverError

LAB = "stickslip.lab"


class MissingRoomError(SolverError):
    """What stands in a folder of the lab is needed, and the folder is not there."""

    def __init__(self, room: str) -> None:
        super().__init__(f"this needs {LAB}.{room}, which is not installed")


_FOLDER = os.path.join(os.path.dirname(os.path.dirname(__file__)), *LAB.split("."))


@cache
def rooms() -> frozenset[str]:
    """The folders of the lab that are there; nothing is imported to know it."""
    return frozenset(name for name in os.listdir(_FOLDER) if name.isidentifier() and name[0] != "_")


def files_of(name: str) -> dict[str, bytes]:
    """What the file of a name holds, of every folder of the lab that has it."""
    paths = {room: os.path.join(_FOLDER, room, name) for room in sorted(rooms())}
    found = {}
    for room, path in paths.items():
        if os.path.isfile(path):
            with open(path, "rb") as file:
                found[room] = file.read()
    return found


def is_there(module: str) -> bool:
    """Whether a module can be had, as far as the lab goes."""
    return not module.startswith(f"{LAB}.") or module.split(".")[2] in rooms()


def from_lab(place: str) -> Any:
    """Load what stands in the lab at a place, ``room.module:name``, or ``room.module`` itself.

    Raises
    ------
    MissingRoomError
        The room is not there.
    """
    module, _, name = place.partition(":")
    if not is_there(f"{LAB}.{module}"):
        raise MissingRoomError(module.partition(".")[0])
    found = import_module(f"{LAB}.{module}")
    return getattr(found, name) if name else found
