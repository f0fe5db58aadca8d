"""The modules of the page as one, so that a browser asks once where it asked a hundred times.

Each module becomes a function that runs once and returns what it exports, behind those that it imports:
`import { a, b as c } from "./x.js"` is `const { a, b: c } = x`. What stands under `vendor` stays a file of
its own, imported by its address. The page is written so that this is enough: imports are of names, in one
line, exports are declarations that are never assigned again, and nothing goes in a circle.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping

_IMPORT = re.compile(r'^import \{([^}]*)\} from "([^"]+)";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:async )?(?:function\*?|const|class) (\w+))", re.MULTILINE)
_LIST = re.compile(r"^export \{[^}]*\};\n", re.MULTILINE)
_LATER = re.compile(r'\bimport\("[./]*(vendor/[^"]+)"\)')
_OTHER = re.compile(r"^(?:import|export)\b.*", re.MULTILINE)
VENDOR = "/vendor/"


def bundle(files: Mapping[str, str], entry: str) -> str:
    """Return one module that does what `entry` does.

    Parameters
    ----------
    files : the text of each module by its path.
    entry : the path of the first; the bundle stands beside it.

    Raises
    ------
    ValueError
        A module that is not there, goes in a circle or is written in another way.
    """
    heads: dict[str, str] = {}
    bodies: dict[str, str] = {}
    under_way: list[str] = []

    def add(path: str) -> None:
        if path in under_way or path not in files:
            what = "imports itself" if path in under_way else "is not there"
            raise ValueError(f"the module {path!r} {what}: {' → '.join([*under_way, path])}")
        under_way.append(path)
        text = files[path]
        lines = []
        for names, source in _IMPORT.findall(text):
            target = posixpath.normpath(posixpath.join(posixpath.dirname(path), source))
            if VENDOR in target:
                heads.setdefault(target, f'import * as {_name(target)} from "./{_beside(target, entry)}";')
            elif target not in bodies:
                add(target)
            lines.append(f"const {{{names.replace(' as ', ': ')}}} = {_name(target)};")
        body = _LATER.sub(r'import("./\1")', _LIST.sub("", _IMPORT.sub("", text)))
        exported = ", ".join(_EXPORT.findall(body))
        body = "\n".join([*lines, _EXPORT.sub("", body)])
        odd = _OTHER.search(body)
        if odd is not None:
            raise ValueError(f"{path!r}: {odd[0]!r} is no import of names and no export of a declaration")
        if path != entry:
            body = f"const {_name(path)} = (() => {{\n{body}return {{ {exported} }};\n}})();"
        bodies[path] = f"// {path}\n{body}"
        under_way.pop()

    add(entry)
    return "\n".join([*heads.values(), *bodies.values()])


def _name(path: str) -> str:
    return "$" + re.sub(r"\W", "_", path)


def _beside(path: str, entry: str) -> str:
    return posixpath.relpath(path, posixpath.dirname(entry))
