"""The repository itself: pinned versions, no machine's addresses, the shape of the code."""

import ast
import json
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = ("stickslip", "solver", "optim", "service")
SOURCES = sorted(
    path
    for package in (*PACKAGES, "migrations")
    for path in (ROOT / package).rglob("*.py")
    if "tests" not in path.parts[-3:]
)
LONGEST_FILE = 600
LONGEST_FUNCTION = 60
STANDS_ALONE = {"checker.py": 820}  # is taken along as one file, with what looks at statements in it
# Put together here, so that this file does not hold what it looks for.
REGISTRIES = ("py" + "pi.org", "python" + "hosted.org", "/sim" + "ple", "index" + "-url", "find" + "-links",
              "ana" + "conda.org", "npm" + "js", "proxy.go" + "lang")  # fmt: skip


def tracked() -> list[Path]:
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("this is not a git working copy")
    listed = subprocess.run(
        ["git", "-c", f"safe.directory={ROOT}", "ls-files", "-z"],
        cwd=ROOT, capture_output=True, check=True, text=True,
    )  # fmt: skip
    return [ROOT / name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


def text_of(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return ""


def test_no_file_names_a_registry_or_a_machine() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {word}"
        for path in tracked()
        for word in REGISTRIES
        if word in text_of(path).lower()
    ]
    assert found == []


PINNED = re.compile(
    r"(?P<name>[A-Za-z0-9_.-]+)==[A-Za-z0-9_.]+( ; [^\n\\]+)?( \\\n    --hash=sha256:[0-9a-f]{64})+\n"
)


def pinned(part: str) -> list[str]:
    """The packages of a part, each with a version and the digests of its files."""
    text = (ROOT / "requirements" / f"{part}.txt").read_text(encoding="utf-8")
    assert PINNED.sub("", text) == ""
    return [canonicalize_name(one["name"]) for one in PINNED.finditer(text)]


def needed(wanted: list[str]) -> set[str]:
    """Every package that these requirements lead to, by what is installed here."""
    found, left = set(), [Requirement(one) for one in wanted]
    while left:
        need = left.pop()
        key = (canonicalize_name(need.name), frozenset(need.extras))
        if key not in found:
            found.add(key)
            own = (Requirement(one) for one in requires(need.name) or ())
            left += [one for one in own if applies(one, need.extras)]
    return {name for name, _ in found}


def applies(need: Requirement, extras: set[str]) -> bool:
    return need.marker is None or any(need.marker.evaluate({"extra": one}) for one in ("", *extras))


def test_every_dependency_is_pinned_with_what_it_needs() -> None:
    """An installation by digests takes nothing that is not listed, and no package is listed twice."""
    extras = PROJECT["project"]["optional-dependencies"]
    first = [*PROJECT["build-system"]["requires"], "numpy", "scipy", "numba", "pydantic"]
    own = [*PROJECT["project"]["dependencies"], *extras["fast"]]
    named = ("postgresql", "traces", "stores", "oidc", "pdf")
    image = [one for extra in named for one in extras[extra]]
    names: list[str] = []
    for part, wanted in (("kernels", first), ("package", own), ("image", image), ("dev", extras["dev"])):
        names += pinned(part)
        assert needed([one for one in wanted if applies(Requirement(one), set())]) - set(names) == set()
    assert len(names) == len(set(names))


def test_the_bill_of_materials_lists_what_is_installed() -> None:
    made = subprocess.run(
        [sys.executable, ROOT / "deploy" / "sbom.py"], capture_output=True, check=True, timeout=60
    )
    bill = json.loads(made.stdout)
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    names = [one["name"] for one in bill["components"]]
    assert set(names) >= {
        *pinned("kernels"),
        *pinned("package"),
        *pinned("image"),
        "three",
        "@codemirror/view",
    }
    assert "esbuild" not in names
    references = {one["bom-ref"] for one in bill["components"]}
    assert len(references) == len(names)
    needs = {one["ref"]: set(one["dependsOn"]) for one in bill["dependencies"]}
    assert set().union(*needs.values()) <= references
    own = needs[bill["metadata"]["component"]["bom-ref"]]
    assert {one.partition("@")[0] for one in own} >= {"pkg:pypi/numpy", "pkg:pypi/fastapi"}


def test_continuous_integration_runs_the_test_command() -> None:
    script = ROOT / ".ci" / "run"
    assert script.stat().st_mode & 0o111
    assert subprocess.run(["bash", "-n", script], check=False).returncode == 0
    assert "make test" in script.read_text(encoding="utf-8")
    assert "make test" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_changelog_knows_the_version() -> None:
    version = PROJECT["project"]["version"]
    assert f"## {version}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_code_keeps_its_shape() -> None:
    """Short files and functions, nothing left undone, no `assert` where a user's input is checked."""
    assert [f"{path.relative_to(ROOT)}: {word}" for path in SOURCES for word in misshapen(path)] == []


def misshapen(path: Path) -> Iterator[str]:
    """What a file has that it may not have."""
    text = path.read_text(encoding="utf-8")
    longest = STANDS_ALONE.get(path.name, LONGEST_FILE)
    if len(text.splitlines()) > longest:
        yield f"more than {longest} lines"
    yield from re.findall(r"\b(TODO|FIXME|XXX)\b", text)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and _length(node) > LONGEST_FUNCTION:
            yield f"{node.name} has more than {LONGEST_FUNCTION} lines"
        elif isinstance(node, ast.Assert):
            yield f"assert in line {node.lineno}"


def _length(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its docstring and its signature."""
    body = node.body[1:] if ast.get_docstring(node) is not None else node.body
    return 0 if not body else (body[-1].end_lineno or 0) - body[0].lineno + 1
