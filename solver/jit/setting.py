"""Which way kernels are compiled: our own, or one that asks nothing of Numba but what it documents."""

from __future__ import annotations

import os

PLAIN = os.environ.get("STICKSLIP_PLAIN_KERNELS", "") not in ("", "0")
"""Whether kernels are plain `numba.njit`: slow to start, nothing is kept on disk, but of any Numba."""
