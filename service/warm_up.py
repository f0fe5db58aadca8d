"""Compile the kernels once, so that no later command waits for it: ``python -m service.warm_up``.

Part of ``make setup`` and ``make test``. The machine code is cached on disk and serves every process from
then on.
"""

from __future__ import annotations

import solver
from service.kinds import warm_up


def main() -> None:
    """Run each kind of computation once, on a small problem."""
    warm_up()
    solver.march(solver.load_scene("two-dof"), frequency_hz=1.2, max_periods=2)


if __name__ == "__main__":
    main()
