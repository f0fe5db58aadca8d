"""A new user's times: to a first optimum, from a mesh to a report, from nothing to a design on the page.

What is typed comes from the README and the pages of docs/ themselves, so that they and the figures can not
drift apart. Hands take 80 ms a key and think for a second before everything they do.
"""

from __future__ import annotations

import os
import re
import resource
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import optim
import solver
from benchmarks.harness import WrongResultError, check, expect, table
from benchmarks.service_process import serving

ROOT = Path(__file__).resolve().parent.parent
KEY_SECONDS = 0.08
THINK_SECONDS = 1.0
COMMAND = "import sys; from service.cli import process; sys.exit(process())"
# The key of a line that the page wants changed, and the line it stands for if that has another beginning.
_CHANGE = re.compile(r"`((\w+) = [^`]+)`(?: takes the place of the line that begins with `(# \w+)`)?")
# A design variable with the value found for it.
_OPTIMUM = re.compile(r"^\s*\S+\.N0\s+[\d.]+ N\b")
# What make says as it begins a stage.
_STAGES = (
    ("-m venv", "environment"), ("pip install", "numerical packages"),
    ("service.warm_up --first", "kernels beside the other packages"), ("stickslip demo", "demo"),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Tutorial:
    """A page of docs/ that leads from a mesh to a report, and the program beside Python that it needs."""

    page: str
    program: str | None
    what: str

    def text(self) -> str:
        """What is followed of the page: a second scene, of a life, is another day's work."""
        whole = (ROOT / "docs" / self.page).read_text("utf-8")
        return whole.partition("\n## From the amplitude to a life\n")[0]


TUTORIALS = (
    Tutorial(page="fe-example.md", program=None, what="own FE blade (scikit-fem, 1830 rows) to its report"),
    Tutorial(page="fe-disk.md", program="ccx", what="own FE sector (CalculiX, 1080 rows) to its report"),
)


def new_user() -> None:
    """What a new user waits for: clone to optimum, mesh to report, nothing to an answer on the page."""
    rows = [
        first_optimum(),
        *(row for each in TUTORIALS for row in mesh_to_report(each)),
        *page_from_nothing(),
    ]
    table(
        f"A new user; hands at {1e3 * KEY_SECONDS:.0f} ms a key and {THINK_SECONDS:g} s before each action",
        ("what", "asked s", "reached s", "how"),
        rows,
    )
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg())
    print(f"\nload of the machine over 1, 5 and 15 minutes at the end: {load} on {os.cpu_count()} cores")


