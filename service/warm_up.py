"""Compile the kernels once, so that no later command waits for it: ``python -m service.warm_up``.

Part of ``make setup`` and ``make test``. All cores compile at once; the machine code is cached on disk and
serves every process from then on. With ``--first`` only what a response and a design of a scene like the
paper's call is compiled, in half the time: ``make demo`` does the rest after its first optimum.
"""

from __future__ import annotations

import argparse

import solver
from service.jobs.kinds import warm_up
from solver.contacts.laws.registry import laws
from solver.jit.parallel import compile_together


def referee() -> None:
    """Run the time march and a transient once, on a small problem."""
    scene = solver.load_scene("two-dof")
    solver.march(scene, frequency_hz=1.2, max_periods=2)
    solver.transient(scene, begin_hz=1.2, end_hz=1.3, ramp_seconds=1.0, from_rest=True)


def functions_of_laws() -> None:
    """Compile the functions of the laws that are given by functions."""
    for law in laws().values():
        law.prepare()


def main() -> None:
    """Run each kind of computation once, on a small problem, and compile what they might call besides."""
    parser = argparse.ArgumentParser(prog="python -m service.warm_up", description="Compile the kernels.")
    parser.add_argument(
        "--first", action="store_true", help="only what a response and a design with Coulomb friction call"
    )
    if parser.parse_args().first:
        compile_together([warm_up], listed=False)
    else:
        compile_together([warm_up, referee, functions_of_laws])


if __name__ == "__main__":
    main()
