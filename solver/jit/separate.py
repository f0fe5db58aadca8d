"""Kernels compiled on their own, or called by numbers, see `solver.jit.slots`.

In the plain way the first are as all others, and Python calls the second; interpreted, all are Python.
"""

from __future__ import annotations

from solver.jit.way import WAY, Way

if WAY is Way.COMPILED:
    from solver.jit.slots import apart, numbered
else:
    from solver.jit.decorators import compiled as apart
    from solver.jit.kernel_contracts import numbered

__all__ = ["apart", "numbered"]
