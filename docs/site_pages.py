"""What the documentation site has beside the pages of this folder: README, navigation, gallery, reference.

A hook of MkDocs (`mkdocs.yml`). Navigation is the list of index.md, so that a page is named once; the
reference is made from the docstrings of the public names, the gallery from the pictures of all pages.
"""

from __future__ import annotations

import inspect
import posixpath
import re
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from pdoc.docstrings import convert

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
SUBJECTS = sorted(f"stickslip.{path.stem}" for path in (ROOT / "stickslip").glob("[!_]*.py"))
MODULES = ("stickslip", *SUBJECTS, "service.client", "service.schemas.answers")
_SECTION = re.compile(r"^## (.+)$")
_ENTRY = re.compile(r"^- \[(?P<title>[^]]+)\]\((?P<page>[\w-]+\.md)\)")
OUTSIDE = (
    "README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "LICENSE", "CITATION.cff",
    "tests/README.md", "deploy/stickslip.service", "deploy/stickslip.env.example", "deploy/compose.yaml",
    "deploy/nginx.conf", "deploy/Caddyfile", "deploy/alerts.yaml", "deploy/grafana.json",
    *(str(path.relative_to(ROOT)) for path in sorted((ROOT / "benchmarks").rglob("*.md"))),
)  # fmt: skip
_LINK = re.compile(r"(?<=\]\()(?P<target>[^)#:]+)(?=[)#])")
VIEWS = "img/page/views"
_PICTURE = re.compile(r"!\[(?P<words>[^]]*)\]\((?P<path>img/[\w./-]+\.(?:png|svg))\)")
# pdoc takes what stands behind a colon for a type. Here it is one where a sentence follows on the next line,
# and the description itself otherwise.
_ITEM = re.compile(r"^( - \*\*.+?\*\*) \((.*)\):\n(?:   (?![A-Z|‖]))?(?!   [A-Z|‖])", re.MULTILINE)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Take the navigation from index.md, and put overview, gallery and reference beside it."""
    sections: list[Any] = [{"Overview": "index.md"}, {"Gallery": "gallery.md"}]
    entries: list[dict[str, str]] = []
    for line in (ROOT / "docs" / "index.md").read_text(encoding="utf-8").splitlines():
        if (title := _SECTION.match(line)) is not None:
            entries = []
            sections.append({title[1]: entries})
        elif (entry := _ENTRY.match(line)) is not None:
            entries.append({entry["title"]: entry["page"]})
    entries += [{module: _page(module)} for module in MODULES]
    entries += [{"Changes": "CHANGELOG.md"}, {"Contributing": "CONTRIBUTING.md"}, {"Security": "SECURITY.md"}]
    entries.append({"Tests": "tests/README.md"})
    sections.append({"Measured": [{title: page} for title, page in _measured()]})
    config.nav = sections
    return config


def _measured() -> Iterator[tuple[str, str]]:
    """Title and page of what was measured."""
    for name in OUTSIDE:
        if name.startswith("benchmarks/"):
            yield (ROOT / name).read_text(encoding="utf-8").splitlines()[0].lstrip("# "), name


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are made here."""
    if (listed := files.get_file_from_path("index.md")) is not None:
        files.remove(listed)  # the navigation says what it lists; a site begins with the overview
    for name, text in made().items():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Point links at what the site has of the files of the repository."""
    here = page.file.src_uri
    folder = posixpath.dirname(_in_repository(here))

    def in_site(link: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(folder, link["target"]))
        return posixpath.relpath(_in_site(target), posixpath.dirname(here) or ".")

    return _LINK.sub(in_site, markdown)


def _in_repository(page: str) -> str:
    """Where a page of the site stands in the repository."""
    if page == "index.md":
        return "README.md"
    return page if page in OUTSIDE else f"docs/{page}"


def _in_site(file: str) -> str:
    """Where the site has a file of the repository; the list of pages is its navigation."""
    return "index.md" if file in ("README.md", "docs/index.md") else file.removeprefix("docs/")


def made() -> dict[str, str]:
    """Return what is made here or stands outside docs/, by name."""
    found = {_in_site(name): (ROOT / name).read_text(encoding="utf-8") for name in OUTSIDE}
    found["gallery.md"] = gallery()
    return found | {_page(module): reference(module) for module in MODULES}


def gallery() -> str:
    """Return every picture of the pages, under the title of its page, and every view of the web page."""
    parts = ["# Gallery\n", "Every picture of these pages; each is drawn by the command on its page.\n"]
    for path in sorted((ROOT / "docs").glob("*.md")):
        text = path.read_text(encoding="utf-8")
        pictures = list(_PICTURE.finditer(text))
        if pictures:
            parts.append(f"## [{text.splitlines()[0].lstrip('# ')}]({path.name})\n")
            parts += [f"{one[0]}\n" for one in pictures]
    parts.append("## Every view of the page, light and dark, and in three smaller windows\n")
    views = sorted((ROOT / "docs" / VIEWS).glob("*.png"))
    parts += [f"![{view.stem.replace('-', ' ')}]({VIEWS}/{view.name})\n" for view in views]
    return "\n".join(parts)


def reference(module: str) -> str:
    """Return the page of the public names of a module."""
    loaded = import_module(module)
    parts = [f"# {module}\n", f"{convert(inspect.getdoc(loaded) or '', 'numpy', None)}\n"]
    for name in public_names(module):
        found = getattr(loaded, name)
        parts += [f"## {name}\n", f"```python\n{_signature(name, found)}\n```\n", _described(found)]
        if inspect.isclass(found):
            for member, text in _members(found):
                parts.append(f"**`{member}`**: {text}\n")
    return "\n".join(parts)


def public_names(module: str) -> list[str]:
    """Return the names a package gives, or those a module gives or passes on: classes and functions."""
    loaded = import_module(module)
    offered = {name: getattr(loaded, name) for name in getattr(loaded, "__all__", vars(loaded))}
    return [
        name
        for name, value in offered.items()
        if name.isidentifier()  # not what a generic class leaves there of each of its kinds
        and not name.startswith("_")
        and (inspect.isclass(value) or inspect.isfunction(value))
        and (value.__module__ == module or module.startswith("stickslip") or hasattr(loaded, "__all__"))
    ]


WIDTH = 88  # characters of a line of a signature


def _members(found: type) -> Iterator[tuple[str, str]]:
    """Return the public methods and properties of a class, with their descriptions."""
    for name, value in vars(found).items():
        if name.startswith("_"):
            continue
        inner = value.__func__ if isinstance(value, (classmethod, staticmethod)) else value
        if inspect.isfunction(inner) or isinstance(inner, property):
            yield name if isinstance(inner, property) else f"{name}()", _described(inner)


def _signature(name: str, found: object) -> str:
    try:
        signature = inspect.signature(found)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return name
    if inspect.isclass(found):
        signature = signature.replace(return_annotation=signature.empty)
    # Annotations are texts: their quotes say nothing to a reader.
    text = f"{name}{signature}".replace("'", "")
    if len(text) <= WIDTH:
        return text
    rows = "".join(f"    {each},\n" for each in _parameters(signature)).replace("'", "")
    result = "" if signature.return_annotation is signature.empty else f" -> {signature.return_annotation}"
    return f"{name}(\n{rows}){result}".replace("'", "")


def _parameters(signature: inspect.Signature) -> list[str]:
    """Return the parameters as they are written, with the star before those that have to be named."""
    rows: list[str] = []
    for each in signature.parameters.values():
        if each.kind is each.KEYWORD_ONLY and not any(row.startswith("*") for row in rows):
            rows.append("*")
        rows.append(str(each))
    return rows


def _described(found: object) -> str:
    """Return a docstring as Markdown, its headings as bold words."""
    plain = convert(inspect.getdoc(found) or "", "numpy", None)
    text = _ITEM.sub(r"\1: \2\n", plain)
    return re.sub(r"^#+ (.+)$", r"**\1**\n", text, flags=re.MULTILINE) + "\n"


def _page(module: str) -> str:
    return f"reference-{module.replace('.', '-')}.md"
