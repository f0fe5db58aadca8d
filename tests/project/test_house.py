"""What `docs/house.py` measures of the core may become less, never more."""

import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MOST = {
    "lines of solver and optim": 80_863, "modules of solver and optim": 320,
    "lines of service and migrations": 30_766, "modules of service and migrations": 139,
    "lines of the page": 10_348, "names of modules twice": 11, "longest chain of imports": 26,
    "deepest folder": 3, "modules in circles": 0, "modules of solver and optim that read mu": 23,
}  # fmt: skip
"""After the last change that took something away. A change that needs more takes it from somewhere else."""


def test_the_core_does_not_grow() -> None:
    house = runpy.run_path(str(ROOT / "docs" / "house.py"))
    found = house["House"](ROOT)
    measured = {
        "lines of solver and optim": found.lines(*house["NUMERICS"]),
        "modules of solver and optim": found.modules(*house["NUMERICS"]),
        "lines of service and migrations": found.lines(*house["SHELL"]),
        "modules of service and migrations": found.modules(*house["SHELL"]),
        "lines of the page": found.page(), "names of modules twice": found.twice()[1],
        "longest chain of imports": found.depth(), "deepest folder": found.deepest(),
        "modules in circles": sum(map(len, found.circles("at once"))),
        "modules of solver and optim that read mu": found.reading_mu(),
    }  # fmt: skip
    more = {what: value for what, value in measured.items() if value > MOST[what]}
    assert more == {}, f"more than {[MOST[what] for what in more]}"
