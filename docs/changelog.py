"""A release in CHANGELOG.md of what stands in changes/: ``python docs/changelog.py 1.1.0``.

A change that a user notices is a file ``changes/NAME.added.md``, ``NAME.changed.md`` or ``NAME.fixed.md``
with a sentence or two. A release gathers them under its version and date, and takes the files away.
"""

from __future__ import annotations

import re
import sys
from datetime import date
from pathlib import Path

HEADS = ("Added", "Changed", "Fixed")
_NAME = re.compile(rf"[a-z0-9-]+\.({'|'.join(HEADS).lower()})\.md")


def fragments(folder: Path) -> dict[str, list[Path]]:
    """Return the files of each head (ValueError of a name that is none of them)."""
    found: dict[str, list[Path]] = {head: [] for head in HEADS}
    for path in sorted(folder.glob("*.md")):
        if (kind := _NAME.fullmatch(path.name)) is None:
            raise ValueError(f"{path.name} must end in .added.md, .changed.md or .fixed.md")
        found[kind[1].capitalize()].append(path)
    return found


def released(text: str, version: str, day: date, folder: Path) -> str:
    """Return the changelog with a section of what stands in a folder before the newest one."""
    parts = [f"## {version} ({day.isoformat()})"]
    for head, paths in fragments(folder).items():
        if paths:
            said = "\n".join(f"- {' '.join(path.read_text('utf-8').split())}" for path in paths)
            parts.append(f"### {head}\n\n{said}")
    before, mark, after = text.partition("\n## ")
    section = "\n\n".join(parts)
    return f"{before}\n{section}\n{mark}{after}"


def main() -> None:
    """Write the section of a version, and delete the files it was made of."""
    root = Path(__file__).resolve().parent.parent
    changelog, folder = root / "CHANGELOG.md", root / "changes"
    changelog.write_text(released(changelog.read_text("utf-8"), sys.argv[1], date.today(), folder), "utf-8")
    for path in folder.glob("*.md"):
        path.unlink()


if __name__ == "__main__":
    main()
