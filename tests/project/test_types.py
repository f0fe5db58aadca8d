"""Types as a user's checker sees them: packages marked as typed, a script clean under the strictest rules."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

import optim
import solver

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


@pytest.mark.long
def test_a_script_of_a_user_is_clean_under_strict_rules(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    pytest.importorskip("xarray")
    source = tmp_path / SCRIPT.name
    source.write_text(SCRIPT.read_text("utf-8"), "utf-8")
    # As of an installed package, only what is wrong in the script itself is told.
    words = ["--strict", "--follow-imports", "silent", "--config-file", os.devnull, "--cache-dir", "cache"]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *words, source.name], cwd=tmp_path, capture_output=True, text=True,
        check=False, env={**os.environ, "MYPYPATH": str(SCRIPT.parent.parent.parent)},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
