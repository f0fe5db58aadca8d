"""The reference: it builds without a warning, and every public name has a docstring."""

from __future__ import annotations

import inspect
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
MODULES = ("solver", "optim", "service.client", "service.answers")


def public_names(module: str) -> list[str]:
    """Names of `__all__`, or those defined in the module itself."""
    loaded = import_module(module)
    if hasattr(loaded, "__all__"):
        return list(loaded.__all__)
    return [
        name
        for name, value in vars(loaded).items()
        if not name.startswith("_")
        and (inspect.isclass(value) or inspect.isfunction(value))
        and value.__module__ == module
    ]


NAMES = [(module, name) for module in MODULES for name in public_names(module)]


@pytest.mark.parametrize(("module", "name"), NAMES, ids=lambda value: value)
def test_every_public_name_has_a_docstring(module: str, name: str) -> None:
    found = getattr(import_module(module), name)
    assert own_docstring(found), f"{module}.{name} has no docstring"
    if not inspect.isclass(found):
        return
    members = [(key, value) for key, value in vars(found).items() if not key.startswith("_")]
    described = [
        (key, value)
        for key, value in members
        if inspect.isfunction(value) or isinstance(value, (property, classmethod, staticmethod))
    ]
    assert [key for key, value in described if not own_docstring(value)] == []


def own_docstring(found: object) -> str:
    """What was written; not what dataclasses put in its place."""
    text = found.__dict__.get("__doc__") if inspect.isclass(found) else found.__doc__
    generated = inspect.isclass(found) and (text or "").startswith(f"{found.__name__}(")
    return "" if generated else (text or "").strip()


def test_the_reference_builds_without_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the command of `make docs`; pytest makes warnings errors."""
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    main = pytest.importorskip("pdoc.__main__", reason="pdoc is not installed")
    recipe = subprocess.run(
        ["make", "--dry-run", "docs"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    (line,) = [line for line in recipe.stdout.splitlines() if " -m pdoc " in line]
    words = line.partition(" -m pdoc ")[2].split()
    assert tuple(words[-len(MODULES) :]) == MODULES
    words[words.index("site")] = str(tmp_path / "site")
    monkeypatch.setattr(sys, "argv", ["pdoc", *words])
    main.cli()
    for module, name in NAMES:
        page = (tmp_path / "site" / f"{module.replace('.', '/')}.html").read_text(encoding="utf-8")
        assert f'id="{name}"' in page, f"{module}.{name} is not in the reference"


def test_what_names_refer_to_exists_in_docstrings() -> None:
    """Names in backquotes that begin with a package of ours can be imported."""
    wrong = []
    for module, name in NAMES:
        text = own_docstring(getattr(import_module(module), name))
        for path in re.findall(r"`((?:solver|optim)\.[\w.]+)`", text):
            owner, _, last = path.rpartition(".")
            if not exists(owner, last):
                wrong.append(f"{module}.{name}: {path}")
    assert wrong == []


def exists(owner: str, last: str) -> bool:
    """Whether `owner.last` is a module, or a name of a module or class."""
    try:
        return hasattr(import_module(owner), last) or import_module(f"{owner}.{last}") is not None
    except ModuleNotFoundError:
        above, _, name = owner.rpartition(".")
        return bool(above) and hasattr(getattr(import_module(above), name, None), last)
