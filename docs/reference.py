"""The reference of the public names, built from their docstrings by pdoc into the folder that is given."""

from __future__ import annotations

import re
import sys
from pathlib import Path

from jinja2 import pass_context
from jinja2.runtime import Context
from pdoc import pdoc
from pdoc.render import configure, env

MODULES = ("solver", "optim", "service.client", "service.schemas.answers")

# pdoc takes what stands behind a colon for a type. Here it is one where a sentence follows on the next line,
# and the description itself otherwise.
_ITEM = re.compile(r"^( - \*\*.+?\*\*) \((.*)\):\n(?:   (?![A-Z]))?(?!   [A-Z])", re.MULTILINE)


def main() -> None:
    """Write the pages."""
    plain = env.filters["to_markdown"]

    @pass_context
    def described(context: Context, text: str) -> str:
        return _ITEM.sub(r"\1: \2\n", plain(context, text))

    configure(docformat="numpy", show_source=False)
    env.filters["to_markdown"] = described
    try:
        pdoc(*MODULES, output_directory=Path(sys.argv[1]))
    finally:
        env.filters["to_markdown"] = plain


if __name__ == "__main__":
    main()
