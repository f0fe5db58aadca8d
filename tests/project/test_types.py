"""Types as a user's checker sees them: packages marked as typed, a script clean under the strictest rules."""

import inspect
import os
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

import optim
import solver
import stickslip

SCRIPT = Path(__file__).resolve().parent.parent / "data" / "user_types.py"


@pytest.mark.parametrize("package", ["solver", "optim", "service"])
def test_the_packages_say_that_they_are_typed(package: str) -> None:
    assert files(package).joinpath("py.typed").is_file()


@pytest.mark.parametrize("package", [solver, optim], ids=["solver", "optim"])
def test_public_functions_have_types_and_a_text(package: object) -> None:
    """What an editor shows beside the cursor."""
    for name in package.__all__:  # type: ignore[attr-defined]
        public = getattr(package, name)
        assert inspect.getdoc(public), name
        if inspect.isfunction(public):
            signature = inspect.signature(public)
            bare = [p.name for p in signature.parameters.values() if p.annotation is inspect.Parameter.empty]
            assert (bare, signature.return_annotation is inspect.Signature.empty) == ([], False), name


WRONG = """import optim
import solver
scene = solver.load_scene("two-dof")
bounds = {"damper.N0": (20, 1000)}
optim.design(scene, variabels=bounds)
optim.design(scene, variables=["damper.N0"])
optim.design(scene, method="trakced")
optim.robust_design(scene, uncertain={"damper.mu": [0.2, 0.4]}, max_peak="1e-4")
optim.pareto_front(scene, variables=bounds, max_band_hz=3.0)
optim.design(scene, variables=bounds, limit=1e-4, method="minimax", weights={"peak": 1, "band": 1e-6})
"""


def mypy(source: str, folder: Path) -> str:
    """What mypy says of a user's script under its strictest rules, as of an installed package."""
    pytest.importorskip("mypy")
    (folder / "script.py").write_text(source, "utf-8")
    # Only what is wrong in the script itself is told.
    words = ["--strict", "--follow-imports", "silent", "--config-file", os.devnull, "--cache-dir", "cache"]
    return subprocess.run(
        [sys.executable, "-m", "mypy", *words, "script.py"], cwd=folder, capture_output=True, text=True,
        check=False, env={**os.environ, "MYPYPATH": str(SCRIPT.parent.parent.parent)},
    ).stdout  # fmt: skip


@pytest.mark.long
def test_a_script_of_a_user_is_clean_under_strict_rules(tmp_path: Path) -> None:
    pytest.importorskip("xarray")
    told = mypy(SCRIPT.read_text("utf-8"), tmp_path)
    assert told.startswith("Success"), told


@pytest.mark.long
def test_a_checker_finds_wrong_keywords_and_types(tmp_path: Path) -> None:
    told = mypy(WRONG, tmp_path).splitlines()
    found = {int(line.split(":")[1]): line for line in told if " error: " in line}
    assert sorted(found) == [5, 6, 7, 8, 9]
    assert 'Unexpected keyword argument "variabels"' in found[5]
    assert 'Unexpected keyword argument "max_band_hz"' in found[9]
    for line, argument in ((6, "variables"), (7, "method"), (8, "max_peak")):
        assert f'Argument "{argument}"' in found[line]


@pytest.mark.long
def test_a_checker_knows_every_name_and_no_other(tmp_path: Path) -> None:
    given = [*stickslip.__all__, "__version__", "disks.mistuned", "modes.NonlinearMode", "branches.AnyBranch"]
    names = "\n".join(f"stickslip.{name}" for name in given)
    known = f"import stickslip\nfrom stickslip import Scene, solve\n{names}\n"
    assert mypy(known, tmp_path).startswith("Success")
    assert 'has no attribute "solv"' in mypy("import stickslip\nstickslip.solv\n", tmp_path)
