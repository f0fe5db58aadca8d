"""LAPACK for the kernels without the rest of SciPy.

Numba takes LAPACK from `scipy.linalg.cython_lapack`, at the first call. To import that module as part of its
package runs the package too, which takes ten times as long and is not needed here. A module that is loaded
already is taken as it is, by Numba and by SciPy, whose package can be imported afterwards as ever.
"""

from __future__ import annotations

import importlib.util
import sys
from contextlib import suppress
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, FileFinder
from pathlib import Path

NAME = "scipy.linalg.cython_lapack"


def load() -> None:
    """Load the module alone; if that cannot be done, nothing happens, and Numba imports the package."""
    if NAME in sys.modules or "scipy.linalg" in sys.modules:
        return
    import scipy  # on Windows it says where its libraries are

    folder = Path(scipy.__file__).parent / "linalg"
    loader = (ExtensionFileLoader, EXTENSION_SUFFIXES)
    found = FileFinder(str(folder), loader).find_spec(NAME.rpartition(".")[2])
    spec = None if found is None else importlib.util.spec_from_file_location(NAME, found.origin)
    if spec is None or spec.loader is None:
        return
    with suppress(ImportError):
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        sys.modules.setdefault(NAME, module)
