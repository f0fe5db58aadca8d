"""Matrices dropped onto the page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fe_files import ansys_mapping, hbmat
from matrix_cases import beam

if TYPE_CHECKING:
    from playwright.sync_api import Page

# A blade of 0.3 kg, 0.2 m long, clamped at its root: 1.1 kHz.
M = beam(20, length=0.2, EI=2000.0, mass=0.3)[0]
K = beam(20, length=0.2, EI=2000.0, mass=0.3)[1]
LABELS = [(2 + row // 2, ("UY", "ROTZ")[row % 2]) for row in range(len(M))]


def file(name: str, text: str | bytes) -> Any:
    buffer = text if isinstance(text, bytes) else text.encode()
    return {"name": name, "mimeType": "application/octet-stream", "buffer": buffer}


ANSYS = [
    file("blade K.matrix", hbmat(K)), file("blade M.matrix", hbmat(M)),
    file("blade K.mapping", ansys_mapping(LABELS)),
]  # fmt: skip


def place(page: Page, *rows: str) -> None:
    for at, row in enumerate(rows):
        page.get_by_label("Node and direction, or row").nth(at).fill(row)
    page.get_by_role("button", name="Make the scene").click()
