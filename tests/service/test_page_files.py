"""The page as files: its policy, what is kept for how long, nothing from elsewhere, nothing dangerous."""

import gzip
import re
from pathlib import Path

import httpx
import pytest
from each import each
from service_helpers import ServedClient, is_problem

from service.http import made_once
from service.http.routes import page
from service.http.routes.page import bundle
from solver.results.known import FLAGS

FOLDER = Path(page.__file__).resolve().parents[2] / "page"
LAB = FOLDER.parents[1] / "stickslip" / "lab"
OF_LAB = sorted(LAB.glob("*/view.js"))
MODULES = [*sorted((FOLDER / "js").rglob("*.js")), *OF_LAB]
LONGEST_FILE = 400
MOST_COMPRESSED = 600_000  # of them CodeMirror 114 and three.js 135, loaded on demand
MOST_AT_FIRST = 192_000
ON_DEMAND = {"codemirror.js", "three.js"}


def test_the_page_and_its_files_are_served_under_a_strict_policy(shipped: httpx.Client) -> None:
    found = shipped.get("/")
    assert found.headers["content-type"] == "text/html; charset=utf-8"
    assert found.headers["cache-control"] == "no-cache"
    policy = dict(part.strip().split(" ", 1) for part in found.headers["content-security-policy"].split(";"))
    assert policy["default-src"] == "'self'"
    assert "unsafe" not in found.headers["content-security-policy"]
    addresses = re.findall(r'(?:href|src)="([^"#]+)"', found.text)
    assert all(address.startswith("/") for address in addresses)
    files = [address for address in addresses if address.startswith("/page/")]
    named = {address.rpartition("/")[2] for address in files}
    assert named == {"icon.svg", "page.css", "page.js", "d3.js"}  # the rest is in them, or asked for later
    for address in files:
        answer = shipped.get(address)
        assert answer.status_code == 200
        assert "immutable" in answer.headers["cache-control"]
        again = shipped.get(address, headers={"If-None-Match": answer.headers["etag"]})
        assert again.status_code == 304


def test_a_file_of_another_version_is_not_kept(shipped: httpx.Client) -> None:
    answer = shipped.get("/page/0123/js/main.js")
    assert answer.status_code == 200
    assert answer.headers["cache-control"] == "no-cache"


@pytest.mark.parametrize(
    "path", ["js/none.js", "index.html", "..%2froutes%2fpage.py", "js%2f..%2f..%2fcore.py", "js"]
)
def test_nothing_else_is_served(shipped: httpx.Client, path: str) -> None:
    is_problem(shipped.get(f"/page/0123/{path}"), 404)


def modules_in(script: str) -> list[str]:
    """The modules that a script of the page is made of."""
    return re.findall(r"^// (js/\S+\.js)$", page.files()[script].decode(), flags=re.MULTILINE)


