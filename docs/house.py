"""The house in numbers and as a map: ``docs/house.py [FOLDER]``, ``... --map FILE.svg``, ``... --trips``.

Read from the sources alone, nothing is imported: imports (run at once, run late inside a function, for types
alone), entries of the folders, lines; core (solver, optim, service) and lab apart. The map shows
the layers that import-linter keeps, highest first. Trips are made: which modules a computation goes through.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
import tomllib
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from html import escape
from itertools import pairwise
from pathlib import Path
from types import FrameType
from typing import Any

PACKAGES = ("solver", "optim", "service")
LAB = "stickslip/lab"
NUMERICS, SHELL = ("solver", "optim"), ("service", "migrations")
RUN = 6  # lines of the same shape that make a pair of duplicates
PARAMETERS = 14
COMMON = 8  # a run that stands in more places is an idiom, not a duplicate


class House:
    """The modules of the packages below a folder, and what each imports."""

    def __init__(self, root: Path) -> None:
        self.root = root
        found = [path for folder in (*PACKAGES, LAB) for path in _sources(root / folder)]
        self.files = {self._name(path): path for path in found}
        self.trees = {name: ast.parse(path.read_text("utf-8")) for name, path in self.files.items()}
        self.imports: dict[str, dict[str, str]] = {
            name: dict(self._imports(tree, name)) for name, tree in self.trees.items() if "." in name
        }

    def _name(self, path: Path) -> str:
        parts = path.relative_to(self.root).with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    def _imports(self, tree: ast.AST, own: str, kind: str = "at once") -> Iterator[tuple[str, str]]:
        """Yield each module imported with how; "at once" comes last, so that a dictionary keeps it."""
        found: list[tuple[str, str]] = []
        for node in ast.iter_child_nodes(tree):
            inner = kind
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
                inner = "late"
            elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
                inner = "for types"
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [f"{node.module}.{one.name}" for one in node.names]
                found += [(name if name in self.files else node.module, kind) for name in names]
            elif isinstance(node, ast.Import):
                found += [(one.name, kind) for one in node.names]
            found += self._imports(node, own, inner)
        order = ("for types", "late", "at once")
        for name, how in sorted(found, key=lambda pair: order.index(pair[1])):
            if name in self.files and name != own:
                yield name, how

    def circles(self, *kinds: str) -> list[set[str]]:
        """Modules that import each other in a circle, by imports of these kinds."""
        ahead = {
            name: {to for to, how in targets.items() if how in kinds and "." in to}
            for name, targets in self.imports.items()
        }
        reach = {name: _reached(ahead, name) for name in ahead}
        circles: list[set[str]] = []
        for name in ahead:
            if name in reach[name] and not any(name in circle for circle in circles):
                circles.append({other for other in reach[name] if name in reach.get(other, ())})
        return circles

    def depth(self) -> int:
        """Length of the longest chain of imports that run at once."""
        ahead = {n: [t for t, how in ts.items() if how == "at once"] for n, ts in self.imports.items()}
        known: dict[str, int] = {}

        def longest(name: str) -> int:
            if name not in known:
                known[name] = 0  # a circle counts once
                known[name] = 1 + max((longest(to) for to in ahead.get(name, ())), default=0)
            return known[name]

        return max(longest(name) for name in ahead)

    def entries(self) -> dict[str, int]:
        """Modules and folders of every folder with Python in it, ``__init__.py`` apart."""
        found: dict[str, set[str]] = defaultdict(set)
        for path in self.files.values():
            parts = path.relative_to(self.root).parts
            for upper, lower in pairwise(["/".join(parts[:n]) for n in range(1, len(parts) + 1)]):
                if not lower.endswith("__init__.py"):
                    found[upper].add(lower)
        return {name: len(inside) for name, inside in sorted(found.items())}

    def lines(self, *folders: str) -> int:
        """Lines of the sources below folders, tests apart."""
        return _lines_of(path for folder in folders for path in _sources(self.root / folder))

    def modules(self, *folders: str) -> int:
        """Modules below folders, `__init__` apart."""
        found = (path for folder in folders for path in _sources(self.root / folder))
        return sum(path.stem != "__init__" for path in found)

    def rooms(self) -> dict[str, int]:
        """Lines of every folder of the lab."""
        found = sorted(path for path in (self.root / LAB).glob("*/") if (path / "__init__.py").is_file())
        return {path.name: self.lines(f"{LAB}/{path.name}") for path in found}

    def page(self) -> int:
        """Lines of the page that are the project's own: scripts, styles, HTML."""
        page = self.root / "service" / "page"
        found = (path for end in ("js", "css", "html") for path in page.rglob(f"*.{end}"))
        return _lines_of(path for path in found if "vendor" not in path.parts)

    def tests(self) -> int:
        """Lines of the tests, those of the lab among them."""
        found = [*(self.root / "tests").rglob("*.py"), *(self.root / LAB).glob("*/tests/*.py")]
        return _lines_of(path for path in found if "data" not in path.parts)

    def pages(self) -> dict[str, int]:
        """What there is to read: pages of the documentation, their words, and those of the README."""
        texts = {path.name: path.read_text("utf-8") for path in (self.root / "docs").glob("*.md")}
        readme = (self.root / "README.md").read_text("utf-8")
        return {
            "pages": len(texts),
            "words": sum(len(text.split()) for text in texts.values()),
            "words of the README": len(readme.split()),
        }

    def commands(self) -> int:
        """Commands that `stickslip --help` lists."""
        (table,) = (
            node.value
            for node in self.trees["service.cli.table"].body
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "COMMANDS"
        )
        calls = (node for node in ast.walk(table) if isinstance(node, ast.Call))
        return sum(ast.unparse(call.func) in ("CommandEntry", "CommandGroup") for call in calls)

    def deepest(self) -> int:
        """Folders below the package that lies deepest."""
        return max(len(path.relative_to(self.root).parts) - 2 for path in self.files.values())

    def twice(self) -> tuple[int, int]:
        """How many names of classes, and of modules, stand for more than one."""
        classes = [
            node.name
            for tree in self.trees.values()
            for node in ast.walk(tree)
            if isinstance(node, ast.ClassDef)
        ]
        modules = [name.rpartition(".")[2] for name, path in self.files.items() if path.stem != "__init__"]
        return _repeated(classes), _repeated(modules)

    def with_many_parameters(self) -> list[str]:
        """Functions outside kernels that take `PARAMETERS` or more."""
        return [
            f"{name}.{node.name} {count}"
            for name, tree in self.trees.items()
            if "kernels" not in name.split(".") and not name.startswith("solver.jit")
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
            and (count := len(node.args.posonlyargs + node.args.args + node.args.kwonlyargs)) >= PARAMETERS
        ]

    def with_word(self, word: str) -> int:
        """Files of the packages, the page among them, that name something."""
        texts = (
            p for package in PACKAGES for end in ("py", "js") for p in (self.root / package).rglob(f"*.{end}")
        )
        return sum(bool(re.search(rf"\b{word}\b", path.read_text("utf-8"))) for path in texts)

    def reading_mu(self) -> int:
        """Modules of solver and optim that name the coefficient of friction."""
        named = (path for package in NUMERICS for path in _sources(self.root / package))
        return sum(bool(re.search(r"\bmu\b", path.read_text("utf-8"))) for path in named)

    def checks_of_laws(self) -> int:
        """``isinstance`` on a class of contact outside the modules of contacts."""
        law = r"\b(AnyContact|\w*Contact|GapSpring|PolynomialSpring)\b"
        return sum(
            bool(re.search(law, ast.unparse(node.args[1])))
            for name, tree in self.trees.items()
            if "contact" not in name.partition(".")[2].partition(".")[0]
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance"
        )

    def duplicates(self) -> int:
        """Pairs of places that share `RUN` or more lines of the same shape, names and numbers aside."""
        places: dict[tuple[str, ...], list[tuple[str, int]]] = defaultdict(list)
        for name, path in self.files.items():
            shapes = _shapes(path.read_text("utf-8"))
            for start in range(len(shapes) - RUN + 1):
                places[tuple(shapes[start : start + RUN])].append((name, start))
        shared: dict[tuple[str, str], set[int]] = defaultdict(set)
        for same in places.values():
            for i, (one, at) in enumerate(same if len(same) <= COMMON else ()):
                for other, elsewhere in same[i + 1 :]:
                    if one != other or abs(at - elsewhere) >= RUN:
                        shared[one, other].add(at)
        return len(shared)