def blocks(text: str, language: str) -> list[str]:
    """Return the blocks of a page in one language, in order."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)


# From a clone to the first optimum


def first_optimum() -> tuple[str, ...]:
    """Clone into an empty folder and give the README's first command, with no package or kernel cached."""
    first = blocks((ROOT / "README.md").read_text("utf-8"), "sh")[0].splitlines()[0]
    with tempfile.TemporaryDirectory() as folder:
        environment = _own_environment(Path(folder) / "caches")
        before, begun = _processor_seconds(), time.perf_counter()
        cloning = ["git", "clone", "--quiet", str(ROOT), "clone"]
        subprocess.run(cloning, check=True, cwd=folder, env=environment)
        process = subprocess.Popen(
            shlex.split(first), cwd=Path(folder) / "clone", env=environment, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        lines = [(time.perf_counter() - begun, line) for line in process.stdout or ()]
        ended = time.perf_counter() - begun
        end = "".join(line for _, line in lines[-20:])
        expect(f"`{first}` ends well:\n{end}", process.wait() == 0)
        used = _processor_seconds() - before
    begins, optimum, said = stages(lines)
    (_, ready), after = begins[-1], [*(at for _, at in begins[1:]), optimum]
    parts = ", ".join(f"{name} {end - at:.0f}" for (name, at), end in zip(begins, after, strict=True))
    how = (
        f"git clone, `{first}`: set-up {ready:.0f} s, compute {optimum - ready:.0f} s until «{said}» "
        f"({parts}); pictures, and all compiled, after {ended:.0f} s, {used:.0f} s of processor time in all"
    )
    return ("first optimum after clone, nothing cached", "60", f"{optimum:.0f}", how)


def stages(lines: list[tuple[float, str]]) -> tuple[list[tuple[str, float]], float, str]:
    """Return when each stage of the set-up began, when the first optimum was printed, and its line.

    Parameters
    ----------
    lines : seconds since the beginning, and what was printed then.

    Raises
    ------
    WrongResultError
        A stage did not begin, or nothing was found.
    """
    begins: list[tuple[str, float]] = []
    for at, line in lines:
        if len(begins) < len(_STAGES):
            word, name = _STAGES[len(begins)]
            if word in line:
                begins.append((name, at))
        elif _OPTIMUM.search(line):
            return begins, at, " ".join(line.split())
    raise WrongResultError(f"no optimum was printed after {begins}")


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _own_environment(caches: Path) -> dict[str, str]:
    """What a new user's shell has: nothing of this checkout, and nothing that pip or numba kept."""
    ours = {"PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "NUMBA_CACHE_DIR", "MAKEFLAGS", "MAKELEVEL"}
    kept = {name: value for name, value in os.environ.items() if name not in ours}
    beside = str(Path(sys.executable).parent)
    kept["PATH"] = os.pathsep.join(
        entry for entry in kept["PATH"].split(os.pathsep) if entry != beside or sys.prefix == sys.base_prefix
    )
    return {**kept, "XDG_CACHE_HOME": str(caches)}


# From a mesh to a report


def steps(text: str) -> Iterator[tuple[str, str]]:
    """Return what a page has its reader do, in order: `("sh", line)` and `("edit", the section's text)`."""
    for section in re.split(r"^(?=## )", text, flags=re.MULTILINE):
        if re.search(r"^Open `[\w-]+\.toml`", section, re.MULTILINE):
            yield "edit", section
        for block in blocks(section, "sh"):
            yield from (("sh", line) for line in block.splitlines())


def edited(scene: str, section: str) -> tuple[str, int]:
    """Return a scene file with the changes that a section of a page asks for, and how many keys they take.

    Raises
    ------
    WrongResultError
        A line that is to be changed is not there once.
    """
    (contacts,) = blocks(section, "toml")
    keys = len(contacts)
    scene, count = re.subn(r"# A contact joins.*\n(#.*\n)+", lambda _: contacts, scene)
    expect("the scene has one template of a contact", count == 1)
    prose = re.sub(r"^```.*?^```$", "", section, flags=re.MULTILINE | re.DOTALL)
    for line, key, other in _CHANGE.findall(prose):
        beginning = other or f"{key} = "
        scene, count = re.subn(
            rf"^{re.escape(beginning)}.*$", lambda _, line=line: line, scene, flags=re.MULTILINE
        )
        expect(f"one line of the scene begins with {beginning!r}", count == 1)
        keys += len(line)
    return scene, keys


def mesh_to_report(tutorial: Tutorial) -> list[tuple[str, ...]]:
    """Follow a page line by line, as processes, until its report is written."""
    if tutorial.program is not None and shutil.which(tutorial.program) is None:
        return [(tutorial.what, "300", "skipped", f"{tutorial.program} is not installed")]
    text = tutorial.text()
    commands = keys = actions = 0
    ran = 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "docs").symlink_to(ROOT / "docs")
        for kind, what in steps(text):
            actions += 1
            if kind == "edit":
                (opened,) = re.findall(r"^Open `([\w-]+\.toml)`", what, re.MULTILINE)
                scene, typed = edited((folder / opened).read_text("utf-8"), what)
                (folder / opened).write_text(scene, encoding="utf-8")
                keys += typed
                continue
            ran += _ran(what, folder)
            commands += 1
            keys += len(what) + 1
            report = re.search(r"--report (\S+\.html)", what)
            if report is not None:
                size = (folder / report[1]).stat().st_size
                expect(f"{report[1]} is a page", (folder / report[1]).read_text("utf-8").startswith("<!"))
                break
        else:
            raise WrongResultError(f"docs/{tutorial.page} has no step that writes a report")
    hands = KEY_SECONDS * keys + THINK_SECONDS * actions
    how = (
        f"{commands} commands and one file edited, as docs/{tutorial.page} says: {ran:.0f} s of processes, "
        f"{hands:.0f} s of hands for {keys} keys; {report[1]} {size / 1000:.0f} kB"
    )
    return [(tutorial.what, "300", f"{ran + hands:.0f}", how)]


def _ran(line: str, folder: Path) -> float:
    """Run a command of a page; how long it took [s]."""
    words = shlex.split(line)
    ours = {"python": [sys.executable], "stickslip": [sys.executable, "-c", COMMAND]}
    begun = time.perf_counter()
    done = subprocess.run(
        [*ours.get(words[0], words[:1]), *words[1:]], cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    seconds = time.perf_counter() - begun
    expect(f"`{line}` ends well: {done.stdout[-1000:]}{done.stderr[-1000:]}", done.returncode == 0)
    return seconds


# From nothing to an answer on the page


class Hands:
    """Does on a page what a person does, at a person's pace; counts actions and keys."""

    def __init__(self, page: Any) -> None:
        self._page = page
        self.actions = 0
        self.keys = 0

    def press(self, button: Any) -> None:
        """Think, then click a button."""
        self._think()
        button.click()

    def fill(self, field: Any, text: str) -> None:
        """Think, then type a text in the place of what stands in a field, and leave the field."""
        self._think()
        field.click()
        field.press("Control+a")
        field.press_sequentially(text, delay=1e3 * KEY_SECONDS)
        field.press("Tab")
        self.keys += len(text) + 2

    def choose(self, box: Any, value: str) -> None:
        """Think, then choose from a list."""
        self._think()
        box.select_option(value)

    def _think(self) -> None:
        self._page.wait_for_timeout(1e3 * THINK_SECONDS)
        self.actions += 1


ANSWERS = {
    "Name of the scene": "my-rotor",
    "Frequency": "420",
    "Modal mass": "0.12",
    "Damping ratio": "0.002",
    "Friction coefficient": "0.25",
}


def page_from_nothing() -> list[tuple[str, ...]]:
    """Make a scene by the wizard and the tables in a real Chromium, store it, and have its load designed."""
    program = shutil.which("chromium")
    what = ("a scene from nothing on the page, stored", "and its best damper")
    if program is None:
        return [(name, "180", "skipped", "chromium is not installed") for name in what]
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        database = f"sqlite:///{Path(folder) / 'page.db'}"
        with serving(database, workers=1, log=Path(folder) / "log") as service:
            url = f"http://127.0.0.1:{service.port}"
            browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1280, "height": 900})
            page.set_default_timeout(120_000)
            complaints: list[str] = []
            page.on("pageerror", lambda error: complaints.append(str(error)))
            hands = Hands(page)
            begun = time.perf_counter()
            page.goto(url)
            page.locator("html[data-ready]").wait_for(state="attached")
            _draw_up(hands, page)
            stored, actions, keys = time.perf_counter() - begun, hands.actions, hands.keys
            answer = _answered(hands, page)
            answered = time.perf_counter() - begun
            with service.client() as client:
                scene = client.get("/v1/scenes/my-rotor").json()["scene"]
            browser.close()
        expect(f"the page does not complain: {complaints}", not complaints)
    checked = _judged(scene, answer)
    made = (
        f"template, two masses, two springs, damper and stop: {actions} actions, {keys} keys, "
        "until it is stored and its response drawn"
    )
    found = f"one more button: the load of the damper {checked}"
    return [(what[0], "180", f"{stored:.0f}", made), (what[1], "", f"{answered:.0f}", found)]


