"""Design reports: complete, without anything from elsewhere, and enough to have the same again."""

import html
import re
import socket
import sys
import tomllib
from datetime import datetime
from pathlib import Path

import pytest
from service_helpers import pdf_objects

import optim
import solver
from service.cli import main

PROBLEM = """scene = "two-dof"
limit = 2.5
max_band_hz = 0.5
harmonics = 3

[variables]
"damper.N0" = [20, 500]
"""


def design(folder: Path, target: str) -> Path:
    (folder / "given.toml").write_text(PROBLEM)
    words = ["design", "--problem", str(folder / "given.toml"), "--report", str(folder / target), "--json"]
    assert main(words) == 0
    return folder / target


def test_a_report_has_everything_and_gives_the_same_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = design(tmp_path, "report.html").read_text("utf-8")
    assert not re.search(r"""(src|href)=["']?(https?:|//|file:)""", page)
    assert "<script" not in page
    assert str(tmp_path) not in page
    for heading in (
        "Optimum",
        "Before and after",
        "What holds it",
        "At the peak",
        "Sensitivities",
        "Scene",
        "Plan",
        "Versions",
    ):
        assert f">{heading}<" in page
    for words in ("multiplier", "KKT residual", "estimated error", "Limits", "@media print"):
        assert words in page
    assert page.count("data:image/svg+xml;base64,") == 3
    assert "What two-dof consists of" in page
    assert f"{datetime.now().astimezone():%Y-%m-%d}" in page
    # The load is held by the band, so that a little more of it changes the band; the peak grows as the force.
    force = re.search(r"excitation\.amplitude.*?>([+-]\d\.\d+)<", page, re.DOTALL)
    assert force is not None
    assert float(force[1]) > 0.5
    blocks = [html.unescape(block) for block in re.findall(r"<pre>(.*?)</pre>", page, re.DOTALL)]
    command, problem, scene = blocks
    (tmp_path / "problem.toml").write_text(problem)
    (tmp_path / "scene.toml").write_text(scene)
    first = capsys.readouterr().out
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        assert main([*command.split()[1:], "--json"]) == 0
    again = capsys.readouterr().out
    numbers = [re.search(r'"optimum": (\{.*?\}), "peak": (\{.*?\})', out) for out in (first, again)]
    assert numbers[0] is not None
    assert numbers[1] is not None
    assert numbers[0].groups() == numbers[1].groups()


@pytest.mark.parametrize("kind", ["design", pytest.param("pareto", marks=pytest.mark.long)])
def test_a_job_has_a_report(
    kind: str, server: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "given.toml").write_text(PROBLEM.replace("max_band_hz = 0.5\n", ""))
    problem = ["--problem", str(tmp_path / "given.toml")]
    assert main(["submit", kind, *problem, "--url", server, "--json"]) == 0
    job = re.search(r'"id": "([^"]+)"', capsys.readouterr().out)
    assert job is not None
    assert main(["watch", job[1], "--url", server]) == 0
    assert main(["report", job[1], "--url", server, "--out", str(tmp_path / "report.html")]) == 0
    page = (tmp_path / "report.html").read_text("utf-8")
    assert ">Optimum<" in page
    assert (">Trade-off<" in page) == (kind == "pareto")