def _sources(folder: Path) -> list[Path]:
    """The modules below a folder; tests that stand there are none."""
    return sorted(p for p in folder.rglob("*.py") if "tests" not in p.relative_to(folder).parts)


def _lines_of(paths: Iterable[Path]) -> int:
    return sum(len(path.read_text("utf-8").splitlines()) for path in paths)


def _repeated(names: list[str]) -> int:
    return sum(count > 1 for count in Counter(names).values())


def _reached(ahead: dict[str, set[str]], name: str) -> set[str]:
    seen: set[str] = set()
    front = [name]
    while front:
        for to in ahead.get(front.pop(), ()):
            if to not in seen:
                seen.add(to)
                front.append(to)
    return seen


def _shapes(text: str) -> list[str]:
    """The lines of code with names, texts and numbers left out; comments and docstrings are none."""
    lines: dict[int, list[str]] = defaultdict(list)
    before = tokenize.NEWLINE
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in (tokenize.COMMENT, tokenize.NL, tokenize.INDENT, tokenize.DEDENT):
            continue
        alone = token.type == tokenize.STRING and before == tokenize.NEWLINE
        if not alone and token.type != tokenize.NEWLINE:
            shape = {tokenize.NAME: "n", tokenize.STRING: "s", tokenize.NUMBER: "1"}.get(
                token.type, token.string
            )
            keyword = token.type == tokenize.NAME and token.string in _KEYWORDS
            lines[token.start[0]].append(token.string if keyword else shape)
        before = token.type
    return [" ".join(parts) for _, parts in sorted(lines.items()) if parts[0] not in ("import", "from")]


