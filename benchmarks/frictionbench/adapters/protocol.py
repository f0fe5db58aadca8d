"""What an adapter and the scorer say to each other: a line of JSON for each question, one for each answer.

An adapter is a file with `NEEDS` (what pip is to install into its environment), `RUNGS` (settings from cheap
to dear) and `solve(case, rung) -> {"value": …}`; `estimate` of the error and `points` may stand beside. What
it does not offer raises NotImplementedError, whose words are shown. It runs in an environment of its own,
with `case_model` (NumPy alone) for who wants matrices of a whole annulus.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any


def case_model(case: dict[str, Any]) -> Any:
    """Return `frictionbench.model.model` of a case, loaded by its path: an adapter has no other package."""
    where = Path(__file__).parents[1] / "model.py"
    spec = importlib.util.spec_from_file_location("frictionbench_model", where)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module.model(case)


def serve(solve: Callable[[dict[str, Any], dict[str, Any]], dict[str, Any]]) -> None:
    """Answer questions until there are no more; each is solved once to warm up, and then timed."""
    for line in sys.stdin:
        asked = json.loads(line)
        answer: dict[str, Any]
        try:
            with contextlib.redirect_stdout(sys.stderr):
                begun = time.process_time()
                answer = solve(asked["case"], asked["rung"])
                first = time.process_time() - begun
                if first < asked["again_below"]:
                    begun = time.process_time()
                    answer = solve(asked["case"], asked["rung"])
                    first = min(first, time.process_time() - begun)
                answer = {**answer, "seconds": first}
        except NotImplementedError as error:
            answer = {"not_offered": str(error)}
        except Exception as error:  # noqa: BLE001 - a failure is a result
            answer = {"failed": f"{type(error).__name__}: {error}"[:300]}
        print(json.dumps(answer), flush=True)
