"""The golden files: ``python -m tests.golden --write`` makes them anew, without it they are compared."""

import argparse
import os
import sys
import tempfile
from pathlib import Path

# Before anything loads numpy, as the tests do; the scenes and the service of the tests stand beside.
os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
sys.path[:0] = [str(Path(__file__).parents[1] / folder) for folder in ("cases", "service")]

from tests.golden.faces import DATA, differences, joined  # noqa: E402 - behind the paths
from tests.golden.made import FILES  # noqa: E402


def main() -> int:
    """Write or compare every file; how many differ."""
    asked = argparse.ArgumentParser(prog="python -m tests.golden", description=__doc__)
    asked.add_argument("--write", action="store_true", help="Write the files anew.")
    asked.add_argument("names", nargs="*", help=f"Some of {', '.join(FILES)}; all if left out.")
    given = asked.parse_args()
    differing = 0
    for name in given.names or FILES:
        with tempfile.TemporaryDirectory() as folder:
            text = joined(FILES[name](Path(folder)))
        if given.write:
            (DATA / name).write_text(text, encoding="utf-8")
            continue
        found = differences((DATA / name).read_text("utf-8"), text)
        differing += bool(found)
        sys.stdout.write("".join(f"{name}:\n{line}\n" for line in found))
    return differing


if __name__ == "__main__":
    sys.exit(main())
