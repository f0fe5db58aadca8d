"""The reference: it builds without a warning, and every public name has a docstring."""

from __future__ import annotations

import inspect
import re
import runpy
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
SCRIPT = ROOT / "docs" / "reference.py"
MODULES = ("solver", "optim", "service.client", "service.schemas.answers")


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


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `make docs` writes; pytest makes warnings errors."""
    pytest.importorskip("pdoc", reason="pdoc is not installed")
    folder = tmp_path_factory.mktemp("site")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [str(SCRIPT), str(folder)])
        runpy.run_path(str(SCRIPT), run_name="__main__")
    return folder


def test_the_reference_builds_without_a_warning(site: Path) -> None:
    for module, name in NAMES:
        page = (site / f"{module.replace('.', '/')}.html").read_text(encoding="utf-8")
        assert f'id="{name}"' in page, f"{module}.{name} is not in the reference"


def test_parameters_read_as_they_are_written(site: Path) -> None:
    """With a type and without, and where a description goes on in the next line."""
    page = (site / "solver.html").read_text(encoding="utf-8")
    text = " ".join(re.sub("<[^>]+>", "", page).split())
    for part in (
        "scene: what vibrates, with the values that stay fixed. ",
        "are chosen for; see solver.continuation.branches.adaptive_harmonics.harmonics_for for where",
        "frequency_hz (float): Excitation frequency [Hz].",
    ):
        assert part in text


def test_make_builds_it() -> None:
    assert "$(BIN)/python docs/reference.py site" in (ROOT / "Makefile").read_text(encoding="utf-8")


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