def test_the_two_scripts_and_the_sheet_are_every_module_and_sheet_once() -> None:
    served = {name: data.decode() for name, data in page.files().items()}
    own = [path.relative_to(FOLDER).as_posix() for path in MODULES if FOLDER in path.parents]
    own = [path for path in own if "/vendor/" not in path]
    lab = ["js/lab.js", *(f"js/lab/{path.parent.name}.js" for path in OF_LAB)]
    at_first, later = modules_in("js/page.js"), modules_in("js/later.js")
    assert sorted(at_first + later) == sorted(own + lab)
    assert at_first[-1] == "js/main.js"
    assert {"js/editor/editor.js", "js/editor/tables.js", "js/scene/matrices.js"} <= set(later)
    sheets = [path.read_text("utf-8") for path in (FOLDER / "css").glob("*.css")]
    assert all(sheet in served["css/page.css"] for sheet in sheets)
    assert len(served["css/page.css"]) == sum(map(len, sheets))


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        (
            'import { b } from "./b.js";\n',
            'import { a } from "./a.js";\n',
            "imports itself: a.js → b.js → a.js",
        ),
        ('import { b } from "./c.js";\n', "", "'c.js' is not there"),
        ('import b from "./b.js";\n', "", "no import of names"),
        ('import { b } from "./b.js";\n', "export default 1;\n", "no export of a declaration"),
        ('import("./b.js");\n', 'import { a } from "./a.js";\n', "imports itself: a.js → b.js → a.js"),
        ('import("./c.js");\n', "", "'c.js' is not there"),
        (
            'import { b } from "./b.js";\nimport("./b.js");\n',
            "",
            "'b.js' is imported at once and on demand",
        ),
    ],
)
def test_a_module_that_cannot_be_put_with_the_others_is_named(a: str, b: str, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        bundle({"a.js": a, "b.js": b}, "a.js")


def test_the_recipe_of_a_view_is_one_file_and_a_line() -> None:
    told = (FOLDER.parents[1] / "CONTRIBUTING.md").read_text("utf-8")
    (recipe,) = re.findall(r"^```js\n(.*?)^```$", told, flags=re.MULTILINE | re.DOTALL)
    texts = {path: data.decode() for path, data in page.files().items() if path.endswith(".js")}
    views = texts["js/views.js"].replace("VIEWS = [", "VIEWS = [frequencies, ")
    views = views.replace("\nimport ", '\nimport { frequencies } from "./views/frequencies.js";\nimport ', 1)
    made = bundle(texts | {"js/views.js": views, "js/views/frequencies.js": recipe}, "js/main.js")
    assert "// js/views/frequencies.js\n" in made["js/page.js"]
    known = texts["js/views/view.js"].partition("export function view(")[0]
    for key in re.findall(r"(?:^  |, )(\w+)(?=: )", recipe, flags=re.MULTILINE):
        assert re.search(rf"\b{key}\b", known), key


def test_the_page_has_words_for_every_flag() -> None:
    text = (FOLDER / "js" / "base" / "format.js").read_text(encoding="utf-8")
    told = dict(re.findall(r'^  (\w+): "(.*)",$', text, flags=re.MULTILINE))
    assert told.keys() == FLAGS.keys()
    assert told["not_unique"] == FLAGS["not_unique"]


@each("path", MODULES)
def test_modules_are_short_and_put_no_data_into_markup(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST_FILE
    assert text.startswith("// ")
    for word in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "new Function"):
        assert word not in text
    assert not re.search(r"https?://(?!www\.w3\.org/)", text)


@pytest.mark.parametrize("name", ["d3.js", "codemirror.js", "three.js"])
def test_what_is_from_others_says_whose_it_is_and_how_it_is_made(name: str) -> None:
    folder = FOLDER / "js" / "vendor"
    head, told = ((folder / each).read_text("utf-8") for each in (name, "README.md"))
    (told,) = [part for part in re.split(r"\n`(?=\w)", told) if part.startswith(f"{name}`")]
    plain = head.replace("\n// ", " ")
    assert "Permission " in plain
    assert "to use, copy, modify" in plain
    (installed,) = re.findall(r"^npm install (.*)$", told, flags=re.MULTILINE)
    for package, version in re.findall(r"(\S+)@([\d.]+)", installed.partition(" esbuild")[0]):
        assert f"{package} {version}" in plain
    (exported,) = re.findall(r"export\{([^{}]*)\};?\s*$", head)
    names = {each.rpartition(" as ")[2] for each in exported.split(",")}
    wanted = re.findall(r"^export \{ (.*?) \} from", told, flags=re.MULTILINE)
    assert names == {name for each in wanted for name in each.split(", ")}
    texts = {path: path.read_text("utf-8") for path in MODULES if path.parent != folder}
    users = {path.parent for path, text in texts.items() if f"vendor/{name}" in text}
    used = "".join(text for path, text in texts.items() if path.parent in users)
    assert all(re.search(rf"\b{name}\b", used) for name in names), "nothing is carried that is not used"


def luminance(colour: str) -> float:
    """The relative luminance of a colour, by WCAG 2."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_the_colours_of_the_text_of_a_scene_can_be_read() -> None:
    base = (FOLDER / "css" / "base.css").read_text("utf-8")
    pane = (FOLDER / "js" / "editor" / "toml_pane.js").read_text("utf-8")
    used = re.findall(r'tag: .*? color: "var\((--[\w-]+)\)"', pane)
    assert len(used) >= 5
    (below,) = re.findall(r'"&": .*backgroundColor: "var\((--[\w-]+)\)"', pane)
    tokens = re.findall(r"(--[\w-]+): light-dark\((#[0-9a-f]{6}), (#[0-9a-f]{6})\);", base)
    for theme in ({name: pair[i] for name, *pair in tokens} for i in range(2)):
        ground = luminance(theme[below])
        for name in used:
            light, dark = sorted((luminance(theme[name]), ground), reverse=True)
            assert (light + 0.05) / (dark + 0.05) >= 4.5, f"{name} {theme[name]} on {theme[below]}"


def test_the_code_of_the_page_is_small() -> None:
    files = [path for path in FOLDER.rglob("*") if path.suffix in (".js", ".css", ".html", ".svg")] + OF_LAB
    assert {"main.js", "index.html", "base.css"} <= {path.name for path in files}
    sizes = {path: len(gzip.compress(path.read_bytes())) for path in files}
    assert sum(sizes.values()) <= MOST_COMPRESSED
    later = {FOLDER / path for path in modules_in("js/later.js")} | {
        FOLDER / "js/vendor" / name for name in ON_DEMAND
    }
    assert sum(size for path, size in sizes.items() if path not in later) <= MOST_AT_FIRST


def test_markup_has_no_inline_scripts_or_styles() -> None:
    text = (FOLDER / "index.html").read_text(encoding="utf-8")
    assert "<style" not in text
    assert " style=" not in text
    assert not re.search(r"\son[a-z]+=", text)
    assert not re.search(r"<script(?![^>]*\ssrc=)", text)


CONSTANT = ["/", "/docs", "/docs/style.css", "/openapi.json", "/v1/kinds", "/v1/laws", "/v1/templates",
            "/v1/scenes-schema", "/page/0/js/page.js", "/page/0/css/page.css"]  # fmt: skip


@pytest.mark.parametrize("path", CONSTANT)
def test_what_is_constant_is_made_and_packed_once(
    shipped: ServedClient, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = shipped.get(path, headers={"Accept-Encoding": "gzip;q=0, br"})
    assert "content-encoding" not in plain.headers
    monkeypatch.setattr(made_once.Constant, "_whole", None)  # nothing is made anew
    packed = shipped.get(path)
    assert packed.content == plain.content
    if len(plain.content) >= 1000:
        assert packed.headers["content-encoding"] == "gzip"
        assert packed.headers["etag"] != plain.headers["etag"]
        assert "Accept-Encoding" in packed.headers["vary"]
    for answer in (plain, packed):
        coding = {"Accept-Encoding": answer.headers.get("content-encoding", "identity")}
        known = f'"other", W/{answer.headers["etag"]}'
        again = shipped.get(path, headers={"If-None-Match": known, **coding})
        assert (again.status_code, again.content) == (304, b"")