_KEYWORDS = {
    "def",
    "class",
    "if",
    "for",
    "while",
    "return",
    "with",
    "try",
    "import",
    "from",
    "in",
    "not",
    "and",
}


def report(house: House) -> list[tuple[str, str]]:
    """The measures of the house, each with its value."""
    entries = house.entries()
    largest = sorted(entries, key=lambda name: -entries[name])[:5]
    every = ("at once", "late", "for types")
    classes, modules = house.twice()
    return [
        ("solver + optim: lines, modules", f"{house.lines(*NUMERICS)}, {house.modules(*NUMERICS)}"),
        ("service + migrations: lines, modules", f"{house.lines(*SHELL)}, {house.modules(*SHELL)}"),
        ("lab: lines, modules", f"{house.lines(LAB)}, {house.modules(LAB)}"),
        ("lines of each folder of the lab", ", ".join(f"{name} {n}" for name, n in house.rooms().items())),
        ("lines of the page", str(house.page())),
        ("lines of the tests", str(house.tests())),
        ("commands", str(house.commands())),
        ("pages, words, words of the README", ", ".join(str(count) for count in house.pages().values())),
        ("names of classes twice", str(classes)),
        ("names of modules twice", str(modules)),
        (f"functions with {PARAMETERS} parameters", ", ".join(house.with_many_parameters()) or "none"),
        ("most entries in a folder", ", ".join(f"{name} {entries[name]}" for name in largest)),
        ("deepest folder below a package", str(house.deepest())),
        ("longest chain of imports", str(house.depth())),
        ("modules of solver and optim that read mu", str(house.reading_mu())),
        ("modules in circles, imports at once", str(sum(map(len, house.circles("at once"))))),
        ("modules in circles, late ones and those for types too", str(sum(map(len, house.circles(*every))))),
        ("files that name N0", str(house.with_word("N0"))),
        ("isinstance on contacts outside contacts", str(house.checks_of_laws())),
        (f"pairs of modules that share {RUN} lines of one shape", str(house.duplicates())),
    ]


