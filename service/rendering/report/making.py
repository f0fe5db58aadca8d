"""A report in the form that is asked for."""

from __future__ import annotations

from service.rendering.report.sections import Designed

PAGE, PDF = "html", "pdf"
FORMS = {PAGE: "text/html", PDF: "application/pdf"}
"""Forms of a report with their media types."""


def report_of(given: Designed, form: str) -> bytes:
    """The report of a design, of a front, of a robust design or of an identification.

    Parameters
    ----------
    given : what was designed.
    form : one of `FORMS`.

    Raises
    ------
    InputError
        A PDF, where what writes it is not installed.
    SettingError, SceneError
        The optimum does not fit the scene.
    """
    from service.rendering.report.design import design_report
    from service.rendering.report.identification import identification_report
    from service.rendering.report.pdf import pdf_of, require_pdf
    from service.rendering.report.robust import robust_report
    from solver.views.plots.html import pictures_as_png

    if "estimates" in given.result:
        made = identification_report
    else:
        made = robust_report if "nominal" in given.result else design_report
    if form != PDF:
        return made(given).encode()
    require_pdf()
    with pictures_as_png():
        page = made(given)
    return pdf_of(page)
