"""Starting quickly: what a process imports before it does what it was asked for, and what it leaves out."""

from __future__ import annotations

import inspect
import subprocess
import sys

import pytest
from each import each

from service.cli.table import TOP, CommandEntry, CommandGroup, Deferred
from service.jobs.kinds import studies

SERVICE = {"fastapi", "sqlalchemy", "alembic", "httpx", "uvicorn", "pydantic_settings", "prometheus_client"}
PICTURES = {"matplotlib", "pandas", "xarray", "pyarrow"}
DESIGN = {"cvxpy", "clarabel", "casadi"}
NUMBERS = {"numpy", "scipy", "numba", "llvmlite", "pydantic"}


def loaded_by(*arguments: str) -> set[str]:
    """The modules of a process at the end of a command."""
    code = (
        f"import sys; from service.cli import main; status = main({list(arguments)!r}); "
        "sys.stderr.write(' '.join(sys.modules)); sys.exit(status)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return set(done.stderr.split())


@pytest.mark.parametrize("words", ["--help", "--version", "db --help", "keys --help"])
def test_help_loads_no_command(words: str) -> None:
    loaded = loaded_by(*words.split())
    assert loaded & (SERVICE | PICTURES | DESIGN | NUMBERS | {"rich"}) == set()
    assert [name for name in loaded if name.startswith("service.cli.commands.")] == []


def test_the_list_of_kinds_loads_no_service() -> None:
    """Their names and summaries stand in the files of the kinds alone, which are loaded for it."""
    assert loaded_by("submit", "--help") & (SERVICE | PICTURES | DESIGN | {"rich", "numba", "scipy"}) == set()


def test_the_list_of_scenes_loads_no_service() -> None:
    assert loaded_by("scenes") & (SERVICE | PICTURES | DESIGN) == set()


@pytest.mark.few(5)
@pytest.mark.parametrize("study", sorted(studies()))
def test_help_of_a_command_loads_no_numbers(study: str) -> None:
    """Options follow from a model of Pydantic's; nothing that computes is needed for them."""
    assert loaded_by(study, "--help") & (SERVICE | PICTURES | DESIGN | NUMBERS) == {"pydantic"}


@pytest.mark.few(2)
@pytest.mark.parametrize("scene", ["bladed-disk --frequency 755", "two-dof --frequency 1"])
def test_solve_loads_what_it_computes_with(scene: str) -> None:
    loaded = loaded_by("solve", *scene.split())
    assert "numba" in loaded
    assert loaded & (SERVICE | PICTURES | DESIGN | {"rich", "scipy.linalg", "scipy.sparse"}) == set()
    # Numba's tables of what can be compiled: machine code that is cached needs none of them.
    assert "numba.np.linalg" not in loaded
    assert "solver.continuation.kernels.pseudo_arclength" not in loaded


ENTRIES = [
    one
    for entry in TOP.values()
    for one in (entry.entries if isinstance(entry, CommandGroup) else [entry])
    if not one.group
]


@each("entry", ENTRIES)
def test_the_table_says_what_the_commands_say(entry: CommandEntry) -> None:
    """The summary in the list of commands is the first line of the command's own help."""
    text = inspect.getdoc(entry.function())
    assert text is not None
    assert entry.summary == text.splitlines()[0]
    loaded = Deferred(entry).load()
    assert loaded.name == entry.name
    assert ("key_file" in {parameter.name for parameter in loaded.params}) == entry.keyed


def test_lapack_comes_without_its_package() -> None:
    """A matrix too large for the kernels' own loop; afterwards the package is what it always is."""
    code = """
import sys
import numpy as np
from solver.jit.lapack import OWN_UP_TO, back_substitute, factorise
assert "scipy.linalg.cython_lapack" in sys.modules
n = OWN_UP_TO + 10
A = np.random.default_rng(1).normal(size=(n, n))
factors, pivots, x = A.copy(), np.zeros(n, np.int32), np.ones(n)
assert factorise(factors, n, pivots) == np.sign(np.linalg.det(A))
back_substitute(factors, n, pivots, x)
assert np.abs(A @ x - 1.0).max() < 1e-10
assert "scipy.linalg" not in sys.modules
before = sys.modules["scipy.linalg.cython_lapack"]
import scipy.linalg
from scipy.linalg import cython_lapack
assert cython_lapack is before
assert np.abs(scipy.linalg.solve(A, np.ones(n)) - x).max() < 1e-9 * np.abs(x).max()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def modules_after(code: str) -> set[str]:
    """The modules of a process that ran some code."""
    told = f"{code}; import sys; print(' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_what_serves_loads_no_numbers() -> None:
    """The computing is done in other processes: the one with the routes needs none of what they load."""
    loaded = modules_after("import service.http.server")
    assert loaded & (PICTURES | DESIGN | {"numba", "llvmlite", "scipy"}) == set()


def test_what_computes_loads_no_service() -> None:
    """What workers are forked off, and each of them: they talk to the service through pipes alone."""
    loaded = modules_after("import service.workers.preloaded, service.workers.worker")
    assert "numba" in loaded
    assert loaded & (SERVICE | PICTURES | {"service.settings.settings"}) == set()


PROCESS = "import sys; from service.cli import process; sys.exit(process())"


@pytest.mark.parametrize(
    ("status", "arguments"), [(0, "--version"), (2, "solve no-such-scene --frequency 1")]
)
def test_a_process_leaves_with_its_status_and_takes_nothing_apart(status: int, arguments: str) -> None:
    code = (
        "import sys; from service.cli import process\n"
        "class Held:\n    def __del__(self): print('taken apart')\n"
        "held = Held(); sys.exit(process())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments.split()], capture_output=True, text=True, check=False
    )
    assert done.returncode == status, done.stderr
    assert "taken apart" not in done.stdout


def test_what_a_command_registers_happens_at_its_end() -> None:
    code = (
        "import atexit, sys; import service.cli as cli\n"
        "def main():\n    atexit.register(print, 'registered')\n    return 3\n"
        "cli.main = main; sys.exit(cli.process())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (3, "registered\n")


def test_a_process_that_fails_shows_why() -> None:
    code = (
        "import sys; import service.cli as cli\n"
        "def main(): raise RuntimeError('broken')\n"
        "cli.main = main; sys.exit(cli.process())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "RuntimeError: broken" in done.stderr


def test_a_process_whose_output_nobody_reads_says_so() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PROCESS, "--help"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.wait(timeout=60) != 0
