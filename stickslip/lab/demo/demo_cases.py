"""What the demonstration shows, and its first optimum.

Apart from the demonstration itself, which loads database, client and drawing: the first optimum waits for
none of them.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from typing import Annotated

import numpy as np

import solver
from service.cli.failures import ShortfallError
from service.rendering.text import say
from solver.jit import compiler_process

REMOVED, STUCK = 0.0, 1e9
"""Normal loads [N] at which a contact does nothing, and never slips."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DemoCase:
    """What the demonstration designs and draws of a scene."""

    scene: Annotated[str, "Name of a shipped scene."]
    contact: Annotated[str, "The contact whose normal load is chosen."]
    bounds: Annotated[tuple[float, float], "Between which it is chosen [N]."]
    shown: Annotated[tuple[float, ...], "Loads whose responses are drawn beside the optimum's [N]."]
    steps: Annotated[int, "Loads at which the peak is drawn, over the bounds."] = 24

    @property
    def variable(self) -> str:
        """Path of the design variable."""
        return f"{self.contact}.N0"

    @property
    def loads(self) -> tuple[float, ...]:
        """The loads responses are wanted for [N]."""
        grid = np.geomspace(*self.bounds, self.steps)
        return (*self.shown, *(float(f"{load:.4g}") for load in grid))

    @property
    def limits(self) -> tuple[dict[str, float], dict[str, float]]:
        """Values that make the scene linear: the contact removed, and stuck; every other contact stuck."""
        stuck = {f"{contact.name}.N0": STUCK for contact in solver.load_scene(self.scene).contacts}
        return {**stuck, self.variable: REMOVED}, stuck


CASES = (
    DemoCase(scene="two-dof", contact="damper", bounds=(20.0, 1000.0), shown=(30.0, 60.0, 200.0, 500.0)),
    DemoCase(scene="bladed-disk", contact="shroud", bounds=(20.0, 3000.0), shown=(40.0, 90.0, 500.0, 2000.0)),
)


def first_told() -> int:
    """Say the optimum of the first case where kernels are still to be compiled; how many were told.

    It waits for no compiler; what follows takes longer interpreted than compiling does.
    """
    return told_without_compiler(CASES[0]) if compiler_process.missing() else 0


def told_without_compiler(case: DemoCase) -> int:
    """Have another process design a damper and say what came out, kernels interpreted; how many were told.

    ShortfallError if it did not reach its goal.
    """
    low, high = (f"{bound:g}" for bound in case.bounds)
    asked = ("design", case.scene, "--variable", case.variable, low, high)
    command = "import sys; from service.cli import process; sys.exit(process())"
    if subprocess.run([sys.executable, "-c", command, *asked], check=False).returncode != 0:
        raise ShortfallError(f"the design of {case.scene} did not succeed")
    say("")
    return 1
