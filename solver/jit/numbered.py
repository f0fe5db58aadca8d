"""Kernels of one contract, called by their numbers (`solver.jit.tables`); in the plain way by Python."""

from __future__ import annotations

from solver.jit.setting import PLAIN

if PLAIN:
    from solver.jit.plain import numbered
else:
    from solver.jit.tables import numbered

__all__ = ["numbered"]