def _draw_up(hands: Hands, page: Any) -> None:
    """From the template of a blade to a blade on a disk with a damper and a stop, stored under its name."""
    hands.press(page.locator("#first-questions"))
    hands.press(page.get_by_role("button", name="Blade with a damper to the ground"))
    for label, text in ANSWERS.items():
        hands.fill(page.locator("#wizard-form").get_by_label(label), text)
    hands.press(page.get_by_role("button", name="Make the scene"))
    _nothing_wrong(page)
    # A second mass under the blade: a row added, a row doubled, and the ends of both springs.
    hands.press(page.get_by_role("button", name="Add mass"))
    hands.fill(_row(page, "structure/masses", 1).locator("[data-key=name]"), "disk")
    hands.fill(page.get_by_role("textbox", name="m of disk"), "0.6")
    hands.press(_row(page, "structure/springs", 0).get_by_role("button", name="Duplicate"))
    web = _row(page, "structure/springs", 1)
    hands.fill(web.locator("[data-key=name]"), "web")
    hands.fill(web.locator("[data-key=between]").first, "disk")
    hands.fill(web.locator("[data-key=k]"), "6e6")
    hands.fill(_row(page, "structure/springs", 0).locator("[data-key=between]").last, "disk")
    # A stop beside the damper.
    hands.press(page.get_by_role("button", name="Add contact"))
    stop = _row(page, "contacts", 1)
    hands.fill(stop.locator("[data-key=name]"), "stop")
    hands.choose(stop.locator("[data-key=law]"), "gap")
    hands.fill(stop.locator("[data-key=gap]"), "0.002")
    _nothing_wrong(page)
    hands.press(page.get_by_role("button", name="Use this scene"))
    page.locator("#editor").wait_for(state="hidden")
    page.locator("#live-status", has_text="peak").wait_for()
    expect("the scene is chosen", page.input_value("#scene") == ANSWERS["Name of the scene"])


def _row(page: Any, section: str, index: int) -> Any:
    return page.locator(f"[data-row='{section}:{index}']")


def _nothing_wrong(page: Any) -> None:
    page.locator("#editor-form[aria-busy=false]").wait_for(state="attached")
    page.locator("#editor-status", has_text="Nothing is wrong").wait_for()


def _answered(hands: Hands, page: Any) -> str:
    """Press the one button; what the answer says."""
    hands.press(page.locator("#study"))
    page.locator("#answer-certificate .large").wait_for()
    return " ".join(page.locator("#answer-body").inner_text().split())


def _judged(raw: dict[str, Any], answer: str) -> str:
    """Return the load that the page says, after it was compared with the same search here."""
    scene = solver.Scene.from_dict(raw)
    kinds = {contact.name: contact.law for contact in scene.contacts}
    expect(
        f"the stored scene has a damper and a stop: {kinds}", kinds.get("stop") == "gap" and "damper" in kinds
    )
    expect("and two masses", set(scene.structure.dofs) == {"blade", "disk"})
    said = re.search(r"([\d.]+(?:e[+-]?\d+)?) N\b", answer)
    if said is None:
        raise WrongResultError(f"the answer names no load: {answer}")
    load = scene.value("damper.N0")
    best = optim.design(scene, variables={"damper.N0": (0.1 * load, 10.0 * load)})
    return f"{check('the load on the page', float(said[1]), best.optimum['damper.N0'], 1e-2)} N"
