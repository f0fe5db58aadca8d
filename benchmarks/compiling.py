"""What compiling costs: processor time of each kernel that `make setup` compiles, the dearest first."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from typing import Any

from benchmarks.harness import table

DEAREST = 20
_CHILD = "import benchmarks.compiling as c; c.child()"


def compiling() -> None:
    """Compile on an empty cache in one process and print the twenty dearest kernels."""
    with tempfile.TemporaryDirectory() as empty:
        settings = {**os.environ, "XDG_CACHE_HOME": empty, "STICKSLIP_KERNELS": "compiled"}
        told = subprocess.run(
            [sys.executable, "-c", _CHILD], env=settings, check=True, stdout=subprocess.PIPE, text=True
        ).stdout.splitlines()[-1]
    stages: dict[str, dict[str, list[float]]] = json.loads(told)
    rows = []
    for stage, kernels in stages.items():
        total = sum(sum(seconds) for seconds in kernels.values())
        variants = sum(len(seconds) for seconds in kernels.values())
        rows.append((stage, str(len(kernels)), str(variants), f"{total:.1f}"))
    table("Kernels compiled by make setup, one process", ("stage", "kernels", "variants", "CPU s"), rows)
    every = [(name, seconds, stage) for stage, kernels in stages.items() for name, seconds in kernels.items()]
    every.sort(key=lambda one: -sum(one[1]))
    table(
        f"The {DEAREST} dearest, without what they call and is compiled in its turn",
        ("kernel", "stage", "variants", "CPU s"),
        [(name, stage, str(len(seconds)), f"{sum(seconds):.2f}") for name, seconds, stage in every[:DEAREST]],
    )


def child() -> None:
    """Compile everything and print what each kernel took as JSON."""
    from numba.core import event

    from service.jobs.kinds import warm_up
    from service.warm_up import functions_of_laws, referee
    from solver.jit.parallel import compile_together

    class Times(event.Listener):  # type: ignore[misc]
        """Seconds of each compilation, without those within it."""

        def __init__(self) -> None:
            self.kernels: dict[str, list[float]] = defaultdict(list)
            self.within: list[tuple[float, float]] = []

        def on_start(self, event: Any) -> None:  # noqa: ARG002
            self.within.append((time.process_time(), 0.0))

        def on_end(self, event: Any) -> None:
            begun, inner = self.within.pop()
            took = time.process_time() - begun
            if self.within:
                outer, others = self.within[-1]
                self.within[-1] = (outer, others + took)
            function = event.data["dispatcher"].py_func
            self.kernels[f"{function.__module__}.{function.__qualname__}"].append(took - inner)

    stages: dict[str, dict[str, list[float]]] = {}
    for stage, calls, listed in (
        ("first", [warm_up], False),
        ("others", [warm_up, referee, functions_of_laws], True),
    ):
        times = Times()
        with event.install_listener("numba:compile", times):
            compile_together(calls, listed=listed, processes=1)
        stages[stage] = dict(times.kernels)
    print(json.dumps(stages))
