"""Compile the kernels once, so that no later command waits for it: ``python -m service.warm_up``.

Part of ``make setup`` and ``make test``. All cores compile at once; the machine code is cached on disk and
serves every process from then on. With ``--first`` only what a response and a design of a scene like the
paper's call is compiled, in three fifths of the time: ``make demo`` calls no more. Who
finds nothing compiled has it done by ``--beside``: both, one after the other, if nobody else is at it. A
wheel that brings its kernels has those of every shipped scene too (``--scenes``).
"""

from __future__ import annotations

import argparse
import os

import optim
import solver
from service.jobs.kinds import warm_up
from solver.contacts.laws.law_registry import laws
from solver.jit import compiler_process


def referee() -> None:
    """Run the time march and a transient once, on a small problem."""
    scene = solver.load_scene("two-dof")
    solver.march(scene, frequency_hz=1.2, max_periods=2)
    solver.transient(scene, begin_hz=1.2, end_hz=1.3, ramp_seconds=1.0, from_rest=True)


def functions_of_laws() -> None:
    """Compile the functions of the laws that are given by functions."""
    for law in laws().values():
        law.prepare()


def shipped_scenes() -> None:
    """Solve each shipped scene; sweep those whose contacts are not the faces of a damper; design a disk's."""
    for name in solver.shipped_scenes():
        scene = solver.load_scene(name)
        solver.solve(scene, frequency_hz=scene.observe.band[0], harmonics=3)
        if not scene.dampers:
            solver.sweep(scene, harmonics=3)
    optim.design(solver.load_scene("bladed-disk"), harmonics=3)


def main() -> None:
    """Run each kind of computation once, on a small problem, and compile what they might call besides."""
    parser = argparse.ArgumentParser(prog="python -m service.warm_up", description="Compile the kernels.")
    parser.add_argument(
        "--first", action="store_true", help="only what a response and a design with Coulomb friction call"
    )
    parser.add_argument("--scenes", action="store_true", help="besides, what all shipped scenes call")
    parser.add_argument("--beside", action="store_true", help="end if another process compiles already")
    asked = parser.parse_args()
    # Who compiles waits for nobody's kernels.
    os.environ.setdefault(compiler_process.SETTING, "compiled")
    from solver.jit.parallel import compile_together

    with compiler_process.compiling(wait=not asked.beside) as mine:
        if not mine:
            return
        if asked.beside and hasattr(os, "nice"):
            os.nice(5)
        if asked.first or asked.beside:
            compile_together([warm_up], listed=False)
            compiler_process.compiled(compiler_process.Stage.FIRST)
        if not asked.first:
            more = [shipped_scenes] if asked.scenes else []
            compile_together([warm_up, referee, functions_of_laws, *more])
            for stage in compiler_process.Stage:
                compiler_process.compiled(stage)


if __name__ == "__main__":
    main()
