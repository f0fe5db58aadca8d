"""A report in the form that is asked for: its page, or that page printed on sheets of A4.

WeasyPrint prints it, which needs Pango with a font of the system, and no browser.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping
from datetime import date
from importlib.metadata import version
from typing import Any

from service.errors import ConflictError, InputError
from service.rendering.report.sections import Designed
from service.workers.processes import EndedError, told_apart

PAGE, PDF = "html", "pdf"
FORMS = {PAGE: "text/html", PDF: "application/pdf"}
"""Forms of a report with their media types."""
MISSING = (
    "a PDF needs the extra `pdf`, which is not installed (pip install 'stickslip[pdf]', and Pango of the "
    "system: apt install libpangoft2-1.0-0): install it, or write a file that ends in .html"
)
MOST_LINES = 90
"""Of a text such as a scene file on sheets; the page has all of them."""
_SHEET = """
@page { font: 6pt "DejaVu Sans", sans-serif; color: #555;
  @bottom-left { content: string(title) " · %s"; }
  @bottom-right { content: counter(page) " / " counter(pages); } }
h1 { string-set: title content(); }
body { font-family: "DejaVu Sans", sans-serif !important; }
"""


def report_of(given: Designed, form: str) -> bytes:
    """The report of a design, of a front, of a robust design or of an identification.

    InputError for a PDF, where what writes it is not installed; SettingError, SceneError if the optimum does
    not fit the scene.

    Parameters
    ----------
    given : what was designed.
    form : one of `FORMS`.
    """
    from service.rendering.report.design_report import design_report, identification_report, robust_report

    if form == PDF:
        require_pdf()
    if "estimates" in given.result:
        made = identification_report
    else:
        made = robust_report if "nominal" in given.result else design_report
    page = made(given)
    return pdf_of(page) if form == PDF else page.encode()


def require_pdf() -> None:
    """Have what writes a PDF (InputError if it is not installed)."""
    try:
        import weasyprint  # noqa: F401 - whether it is there, with the library of the system that it loads
    except (ImportError, OSError) as error:
        raise InputError(MISSING) from error


def pdf_of(page: str) -> bytes:
    """A page of HTML as a PDF; of its files the first lines."""
    from weasyprint import CSS, HTML
    from weasyprint.urls import URLFetcher

    foot = f"stickslip {version('stickslip')} · {date.today().isoformat()}"
    style = CSS(string=_SHEET % foot)
    inside = URLFetcher(allowed_protocols={"data"})  # a page holds all that it shows
    text = re.sub(r"(?<=<pre>).*?(?=</pre>)", lambda found: _beginning(found[0]), page, flags=re.DOTALL)
    made: Any = HTML(string=text, url_fetcher=inside).write_pdf(stylesheets=[style])
    return bytes(made)


def _beginning(text: str) -> str:
    """The first lines of a long file."""
    lines = text.splitlines()
    left_out = len(lines) - MOST_LINES
    if left_out <= 0:
        return text
    return "\n".join([*lines[:MOST_LINES], f"# … and {left_out} further lines: the report in HTML has them"])


MEMORY_BYTES = 2 * 1024**3
_MOST_BYTES = 64 * 1024**2


def report_apart(
    scene: Mapping[str, Any], problem: Mapping[str, Any], result: Mapping[str, Any],
    about: Mapping[str, Any], form: str, seconds: float,
) -> bytes:  # fmt: skip
    """The report of a design, as bytes of the form.

    ConflictError if it takes more time or memory than it may, or there is nothing to report; the message says
    what to do.

    Parameters
    ----------
    scene, problem, result, about : as `service.rendering.report.sections.Designed` has them, the scene as
        tables.
    form : one of `service.rendering.report.making.FORMS`.
    seconds : longest time it may take.
    """
    argument = {"scene": dict(scene), "problem": dict(problem), "result": dict(result), "about": dict(about),
                "form": form}  # fmt: skip
    try:
        answer = told_apart(
            _answer, argument, "report", seconds=seconds, most_bytes=_MOST_BYTES, memory=MEMORY_BYTES
        )
    except TimeoutError as error:
        raise ConflictError(_beyond(f"longer than {seconds:g} s")) from error
    except (EndedError, OSError) as error:
        raise ConflictError(_beyond("more memory or time than there is for it")) from error
    if "error" in answer:
        raise ConflictError(answer["error"])
    return base64.b64decode(answer["report"])


def _beyond(what: str) -> str:
    return f"making the report takes {what}: `stickslip report JOB` makes it on your machine"


def _answer(given: Mapping[str, Any]) -> dict[str, str]:
    from solver.errors import SolverError
    from solver.scene.scene import Scene

    try:
        scene = Scene.from_dict(given["scene"])
        made = report_of(
            Designed(scene=scene, problem=given["problem"], result=given["result"], about=given["about"]),
            given["form"],
        )
        return {"report": base64.b64encode(made).decode()}
    except (InputError, SolverError) as error:
        return {"error": str(error)}
    except MemoryError:
        return {"error": _beyond("more memory than there is for it")}