def test_a_report_of_another_kind_is_refused(server: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["submit", "solve", "two-dof", "--frequency", "1.2", "--harmonics", "3", "--url", server]
    assert main([*words, "--json"]) == 0
    job = re.search(r'"id": "([^"]+)"', capsys.readouterr().out)
    assert job is not None
    assert main(["report", job[1], "--url", server]) == 2
    assert "must be a design, pareto or identify job" in capsys.readouterr().err


def submitted(server: str, capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(["submit", *words, "--url", server, "--json"]) == 0
    job = re.search(r'"id": "([^"]+)"', capsys.readouterr().out)
    assert job is not None
    return job[1]


ROBUST = """scene = "two-dof"
limit = 2.5
harmonics = 1
samples = 2

[variables]
"damper.N0" = [20, 500]

[uncertain]
"damper.mu" = [0.2, 0.4]
"damper.kt" = { deviation = 0.2 }
"""


@pytest.mark.long
def test_a_robust_design_has_a_report_and_a_picture(
    server: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From the command and from a job, with the same numbers; the files in it give the same again."""
    (tmp_path / "given.toml").write_text(ROBUST)
    problem = ["design", "--problem", str(tmp_path / "given.toml")]
    assert main([*problem, "--report", str(tmp_path / "mine.html")]) == 0
    job = submitted(server, capsys, *problem)
    assert main(["watch", job, "--url", server]) == 0
    assert main(["report", job, "--url", server, "--out", str(tmp_path / "theirs.html")]) == 0
    assert main(["results", job, "--url", server, "--plot", str(tmp_path / "peaks.svg")]) == 0
    assert "nominal optimum" in (tmp_path / "peaks.svg").read_text("utf-8")
    pages = [(tmp_path / name).read_text("utf-8") for name in ("mine.html", "theirs.html")]
    for page in pages:
        assert not re.search(r"""(src|href)=["']?(https?:|//|file:)""", page)
        for heading in ("Optimum", "What is not known", "Over the uncertainty", "Responses", "Versions"):
            assert f">{heading}<" in page
        for words in ("from 0.2 to 0.4", "-20 to +20 %", "Scenarios that hold", "worst case", "KKT residual"):
            assert words in page
        assert page.count("data:image/svg+xml;base64,") == 4
    numbers = [re.findall(r"<td class=short>([\d.]+ (?:N|m|Hz))</td>", page) for page in pages]
    assert len(numbers[0]) > 20
    assert numbers[0] == numbers[1]
    blocks = [html.unescape(block) for block in re.findall(r"<pre>(.*?)</pre>", pages[0], re.DOTALL)]
    assert 'damper.kt" = { deviation = 0.2 }' in blocks[1] or '"damper.kt" = { deviation = 0.2 }' in blocks[1]
    assert optim.robust_design(
        solver.Scene.from_dict(tomllib.loads(blocks[2])),
        **{k: v for k, v in tomllib.loads(blocks[1]).items() if k != "scene"},
    ).optimum["damper.N0"] == pytest.approx(float(numbers[0][2].split()[0]), rel=1e-5)


def test_a_report_keeps_the_matrices_of_a_job_when_the_upload_is_gone(
    server: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from service.client.client import Client

    fe = Path(__file__).resolve().parent.parent.parent.parent / "docs" / "fe"
    words = ["design", str(fe / "blade.toml"), "--variable", "damper.N0", "10", "1000", "--harmonics", "1"]
    job = submitted(server, capsys, *words)
    # One harmonic is enough to make a report of; the peak is not known with it, and the command says so.
    assert main(["watch", job, "--url", server]) == 1
    with Client(server) as client:
        for upload in list(client.uploads()):
            client.delete_upload(upload.id)
    assert main(["report", job, "--url", server, "--out", str(tmp_path / "report.html")]) == 0
    assert "damper.N0" in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.long
def test_a_report_of_several_cases_is_of_the_one_with_the_highest_peak() -> None:
    from service.rendering.report.design_report import design_report
    from service.rendering.report.sections import Designed

    scene = solver.load_scene("two-dof")
    problem = {
        "variables": {"damper.N0": [20, 500]}, "harmonics": 1,
        "cases": [{"name": "weak", "set": {"excitation.amplitude": 10}}, {"name": "strong"}],
    }  # fmt: skip
    page = design_report(
        Designed(scene=scene, problem=problem, result=optim.design(scene, **problem).to_json())
    )
    assert ">Before and after, load case strong<" in page


def test_a_report_of_a_search_that_found_nothing_says_so() -> None:
    from service.rendering.report.design_report import robust_report
    from service.rendering.report.sections import Designed

    scene = solver.load_scene("two-dof")
    problem = {"variables": {"damper.N0": [20, 500]}, "uncertain": {"damper.mu": [0.2, 0.4]}, "harmonics": 1}
    found = optim.robust_design(scene, **problem, should_stop=lambda: True)
    page = robust_report(Designed(scene=scene, problem=problem, result=found.to_json()))
    assert "stopped by the caller" in page


@pytest.mark.long
def test_a_mistuned_robust_design_shows_its_worst_blade() -> None:
    from service.rendering.report.design_report import robust_report
    from service.rendering.report.sections import Designed, Sweeps, in_scenario

    scene = solver.load_scene("bladed-disk")
    problem = {
        "variables": {"shroud.N0": [100.0, 1000.0]}, "harmonics": 1, "samples": 2,
        "uncertain": {"mistuning": {"of": "tip_middle", "spread": 0.01, "seeds": [2]}},
    }  # fmt: skip
    found = optim.robust_design(scene, **problem)
    assert found.robust is not None
    page = robust_report(Designed(scene=scene, problem=problem, result=found.to_json()))
    assert "At the peak of the robust optimum<" in page
    assert "disk mistuned in tip_middle, seed 2" in page
    side = found.robust.to_json(0.95)
    worst = Sweeps(harmonics=1, limit=None).worst(
        in_scenario(scene.with_values(found.optimum), side["worst"]["scenario"])
    )
    assert worst is not None
    assert worst.peak is not None
    assert worst.peak.value == pytest.approx(found.robust.worst_peak, rel=1e-6)


def test_a_pdf_has_what_the_page_has(tmp_path: Path) -> None:
    page = design(tmp_path, "report.html").read_text("utf-8")
    made = design(tmp_path, "report.pdf").read_bytes()
    assert made.startswith(b"%PDF")
    inside = pdf_objects(made)
    assert 2 <= len(re.findall(rb"/Type /Page\b", inside)) <= 4
    headings = [html.unescape(text) for text in re.findall(r"<h\d>(.*?)</h\d>", page)]
    bookmarks = [text.decode() for text in re.findall(rb"/Title \(([^)]*)\)", inside)]
    assert bookmarks[: len(headings)] == headings
    assert re.search(rb"/BaseFont /\w+\+DejaVu-Sans", inside), "letters that come along"
    assert len(re.findall(rb" l\n", inside)) > 500, "curves of responses, a period, the scene"


def test_a_pdf_fetches_nothing_and_shows_the_beginning_of_a_long_file(tmp_path: Path) -> None:
    from service.rendering.report.making import pdf_of
    from solver.views.plots.html import page

    listener = socket.create_server(("127.0.0.1", 0))
    listener.settimeout(0.2)
    picture = tmp_path / "picture.svg"
    picture.write_text("<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0 C 1 2 3 4 5 6'/></svg>")
    with listener:
        link = f"http://127.0.0.1:{listener.getsockname()[1]}/a.svg"
        made = pdf_of(page("T", f"<h1>A &lt; B</h1><img src='{link}'><img src='{picture.as_uri()}'>"))
        with pytest.raises(TimeoutError):
            listener.accept()
    assert b" c\n" not in pdf_objects(made)
    assert b"/Title (A < B)" in pdf_objects(made)
    long = pdf_of(page("T", "<h1>T</h1><pre>" + "a = 1\n" * 20_000 + "</pre>"))
    assert len(re.findall(rb"/Type /Page\b", pdf_objects(long))) == 1


def test_without_its_extra_a_pdf_is_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    words = ["design", "two-dof", "--harmonics", "1", "--report", str(tmp_path / "report.pdf")]
    assert main(words) == 2
    assert "pip install 'stickslip[pdf]'" in capsys.readouterr().err
    assert not (tmp_path / "report.pdf").exists()


@pytest.mark.long
def test_a_report_without_linear_limits() -> None:
    """A law without a load to remove: the responses alone."""
    from service.rendering.report.design_report import design_report
    from service.rendering.report.sections import Designed

    raw = solver.load_scene("two-dof").to_dict()
    spring = {"name": "stop", "law": "gap", "between": ["m1", "ground"], "k": 50.0, "gap": 0.5}
    scene = solver.Scene.from_dict({**raw, "contacts": [*raw["contacts"], spring]})  # type: ignore[misc]
    found = optim.design(scene, variables={"damper.N0": (20.0, 500.0)}, harmonics=3)
    given = Designed(
        scene=scene, problem={"variables": {"damper.N0": [20, 500]}, "harmonics": 3}, result=found.to_json()
    )
    page = design_report(given)
    assert "between the linear limits" not in page
    assert "as given and at the optimum" in page


UNDAMPED = """name = "undamped"
[structure]
kind = "lumped"
masses = { a = 1.0, b = 0.5 }
springs = [{ between = ["a", "ground"], k = 40.0 }, { between = ["a", "b"], k = 20.0 }]
[[contacts]]
name = "rub"
between = ["a", "b"]
kt = 30.0
mu = 0.3
N0 = 1.5
[excitation]
dof = "a"
amplitude = 1.0
[observe]
dof = "b"
band = [0.5, 2.2]
"""


@pytest.mark.long
@pytest.mark.parametrize(("load", "bounded"), [((0.2, 6.0), True), ((5e5, 1e6), False)])
def test_a_design_without_damping_is_reported_with_the_right_word(
    load: tuple[float, float], bounded: bool, server: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Friction bounds a resonance, or sticks and does not: by the command, and by the service."""
    (tmp_path / "undamped.toml").write_text(UNDAMPED)
    low, high = (f"{each:g}" for each in load)
    words = ["undamped.toml", "--variable", "rub.N0", low, high, "--harmonics", "3"]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        main(["design", *words, "--report", "own.html"])
        said = capsys.readouterr()
        job = submitted(server, capsys, "design", *words)
        main(["watch", job, "--url", server])
        assert main(["report", job, "--url", server, "--out", "served.html"]) == 0
    for page in ("own.html", "served.html"):
        text = (tmp_path / page).read_text("utf-8")
        assert ">Scene<" in text
        assert ("nothing bounds the response of any design" in text) != bounded
    assert ("no damping" in said.err) != bounded
