"""Run a command that can open no file but those below given folders: `fence.py WRITE,… READ,… COMMAND …`.

Linux's Landlock (since 5.13, for everybody) is asked directly; what it forbids to a process it forbids to all
that this starts. Elsewhere the command runs without a fence, which `offered` tells.
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys

CREATE, ADD, RESTRICT = 444, 445, 446  # calls of the system
NO_NEW_PRIVILEGES, CHILDREN_COME_BACK = 38, 36  # of prctl
READ = 0b1101  # execute, read files, list folders
FILES, NETWORK = ((1, 13), (2, 14), (3, 15)), 4  # versions of Landlock, and how many rights to files each has
CONNECTIONS = 0b11  # TCP, to and from


def _call(number: int, *arguments: object) -> int:
    found = int(ctypes.CDLL(None, use_errno=True).syscall(number, *arguments))
    if found < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return found


def offered() -> int:
    """Return the version of Landlock, 0 where there is none."""
    try:
        return _call(CREATE, None, ctypes.c_size_t(0), 1) if sys.platform == "linux" else 0
    except OSError:
        return 0


def restrict(write: list[str], read: list[str]) -> None:
    """Forbid this process every file that is not below these folders, and connections where that is offered.

    Raises
    ------
    OSError
        The system refuses.
    """
    version = offered()
    every = (1 << max(count for least, count in FILES if least <= version)) - 1
    rules = struct.pack("=QQ", every, CONNECTIONS)[: 16 if version >= NETWORK else 8]
    fence = _call(CREATE, rules, ctypes.c_size_t(len(rules)), 0)
    for rights, places in ((every, write), (READ, read)):
        for place in places:
            if os.path.isdir(place):
                folder = os.open(place, os.O_PATH | os.O_CLOEXEC)
                _call(ADD, fence, 1, struct.pack("=Qi", rights, folder), 0)
    ctypes.CDLL(None).prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    _call(RESTRICT, fence, 0)


if __name__ == "__main__":
    writable, readable, *command = sys.argv[1:]
    if sys.platform == "linux":  # what the command's children leave behind is its own: its time is counted
        ctypes.CDLL(None).prctl(CHILDREN_COME_BACK, 1, 0, 0, 0)
    if offered():
        restrict(writable.split(os.pathsep), readable.split(os.pathsep))
    os.execv(command[0], command)
