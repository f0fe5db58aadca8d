"""How a wheel is made: by setuptools, with compiled kernels where `STICKSLIP_WHEEL_KERNELS=1` asks for them.

Such a wheel is for this Python and this kind of machine; its kernels are for every processor of the kind.
"""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403 - whatever a backend may have

_HERE = Path(__file__).parents[1]
_ASKED = os.environ.get("STICKSLIP_WHEEL_KERNELS", "") not in ("", "0")


def get_requires_for_build_wheel(config_settings: Mapping[str, Any] | None = None) -> list[str]:
    """Return what must be installed: to compile kernels, what the package needs."""
    needed: list[str] = build_meta.get_requires_for_build_wheel(config_settings)
    if _ASKED:
        needed += tomllib.loads((_HERE / "pyproject.toml").read_text("utf-8"))["project"]["dependencies"]
    return needed


def build_wheel(
    wheel_directory: str,
    config_settings: Mapping[str, Any] | None = None,
    metadata_directory: str | None = None,
) -> str:
    """Make a wheel."""
    if not _ASKED:
        return build_meta.build_wheel(wheel_directory, config_settings, metadata_directory)
    packed = _compiled()
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    machine = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    tags = ["--python-tag", python, "--plat-name", machine]
    try:
        return build_meta.build_wheel(
            wheel_directory, {**(config_settings or {}), "--build-option": tags}, metadata_directory
        )
    finally:
        packed.unlink()


def _compiled() -> Path:
    """Compile the kernels for this kind of processor; return their archive, beside the sources."""
    sys.path.insert(0, str(_HERE))
    from solver.jit import folder as shipped

    kind = shipped.target()
    if kind is None:
        raise SystemExit("kernels are compiled on Linux alone, on x86-64-v3 or aarch64")
    with tempfile.TemporaryDirectory() as cache:
        os.environ |= {
            "NUMBA_CACHE_DIR": cache, shipped.CPU_NAME: kind.name, shipped.CPU_FEATURES: kind.features,
            "STICKSLIP_KERNELS": "compiled",
        }  # fmt: skip
        subprocess.run([sys.executable, "-m", "service.warm_up", "--scenes"], cwd=_HERE, check=True)
        return shipped.pack()
