"""How tests start the command in a process of its own."""

from __future__ import annotations

import sys

COMMAND = (sys.executable, "-c", "import sys; from service.cli import main; sys.exit(main())")