def layers(root: Path) -> dict[str, list[str]]:
    """The layers of each package, highest first, as import-linter keeps them."""
    settings = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    return {
        package: [name for layer in contract["layers"] for name in re.split(r" *[:|] *", layer)]
        for package in (LAB, *reversed(PACKAGES))
        for contract in contracts
        if contract.get("containers") == [package.replace("/", ".")]
    }


def drawn(root: Path) -> str:
    """The map as SVG: a box for every layer with what its docstring says, highest first."""
    wide, high, x, y = 800, 26, 90, 10
    rows: list[str] = []
    for package, names in layers(root).items():
        title = package.rpartition("/")[2]
        rows.append(f'<text x="10" y="{y + 18}" class="package">{title}</text>')
        for name in names:
            folder = root / package / name
            source = folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")
            said = (ast.get_docstring(ast.parse(source.read_text("utf-8"))) or "").splitlines()[0]
            rows.append(f'<rect x="{x}" y="{y}" width="{wide}" height="{high - 4}" rx="3"/>')
            rows.append(f'<text x="{x + 8}" y="{y + 15}" class="layer">{name}</text>')
            rows.append(f'<text x="{x + 110}" y="{y + 15}">{escape(said)}</text>')
            y += high
        y += 14
    style = (
        "text{font:12px sans-serif;fill:#222}.package{font-size:15px;font-weight:bold}"
        ".layer{font-weight:bold}rect{fill:#eef4f8;stroke:#0072b2}"
    )
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {x + wide + 10} {y}" role="img">'
    title = "<title>Layers of the packages: each imports only what stands below it</title>"
    background = f'<rect width="{x + wide + 10}" height="{y}" style="fill:white;stroke:none"/>'
    return "\n".join([head, title, f"<style>{style}</style>", background, *rows, "</svg>", ""])


def trip(call: Callable[[], object]) -> tuple[int, int]:
    """How many modules of the numerics a call goes through, and functions in them."""
    modules, functions = set[str](), set[tuple[str, str]]()

    def entered(frame: FrameType, event: str, _argument: object) -> None:
        module = frame.f_globals.get("__name__", "")
        if event == "call" and module.partition(".")[0] in (*NUMERICS, "stickslip"):
            modules.add(module)
            functions.add((module, frame.f_code.co_qualname))

    sys.setprofile(entered)
    try:
        call()
    finally:
        sys.setprofile(None)
    return len(modules), len(functions)


def trips() -> Iterator[tuple[str, str]]:
    """What setting up and sweeping the smallest scene goes through, loaded before."""
    import solver
    from solver.balance.balance import build

    ways: dict[str, Callable[[Any], object]] = {"build": lambda scene: build(scene), "sweep": solver.sweep}
    for name, way in ways.items():
        way(solver.load_scene("two-dof"))  # what is loaded and compiled at first use is no part of the trip
        scene = solver.load_scene("two-dof")
        modules, functions = trip(lambda way=way, scene=scene: way(scene))
        yield f"{name} of two-dof: modules, functions", f"{modules}, {functions}"


def main() -> None:
    """Print the measures, or write the map."""
    root = Path(__file__).resolve().parent.parent
    if sys.argv[1:2] == ["--trips"]:
        sys.path.insert(0, str(root))
        for what, value in trips():
            print(f"{what:55} {value}")
        return
    if sys.argv[1:2] == ["--map"]:
        Path(sys.argv[2]).write_text(drawn(root), "utf-8")
        return
    for what, value in report(House(Path(sys.argv[1]) if sys.argv[1:] else root)):
        print(f"{what:55} {value}")


if __name__ == "__main__":
    main()
