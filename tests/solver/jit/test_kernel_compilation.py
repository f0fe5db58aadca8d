"""How kernels are compiled: one at a time, in several processes, and kept on disk for the next."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent.parent

KERNELS = """
from __future__ import annotations
import numpy as np
from solver.jit.separate import apart
from solver.jit.decorators import compiled
from solver.jit.separate import numbered

@apart
def half(x: float) -> float:
    if x < 0.0:
        raise ValueError("negative")
    return 0.5 * x

@apart
def parts(x: float, n: int) -> tuple[float, int]:
    return half(x) + n, n + 1

@compiled
def use(x: float) -> float:
    total, n = parts(x, 2)
    return total + n

@apart
def lies(x: float) -> int:
    return 2.0 * x

@apart
def honest(x: float) -> int:
    return lies(x)

@compiled
def _inner(x: float) -> float:
    return x

@compiled
def doubled(x):
    return x + x

@apart
def broken(x: float) -> float:
    return np.no_such_function(x)

@compiled
def sometimes(x: float) -> float:
    return broken(x) if x > 1e9 else x

@numbered((np.float64,), np.float64, known=("little:half", "little:broken"))
def by_number(number: int, x: float) -> float:
    ...

@compiled
def chosen(x: float) -> float:
    return by_number(0, x)

@compiled
def chosen_too(x: float) -> float:
    return by_number(0, x) + x
"""


def python(folder: Path, program: str, *arguments: str) -> subprocess.Popen[str]:
    """Run a program that sees the kernels above, with machine code in `folder` alone."""
    (folder / "little.py").write_text(KERNELS, encoding="utf-8")
    main = folder / f"main{abs(hash(program))}.py"
    main.write_text(program, encoding="utf-8")
    environment = dict(os.environ, XDG_CACHE_HOME=str(folder), PYTHONPATH=f"{folder}{os.pathsep}{ROOT}")
    environment.pop("NUMBA_CACHE_DIR", None)
    return subprocess.Popen(
        [sys.executable, str(main), *arguments],
        env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def said(process: subprocess.Popen[str]) -> tuple[str, str]:
    out, err = process.communicate(timeout=600)
    assert process.returncode == 0, err
    return out, err


def test_a_kernel_apart_is_called_fails_and_is_refused_as_it_should(tmp_path: Path) -> None:
    program = """
import little
print(little.use(3.0), little.parts(1.0, 1), little.half(2.0))
for call in (lambda: little.use(-1.0), lambda: little.honest(1.0), lambda: little._inner(1.0)):
    try:
        print(call())
    except Exception as error:
        print(type(error).__name__, error)
print([len(k.overloads) for k in (little.use, little._inner)])
"""
    for _ in range(2):  # compiled, then loaded
        out, err = said(python(tmp_path, program))
        assert out.splitlines() == [
            "6.5 (1.5, 2) 1.0",
            "ValueError negative",
            "RuntimeError the kernel little.lies could not be compiled",
            "TypeError a kernel whose name begins with an underscore is called by kernels, not by Python",
            "[1, 0]",
        ]
        assert "TypeError: lies returns float64, not int64" in err


@pytest.mark.long
def test_processes_that_compile_at_once_lose_nothing(tmp_path: Path) -> None:
    """Each saves other types of the same kernel; a further process then finds all of them."""
    program = """
import pathlib, sys, time
import numpy as np, little
here, mine = pathlib.Path(__file__).parent, sys.argv[1]
values = [np.dtype(name).type(3) for name in mine.split(",")]
(here / f"ready-{values[0].dtype}").touch()
while len(list(here.glob("ready-*"))) < 3:
    time.sleep(0.001)
for value in values:
    assert little.doubled(value) == 6
"""
    kinds = ("float64,int8,uint8", "float32,int16,uint16", "complex64,int32,uint32")
    for process in [python(tmp_path, program, mine) for mine in kinds]:
        said(process)
    check = f"""
import numpy as np, little
for name in {",".join(kinds)!r}.split(","):
    assert little.doubled(np.dtype(name).type(3)) == 6, name
print(sum(little.doubled.stats.cache_hits.values()), sum(little.doubled.stats.cache_misses.values()))
"""
    assert said(python(tmp_path, check))[0] == "9 0\n"


@pytest.mark.long
@pytest.mark.parametrize("processes", [1, 2])
def test_what_a_call_might_need_is_compiled_too(tmp_path: Path, processes: int) -> None:
    """Kernels not reached by the calls made are compiled with the rest, and what goes wrong there is said."""
    program = f"""
import little
from solver.jit.parallel import compile_together

def one():
    assert little.use(3.0) == 6.5

def two():
    assert little.sometimes(1.0) == 1.0

def three():
    raise ArithmeticError("three")

if __name__ == "__main__":
    compile_together([one], processes={processes})
    for calls in ([one, two], [one, three]):
        try:
            compile_together(calls, processes={processes})
        except Exception as error:
            print("no_such_function" in str(error), "three" in str(error))
"""
    out, _ = said(python(tmp_path, program))
    assert out.splitlines() == ["True False", "False True"]


@pytest.mark.long
@pytest.mark.parametrize("processes", [1, 2])
def test_what_no_call_reached_is_left_if_it_is_not_wanted(tmp_path: Path, processes: int) -> None:
    program = f"""
import little
from solver.jit.parallel import compile_together

def two():
    assert little.sometimes(1.0) == 1.0

if __name__ == "__main__":
    compile_together([two], listed=False, processes={processes})
    print("left")
"""
    assert said(python(tmp_path, program))[0] == "left\n"


@pytest.mark.long
@pytest.mark.parametrize("processes", [1, 2])
def test_kernels_called_by_number_are_compiled_if_they_are_wanted(tmp_path: Path, processes: int) -> None:
    program = f"""
import little
from solver.jit.parallel import compile_together

def one():
    assert little.by_number.number("little:half") == 0
    assert little.chosen(3.0) == 1.5

def two():
    assert little.chosen_too(3.0) == 4.5

if __name__ == "__main__":
    compile_together([one], listed=False, processes={processes})
    try:
        compile_together([two], processes={processes})
    except Exception as error:
        print("no_such_function" in str(error))
"""
    out, _ = said(python(tmp_path, program))
    assert out.splitlines() == ["True"]


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="users have temporary folders of their own there")
@pytest.mark.parametrize("mode", [0o700, 0o777])
def test_without_a_home_code_is_kept_where_nobody_else_can_write(tmp_path: Path, mode: int) -> None:
    own = tmp_path / f"stickslip-kernels-{os.getuid()}"
    own.mkdir()
    own.chmod(mode)
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    found = subprocess.run(
        [sys.executable, "-c", "from solver.jit.cache import CACHE_FOLDER; print(CACHE_FOLDER)"],
        env=environment | {"XDG_CACHE_HOME": "/dev/null/none", "TMPDIR": str(tmp_path)},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    folder = Path(found.stdout.strip())
    assert folder.stat().st_uid == os.getuid()
    assert folder.is_relative_to(own) == (mode == 0o700)
    assert folder.is_relative_to(tmp_path)
