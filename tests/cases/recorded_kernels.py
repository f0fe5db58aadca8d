"""Calls of kernels that tests make themselves, recorded as they run compiled and made again interpreted.

As a plugin of pytest (``-p recorded_kernels``) it keeps the first calls of each in the file `KERNEL_CALLS`.
"""

from __future__ import annotations

import ast
import copy
import importlib
import os
import pickle
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parent.parent.parent
MOST = 4  # calls of a kernel that are kept
TOLERANCE = 1e-10  # of the largest entry
_calls: list[tuple[Any, ...]] = []
_counted: Counter[str] = Counter()


def kernels_called_by_tests() -> dict[Path, set[str]]:
    """The kernels of the solver that each file of tests imports by name, as ``module:name``."""
    found: dict[Path, set[str]] = {}
    for path in [
        *ROOT.glob("tests/solver/**/test_*.py"),
        *ROOT.glob("stickslip/lab/*/tests/*.py"),
        *ROOT.glob("tests/cases/*.py"),
    ]:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and _holds_kernels(node.module):
                names = {f"{node.module}:{one.name}" for one in node.names}
                found.setdefault(path, set()).update(names & _kernels_of(node.module))
    return {path: names for path, names in found.items() if names}


def _holds_kernels(module: str) -> bool:
    return module.startswith(("solver.", "stickslip.lab.")) and not {"kernels", "jit"}.isdisjoint(
        module.split(".")
    )


def _kernels_of(module: str) -> set[str]:
    source = ROOT.joinpath(*module.split(".")).with_suffix(".py")
    functions = (
        node for node in ast.parse(source.read_text("utf-8")).body if isinstance(node, ast.FunctionDef)
    )
    marks = {"compiled", "apart"}
    return {
        f"{module}:{one.name}" for one in functions
        if marks & {mark.id for mark in one.decorator_list if isinstance(mark, ast.Name)}
    }  # fmt: skip


def pytest_collection_finish() -> None:
    """Put a recorder in place of each kernel that a module of tests has."""
    for module in list(sys.modules.values()):
        if str(getattr(module, "__file__", None) or "").startswith(str(ROOT / "tests")):
            for name, value in list(vars(module).items()):
                if hasattr(value, "py_func") or hasattr(value, "_kernel"):
                    setattr(module, name, _recorder(value))


def pytest_sessionfinish() -> None:
    """Write what was recorded."""
    Path(os.environ["KERNEL_CALLS"]).write_bytes(pickle.dumps(_calls))


def _recorder(kernel: Any) -> Callable[..., Any]:
    name = f"{kernel.__module__}:{kernel.__name__}"

    def called(*arguments: Any) -> Any:
        if _counted[name] >= MOST or not _holds_kernels(kernel.__module__):
            return kernel(*arguments)
        before = _kept(arguments)
        result = kernel(*arguments)
        _counted[name] += 1
        _calls.append((name, before, _kept(arguments), _kept(result)))
        return result

    return called


def _kept(value: Any) -> Any:
    """A value that can be stored: a copy, and of a record by reference its fields."""
    if isinstance(value, tuple):
        kept = [_kept(one) for one in value]
        return type(value)(*kept) if hasattr(value, "_fields") else tuple(kept)
    if hasattr(value, "_type") and hasattr(value, "_meminfo"):
        names = tuple(name for name, _ in value._type._fields)
        fields = dict(zip(names, map(_kept, _reader(names)(value)), strict=True))
        return {"module": type(value).__module__, "class": type(value).__name__, "fields": fields}
    return copy.deepcopy(value)


@cache
def _reader(names: tuple[str, ...]) -> Any:
    """A compiled function that gives the fields of a record by reference, which Python cannot read."""
    import numba

    return numba.njit(eval(f"lambda one: ({', '.join(f'one.{name}' for name in names)},)"))


def _made(value: Any) -> Any:
    """The same as an interpreted kernel takes it."""
    if isinstance(value, tuple):
        made = [_made(one) for one in value]
        return type(value)(*made) if hasattr(value, "_fields") else tuple(made)
    if isinstance(value, dict):
        kinds = vars(importlib.import_module(value["module"])).values()
        kind = next(one for one in kinds if getattr(one, "__name__", None) == value["class"])
        return kind(*(_made(one) for one in value["fields"].values()))
    if isinstance(value, np.ndarray) and value.dtype.names:
        return value.astype(np.dtype((np.record, value.dtype)))
    return copy.deepcopy(value)


def replayed(file: str) -> list[tuple[str, float]]:
    """Make the calls of a file again in this process; return each kernel with how far it is off."""
    off = []
    for name, before, after, result in pickle.loads(Path(file).read_bytes()):
        module, _, kernel = name.partition(":")
        given = _made(before)
        found = getattr(importlib.import_module(module), kernel)(*given)
        off.append((name, max(_differences((given, found), (after, result)), default=0.0)))
    return off


def _differences(mine: Any, other: Any) -> Iterator[float]:
    """How far numbers are off, in units of the largest of their array; infinity where one is no number."""
    if isinstance(other, dict):
        for name, value in other["fields"].items():
            if name != "filled":  # tells by addresses
                yield from _differences(getattr(mine, name), value)
    elif isinstance(other, tuple):
        for one, another in zip(mine, other, strict=True):
            yield from _differences(one, another)
    elif isinstance(other, np.ndarray) and other.dtype.names:
        for name in other.dtype.names:
            yield from _differences(np.asarray(mine[name]), other[name])
    elif other is not None:
        one, another = np.asarray(mine, dtype=complex), np.asarray(other, dtype=complex)
        assert one.shape == another.shape
        finite = np.isfinite(another)
        if not np.array_equal(one[~finite], another[~finite], equal_nan=True):
            yield np.inf
        elif np.any(finite):
            scale = np.abs(another[finite]).max() or 1.0
            yield float((np.abs(one[finite] - another[finite]) / scale).max())
