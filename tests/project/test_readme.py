"""The README and the pages of docs/: every snippet runs as it stands."""

from __future__ import annotations

import importlib
import json
import re
import shlex
import shutil
import subprocess
import tomllib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np
import pytest
from each import each
from matrix_cases import beam, hb_text
from scipy import sparse
from scipy.io import mmwrite
from sector_cases import as_matrices, sector_matrices

import optim
import solver
from service.cli import main
from service.cli.options.problem_inputs import OPTIONS
from service.cli.table import Deferred, command
from service.jobs.kind_registry import ABOUT_THE_RUN
from service.jobs.strict_json import validated
from service.jobs.studies.design_study import Design
from service.settings.settings import Settings
from solver.contacts.laws.law_registry import laws, unregister

ROOT = Path(__file__).resolve().parent.parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
ADDRESS = "http://127.0.0.1:8000"
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
MEASURED = [*sorted((ROOT / "benchmarks").rglob("*.md")), ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md"]
# Pages whose lines need each other, or draw pictures: tests that run them.
ELSEWHERE = {
    "identification.md": "project/test_identification.py",
    "fe-disk.md": "project/test_fe_disk.py",
    "fe-example.md": "project/test_fe_example.py",
}
BLOCKS = [
    block
    for page in PAGES
    if page.name not in ELSEWHERE
    for block in re.findall(r"^```(\w+)\n(.*?)^```$", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
]
COMMANDS = dict.fromkeys(line for language, text in BLOCKS if language == "sh" for line in text.splitlines())
NO_MODULES = {"stickslip.db", "stickslip.audit"}  # a file and a logger
ELSEWISE = ("make ", "export ", "curl ")  # beginnings of lines that are no command of ours
# What takes seconds and has tests of its own: long; by default the words of a command are read.
DEAR = re.compile(
    r"stickslip (wear|margin|design --problem|accuracy|(map|peaks) bladed-disk)|weights=\{\"utilisation\""
)
LONGEST_README = 250


def blocks(language: str) -> list[str]:
    return [text for name, text in BLOCKS if name == language]


def matrix_files(folder: Path) -> set[str]:
    """The matrices the pages speak of, of a beam of 50 elements; their names."""
    M, K = beam(50, EI=1000.0)
    mmwrite(folder / "beam-M.mtx", sparse.coo_array(M), symmetry="symmetric")
    (folder / "beam-K.rsa").write_text(hb_text(K, "RSA"))
    return {"beam-M.mtx", "beam-K.rsa"}


def mesh_files(folder: Path) -> set[str]:
    """The block on a face of four nodes of another one that the pages speak of; names of its files."""
    nodes = [*range(1, 5), *range(101, 105), 812]
    mmwrite(folder / "M.mtx", sparse.eye_array(3 * len(nodes)).tocoo(), symmetry="symmetric")
    mmwrite(folder / "K.mtx", 1e6 * sparse.eye_array(3 * len(nodes)).tocoo(), symmetry="symmetric")
    (folder / "model.dof").write_text("".join(f"{node}.{axis}\n" for node in nodes for axis in (1, 2, 3)))
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    places = [f"{first + i}, {x}, 0, {z}" for first in (1, 101) for i, (x, z) in enumerate(corners)]
    lines = ["*NODE", *places, "812, 0, 1, 0", "*NSET, NSET=BLADE", "1, 2, 3, 4", "*NSET, NSET=DISK"]
    (folder / "model.inp").write_text("\n".join([*lines, "101, 102, 103, 104"]) + "\n")
    return {"M.mtx", "K.mtx", "model.dof", "model.inp"}


def test_every_language_is_looked_at() -> None:
    """A block in another language needs a test of its own."""
    assert {language for language, _ in BLOCKS} <= {"sh", "python", "toml", "json"}


def test_json_and_toml_are_read() -> None:
    """Descriptions of scenes, problems and jobs; what a table of TOML is part of, a test below knows."""
    assert all(json.loads(text) for text in blocks("json"))
    assert all(tomllib.loads(text) for text in blocks("toml"))
    starts = {next(line for line in text.splitlines() if not line.startswith("#")) for text in blocks("toml")}
    known = (
        "name = ",
        "scene = ",
        "[structure]",
        "[structure.mistuning]",
        "[structure.parts]",
        "[[contacts]]",
    )
    known += ("[[dampers]]", "[[recovery]]")
    assert [start for start in starts if not start.startswith(known)] == []


@pytest.mark.parametrize("line", [line for line in COMMANDS if line.startswith("make ")])
def test_make_knows_the_targets(line: str) -> None:
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    done = subprocess.run([*shlex.split(line), "--dry-run"], cwd=ROOT, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("line", [line for line in COMMANDS if line.startswith("export ")])
def test_exports_are_settings(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    given = dict(word.split("=", 1) for word in shlex.split(line)[1:])
    for name, value in given.items():
        monkeypatch.setenv(name, value)
    read = Settings().model_fields_set
    assert {f"STICKSLIP_{name.upper()}" for name in read} >= set(given)


@pytest.mark.parametrize("line", [line for line in COMMANDS if line.startswith("curl ")])
def test_requests_are_answered(line: str, server: str, tmp_path: Path) -> None:
    if shutil.which("curl") is None:
        pytest.skip("curl is not installed")
    matrix_files(tmp_path)
    words = [*shlex.split(line.replace(ADDRESS, server)), "--fail", "--silent", "--show-error"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)


def cases(texts: Iterable[str]) -> list[Any]:
    """Of each text a case; what is dear is long."""
    return [pytest.param(text, marks=pytest.mark.long if DEAR.search(text) else ()) for text in texts]


@pytest.mark.parametrize("line", [line for line in COMMANDS if DEAR.search(line)])
def test_words_of_dear_commands_are_read(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    name, *words = shlex.split(line)[1:]
    one = command().commands[name]
    assert isinstance(one, Deferred)
    assert one.load().make_context(name, list(words)).params["plot"] in (None, *words)


@pytest.mark.parametrize("line", cases(line for line in COMMANDS if not line.startswith(ELSEWISE)))
def test_commands_run(
    line: str, request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = shlex.split(line)
    assert words[0] == "stickslip"
    monkeypatch.chdir(tmp_path)
    if words[1] == "serve":
        # What runs until it is told to stop: the fixture `server` runs it; here its options are read.
        words.append("--help")
    if words[1] == "submit":
        monkeypatch.setenv("STICKSLIP_URL", request.getfixturevalue("server"))
    given: set[str] = set()
    if words[1] == "import":
        given = mesh_files(tmp_path) if "--nodes" in words else matrix_files(tmp_path)
    if words[1] == "keys":
        given |= {"stickslip.db"}
    if "--reduce" in words:
        given |= {f"{Path(words[words.index('--out') + 1]).stem}-reduced.npz"}
    if "--problem" in words or any(word.startswith("docs/") for word in words):
        (tmp_path / "docs").symlink_to(ROOT / "docs")
        given = {"docs"}
    assert main(words[1:]) == 0
    written = {word for word, before in zip(words[1:], words, strict=False) if before in ("--plot", "--out")}
    assert {file.name for file in tmp_path.iterdir()} == given | written


@pytest.fixture
def laws_as_before() -> Iterator[None]:
    """Takes back the laws that a page registers."""
    before = set(laws())
    yield
    for word, law in laws().items():
        if word not in before:
            unregister(law)


@pytest.mark.usefixtures("laws_as_before")
@pytest.mark.parametrize("code", cases(blocks("python")))
def test_python_runs(
    code: str,
    request: pytest.FixtureRequest,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    if ADDRESS in code:
        code = code.replace(ADDRESS, request.getfixturevalue("server"))
    exec(compile(code, "README.md", "exec"), {"__name__": "readme"})
    assert len(capsys.readouterr().out.splitlines()) >= len(re.findall(r"^ *print\(", code, re.MULTILINE))
    named = set(re.findall(r'"([\w-]+\.(?:png|svg|nc|npz|csv|parquet|mat|fmu|toml))"', code))
    assert {file.name for file in tmp_path.iterdir()} == named


def test_every_page_that_is_run_elsewhere_is() -> None:
    for page, test in ELSEWHERE.items():
        assert f'"{page}"' in (ROOT / "tests" / test).read_text(encoding="utf-8")


@each("page", PAGES)
def test_no_block_hides_from_the_tests(page: Path) -> None:
    """Fences say their language; what is indented instead is for another machine, not ours to run."""
    text = page.read_text(encoding="utf-8")
    fences = re.findall(r"^ *(```.*)$", text, re.MULTILINE)
    assert all(re.fullmatch(r"```\w+", fence) for fence in fences[::2])
    assert set(fences[1::2]) <= {"```"}
    outside = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    assert not re.findall(
        r"^ {4,}(?:import (?:solver|optim|stickslip)|stickslip (?!serve)).*$", outside, re.MULTILINE
    )


@pytest.mark.parametrize("text", [text for text in blocks("toml") if re.match(r"(#.*\n)*name =", text)])
def test_scenes_work(text: str, tmp_path: Path) -> None:
    matrix_files(tmp_path)
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    branch = solver.sweep(solver.load_scene(tmp_path / "scene.toml"))
    assert branch.reached
    assert branch.peak is not None
    assert branch.peak.interior


def test_the_problem_of_the_readme_is_one() -> None:
    """The one shown and the one of the file are read by the service too."""
    (shown,) = [text for text in blocks("toml") if text.startswith("scene =")]
    for text in (shown, (ROOT / "docs" / "problem.toml").read_text(encoding="utf-8")):
        body = tomllib.loads(text)
        request = validated(Design, body)
        assert request.issues(solver.load_scene(body["scene"])) == []


def test_the_page_knows_every_key_and_option_of_a_problem() -> None:
    table = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
    keys = set(Design.model_fields) - {"fresh", "priority", "max_seconds", *ABOUT_THE_RUN}
    assert [key for key in keys if f"`{key}`" not in table] == []
    assert [option for option in OPTIONS.values() if f"`{option}" not in table] == []


def test_the_mistuned_sector_of_the_page_on_disks_is_read(tmp_path: Path) -> None:
    """The factors of its blade are those of the disk made of lumped parts, from files too."""
    (given,) = [tomllib.loads(text) for text in blocks("toml") if text.startswith("[structure.parts]")]
    lumped = solver.load_scene("bladed-disk")
    blade = np.zeros((5, 5))
    spring = next(one for one in lumped.structure.springs if one.name == "tip_middle")
    blade[:2, :2] = spring.k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    mmwrite(tmp_path / "blade-K.mtx", sparse.coo_array(blade), symmetry="symmetric")
    M, K = sector_matrices()
    for name, matrix in (("M", M), ("K", K)):
        mmwrite(tmp_path / f"{name}.mtx", sparse.coo_array(matrix), symmetry="symmetric")
    files = {"M": "M.mtx", "K": "K.mtx", **given["structure"]}
    (tmp_path / "disk.json").write_text(json.dumps(as_matrices(lumped, **files)))
    disk = solver.load_scene(tmp_path / "disk.json")
    one = solver.solve(disk, frequency_hz=690.0, harmonics=1)
    factors = given["structure"]["mistuning"]
    other = solver.mistuned(lumped, of="tip_middle", spread=factors["spread"])
    assert one.max_abs == pytest.approx(
        solver.solve(other, frequency_hz=690.0, harmonics=1).max_abs, rel=1e-9
    )
    (tmp_path / "blade-K.mtx").unlink()
    with pytest.raises(solver.SceneError, match=r"blade-K\.mtx"):
        solver.load_scene(tmp_path / "disk.json")


def test_parts_of_scenes_are_read() -> None:
    """The disk of the page on disks, and every contact of the page on laws."""
    (mistuning,) = [text for text in blocks("toml") if text.startswith("[structure.mistuning]")]
    raw = solver.load_scene("bladed-disk").to_dict()
    raw["structure"] |= tomllib.loads(mistuning)["structure"]
    assert solver.sectors_needed(solver.Scene.from_dict(raw)).sectors == 8
    contacts = "\n".join(text for text in blocks("toml") if text.startswith("[[contacts]]"))
    names = re.findall(r'"(\w+)(?:@next)?"', " ".join(re.findall(r"between.* = (\[.*?\])", contacts)))
    dofs = sorted({*names} - {"ground"})
    raw["structure"] = {
        "kind": "cyclic", "sectors": 8, "masses": dict.fromkeys(dofs, 1.0),
        "springs": [{"between": [dof, "ground"], "k": 1e6, "c": 1.0} for dof in dofs],
    }  # fmt: skip
    raw |= tomllib.loads(contacts)
    raw["excitation"] = {"dof": dofs[0], "amplitude": 1.0, "engine_order": 1}
    raw["observe"] = {"dof": dofs[0], "band": [10.0, 20.0]}
    found = [contact.law for contact in solver.Scene.from_dict(raw).contacts]
    assert found == [
        "elastic-normal", "coulomb-2d", "coulomb-3d", "gap", "polynomial", "iwan", "bouc-wen", "dahl",
        "coulomb-tanh", "hunt-crossley", "coulomb-viscous",
    ]  # fmt: skip


def known(path: str) -> bool:
    """Whether a dotted path is a module, or a name of a module or of a class."""
    owner: object = importlib.import_module(path.partition(".")[0])
    for at, word in enumerate(path.split(".")[1:], 2):
        if not hasattr(owner, word):
            try:
                importlib.import_module(".".join(path.split(".")[:at]))
            except ModuleNotFoundError:
                return False
        owner = getattr(owner, word)
    return True


@cache
def names_of_tests() -> set[str]:
    files = [*(ROOT / "tests").rglob("test_*.py"), *ROOT.glob("stickslip/lab/*/tests/test_*.py")]
    return {name for file in files for name in re.findall(r"def (test_\w+)\(", file.read_text("utf-8"))}


@each("page", [*PAGES, *MEASURED])
def test_modules_and_tests_that_a_page_names_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    paths = re.findall(r"`((?:stickslip|solver|optim|service)(?:\.[a-zA-Z_]\w*)+)(?=[(`\[])", text)
    assert [path for path in paths if path not in NO_MODULES and not known(path)] == []
    assert set(re.findall(r"`(test_\w+)`", text)) <= names_of_tests()
    files = re.findall(r"`((?:tests|benchmarks|deploy|docs|stickslip)/[\w/.-]+)`", text)
    assert [file for file in files if not (ROOT / file).exists()] == []


def anchors(page: Path) -> set[str]:
    """The names by which headings of a page can be linked to."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@each("page", [*PAGES, *MEASURED])
def test_links_and_pictures_exist(page: Path) -> None:
    targets = re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8"))
    missing = []
    for target in targets:
        name, _, anchor = target.partition("#")
        file = page.parent / name if name else page
        if not target.startswith("http") and not (file.is_file() and (not anchor or anchor in anchors(file))):
            missing.append(target)
    assert missing == []


def test_the_index_lists_every_page_once_and_the_readme_knows_it() -> None:
    listed = re.findall(
        r"^- \[[^]]+\]\(([\w-]+\.md)\):", (ROOT / "docs/index.md").read_text("utf-8"), re.MULTILINE
    )
    assert sorted(listed) == [page.name for page in PAGES[1:] if page.name != "index.md"]
    assert "(docs/index.md)" in README


def test_the_readme_is_short_and_its_first_screen_has_a_picture_a_command_and_a_design() -> None:
    assert len(README.splitlines()) <= LONGEST_README
    screen = "\n".join(README.splitlines()[:30])
    for part in ("](docs/img/", "make demo", "stickslip design ", "peak     "):
        assert part in screen


def test_the_design_of_the_first_screen_is_what_the_command_prints(
    capsys: pytest.CaptureFixture[str],
) -> None:
    shown = re.search(r"```sh\n(stickslip design .+)\n```\n\n.+\n\n((?:    .+\n)+)", README)
    assert shown is not None
    assert main(shlex.split(shown[1])[1:]) == 0
    assert capsys.readouterr().out.startswith(dedent(shown[2]))


def test_a_page_knows_every_command() -> None:
    page = (ROOT / "docs" / "command.md").read_text("utf-8")
    names = [name for name in command().commands if not re.search(rf"^\|.*`{name}\b", page, re.MULTILINE)]
    assert names == []


@each("page", PAGES)
def test_pages_call_public_names_by_the_public_face(page: Path) -> None:
    text = page.read_text("utf-8")
    names = {f"{home.__name__}.{name}" for home in (solver, optim) for name in home.__all__}
    assert names & set(re.findall(r"\b(?:solver|optim)\.\w+", text)) == set()


def test_the_peaks_the_readme_quotes() -> None:
    scene = solver.load_scene("bladed-disk")

    def peak(**values: float) -> float:
        branch = solver.sweep(scene.with_values({f"{name}.N0": load for name, load in values.items()}))
        assert branch.peak is not None
        return 1e3 * branch.peak.value

    assert peak(shroud=185.0) == pytest.approx(0.100, abs=5e-4)
    assert peak(shroud=0.0, root=1e9) == pytest.approx(14.0, abs=0.5)
    assert peak(shroud=1e9, root=1e9) == pytest.approx(0.66, abs=5e-3)
    assert peak(shroud=0.0) == pytest.approx(4.5, abs=5e-2)
    assert peak(shroud=1e9) == pytest.approx(0.41, abs=5e-3)
