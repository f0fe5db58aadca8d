"""Each folder of the lab can be taken out: everything else loads, and answers without what it gave."""

import inspect
import os
import subprocess
import sys
from pathlib import Path

import pytest

from solver.lab import MissingRoomError, from_lab, rooms

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("solver", "optim", "service", "migrations")
GIVES = {
    "accuracy": ["study accuracy", "view accuracy"], "all_solutions": ["name solve_all"],
    "catalogue": ["name catalogue"], "controlled": ["study controlled"], "dask": [],
    "demo": ["command demo"], "exports": ["command export"], "ipopt": [],
    "limit_cycles": ["name limit_cycles"], "mcp": ["command mcp"], "oidc": ["view oidc"],
    "posterior": ["study posterior", "command posterior"],
    "proofs": ["command check-proof", "name certify"], "quasi_periodic": ["study quasi-periodic"],
    "stores": [], "templates": ["command new", "name new_scene"], "traces": [],
    "wear_life": ["study wear", "name wear_life", "view wear_life"], "widget": ["name explore"],
    "worst_mistuning": ["study worst-mistuning", "view worst_mistuning"],
}  # fmt: skip
"""What goes with each folder."""


def there() -> set[str]:
    """Names, studies, commands and views of what is loaded."""
    import re

    import optim
    import solver
    from service.cli.table import command
    from service.http.routes.page import files
    from service.jobs.kinds import SHIPPED

    names = {f"name {name}" for package in (solver, optim) for name in package.__all__}
    commands = {f"command {name}" for name in command().commands}
    views = {f"view {room}" for room in re.findall(r"view as (\w+)", files()["js/lab.js"].decode())}
    return names | commands | views | {f"study {kind.name}" for kind in SHIPPED}


_LOADED = f"""
import importlib, pkgutil
import optim, service, solver, stickslip
for package in (solver, optim, service, stickslip):
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if ".tests" not in found.name:
            importlib.import_module(found.name)
for package in (solver, optim, stickslip):
    for name in package.__all__:
        getattr(package, name)
from service.http.app import create_app
from service.settings.settings import Settings
assert create_app(Settings(database="sqlite:///lab.db")).openapi()["paths"]
assert solver.sweep("two-dof", harmonics=3).peak.value > 0.0
{inspect.getsource(there)}
print(*sorted(there()), sep="\\n")
"""


def without(room: str, folder: Path) -> Path:
    """A copy of the packages, by links, in which a folder of the lab is not there."""
    lab = folder / "stickslip" / "lab"
    lab.mkdir(parents=True)
    for name in PACKAGES:
        (folder / name).symlink_to(ROOT / name)
    for path in (ROOT / "stickslip").iterdir():
        if path.name != "lab":
            (folder / "stickslip" / path.name).symlink_to(path)
    for path in (ROOT / "stickslip" / "lab").iterdir():
        if path.name != room:
            (lab / path.name).symlink_to(path)
    return folder


def loaded(folder: Path) -> set[str]:
    """Names, studies and commands of the packages in a folder, all of whose modules load.

    Kernels are interpreted: without those of a folder all others would be compiled anew.
    """
    done = subprocess.run(
        [sys.executable, "-c", _LOADED], cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(folder), "STICKSLIP_KERNELS": "interpreted"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return set(done.stdout.splitlines())


def test_the_table_knows_every_folder() -> None:
    assert GIVES.keys() == rooms()


@pytest.mark.few(keep=["proofs"])
@pytest.mark.parametrize("room", sorted(GIVES))
def test_a_folder_can_go(room: str, tmp_path: Path) -> None:
    whole = there()
    assert {what for gone in GIVES.values() for what in gone} <= whole
    left = loaded(without(room, tmp_path))
    assert set(GIVES[room]) <= whole - left
    others = {what for other, gone in GIVES.items() if other != room for what in gone}
    assert others <= left


def test_what_is_not_there_says_so() -> None:
    with pytest.raises(MissingRoomError, match=r"this needs stickslip\.lab\.nowhere, which is not installed"):
        from_lab("nowhere.somewhere:name")
