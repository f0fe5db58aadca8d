"""Where a receptance was filled: what is asked for again at the same place need not be summed again."""

from __future__ import annotations

from typing import Any

import numpy as np

from solver.contacts.kernels.system import System
from solver.jit.decorators import compiled


@compiled
def _place(system: System, p: float, i: int) -> float:
    """Return number i of those that tell what A belongs to: λ, what λ is, the frequency, and the modes."""
    if i == 0:
        return p
    if i == 1:
        return float(system.kind)
    if i == 2:
        return system.omega
    address = system.contact_modes.ctypes.data
    return float(address % 2**32) if i == 3 else float(address // 2**32)


@compiled
def is_filled(system: System, p: float, out: Any) -> bool:
    """Return whether A is that of this structure at λ = p."""
    same = True
    for i in range(out.filled.size):
        same = same and out.filled[i] == _place(system, p, i)
    return bool(same)


@compiled
def note(system: System, p: float, out: Any) -> None:
    """Keep in mind where A was filled."""
    for i in range(out.filled.size):
        out.filled[i] = _place(system, p, i)


@compiled
def forget(out: Any) -> None:
    """Have A filled anew next time: it is changed."""
    for i in range(out.filled.size):
        out.filled[i] = np.nan
