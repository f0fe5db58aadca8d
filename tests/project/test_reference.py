"""The documentation site builds without a warning, and every public name has a docstring."""

import inspect
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "docs"))
from site_pages import MODULES, public_names  # noqa: E402


@cache
def names() -> list[tuple[str, str]]:
    return [(module, name) for module in MODULES for name in public_names(module)]


def test_every_public_name_has_a_docstring() -> None:
    assert [f"{module}.{name}" for module, name in names() if not own_docstring(named(module, name))] == []
    assert [member for module, name in names() for member in undescribed(named(module, name))] == []


def named(module: str, name: str) -> object:
    return getattr(import_module(module), name)


def undescribed(found: object) -> list[str]:
    """The public functions and properties of a class that have no docstring."""
    if not inspect.isclass(found):
        return []
    members = [(key, value) for key, value in vars(found).items() if not key.startswith("_")]
    described = (property, classmethod, staticmethod)
    return [
        f"{found.__qualname__}.{key}"
        for key, value in members
        if (inspect.isfunction(value) or isinstance(value, described)) and not own_docstring(value)
    ]


def own_docstring(found: object) -> str:
    """What was written; not what dataclasses put in its place."""
    text = found.__dict__.get("__doc__") if inspect.isclass(found) else found.__doc__
    generated = inspect.isclass(found) and (text or "").startswith(f"{found.__name__}(")
    return "" if generated else (text or "").strip()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `make docs` writes; links that lead nowhere and pages without a place are errors."""
    pytest.importorskip("material", reason="mkdocs-material is not installed")
    pytest.importorskip("pdoc", reason="pdoc is not installed")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=False,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr + done.stdout
    return folder


@pytest.mark.long
def test_the_site_builds_without_a_warning_and_has_every_public_name(site: Path) -> None:
    for module, name in names():
        page = (site / f"reference-{module.replace('.', '-')}.html").read_text(encoding="utf-8")
        assert re.search(rf'<h2 id="[\w-]+">{name}<', page), f"{module}.{name} is not in the reference"


@pytest.mark.long
def test_the_site_has_every_page_and_picture_and_can_be_searched(site: Path) -> None:
    pages = {path.stem for path in (ROOT / "docs").glob("*.md")} - {"index"}
    assert pages <= {path.stem for path in site.glob("*.html")}
    gallery = (site / "gallery.html").read_text(encoding="utf-8")
    for path in (ROOT / "docs").glob("*.md"):
        for picture in re.findall(r"!\[[^]]*\]\((img/[^)]+)\)", path.read_text(encoding="utf-8")):
            assert (site / picture).is_file()
            assert f'src="{picture}"' in gallery
    index = (site / "search" / "search_index.json").read_text(encoding="utf-8")
    for words in ("limit cycles", "underplatform", "nonlinear_mode"):
        assert words in index


@pytest.mark.long
def test_nothing_that_a_page_shows_or_links_is_missing(site: Path) -> None:
    pages = sorted(set(site.rglob("*.html")) - {site / "404.html"})
    assert {"index.html", "gallery.html", "design.html"} <= {path.name for path in pages}
    for path in pages:
        named = re.findall(r'<(?:a|img)\b[^>]*?\s(?:href|src)="([^"]+)"', path.read_text(encoding="utf-8"))
        there = [unquote(parts.path) for parts in map(urlsplit, named) if not parts.scheme and parts.path]
        assert there, path.name
        assert [name for name in there if not (path.parent / name).exists()] == [], path.name


@pytest.mark.long
def test_pages_open_with_their_pictures(site: Path) -> None:
    """In a real Chromium: the front, and the page with all pictures."""
    api = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
    program = shutil.which("chromium")
    if program is None:
        pytest.skip("chromium is not installed (Debian's package `chromium`)")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        page = browser.new_page(java_script_enabled=False)
        for name in ("index.html", "gallery.html"):
            page.goto((site / name).as_uri(), wait_until="load")
            broken = "images => images.filter(one => !one.naturalWidth).map(one => one.src)"
            assert page.eval_on_selector_all("img", broken) == []
        browser.close()


@pytest.mark.long
def test_the_site_needs_nothing_from_elsewhere(site: Path) -> None:
    """No fonts, styles or scripts of another server."""
    page = (site / "index.html").read_text(encoding="utf-8")
    loaded = re.findall(r'<(?:script|link|img)[^>]*(?:src|href)="([^"]+)"', page)
    assert loaded
    assert [path for path in loaded if "://" in path] == []


@pytest.mark.long
def test_parameters_read_as_they_are_written(site: Path) -> None:
    """With a type and without, and where a description goes on in the next line."""
    page = (site / "reference-stickslip.html").read_text(encoding="utf-8")
    text = " ".join(re.sub("<[^>]+>", "", page).split())
    for part in (
        "scene: what vibrates, with the values that stay fixed. ",
        "are chosen for; see solver.continuation.branches.adaptive_harmonics.harmonics_for for where",
        "frequency_hz (float): Excitation frequency [Hz].",
    ):
        assert part in text


def test_make_builds_it() -> None:
    """And fails for a warning, such as a link that leads nowhere: what is not told is not counted either."""
    (line,) = re.findall(r".*mkdocs build.*", (ROOT / "Makefile").read_text(encoding="utf-8"))
    assert "--strict" in line
    assert "--quiet" not in line


def test_what_names_refer_to_exists_in_docstrings() -> None:
    """Names in backquotes that begin with a package of ours can be imported."""
    wrong = []
    for module, name in names():
        text = own_docstring(named(module, name))
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
