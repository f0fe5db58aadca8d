"""Kernels compiled on their own (`solver.jit.slots`), or called by numbers (`solver.jit.tables`).

In the plain way the first are as all others, and Python calls the second.
"""

from __future__ import annotations

from solver.jit.plain import PLAIN

if PLAIN:
    from solver.jit.plain import apart, numbered
else:
    from solver.jit.slots import apart
    from solver.jit.tables import numbered

__all__ = ["apart", "numbered"]
