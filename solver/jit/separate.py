"""Kernels that are compiled on their own (`solver.jit.slots`); in the plain way they are as all others."""

from __future__ import annotations

from solver.jit.setting import PLAIN

if PLAIN:
    from solver.jit.plain import apart
else:
    from solver.jit.slots import apart

__all__ = ["apart"]
