"""Kernels compiled on their own (`solver.jit.slots`), or called by numbers (`solver.jit.kernel_tables`).

In the plain way the first are as all others, and Python calls the second; interpreted, all are Python.
"""

from __future__ import annotations

from solver.jit.way import WAY, Way

if WAY is Way.COMPILED:
    from solver.jit.kernel_tables import numbered
    from solver.jit.slots import apart
else:
    from solver.jit.decorators import compiled as apart
    from solver.jit.kernel_contracts import numbered

__all__ = ["apart", "numbered"]
