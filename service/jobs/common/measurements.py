"""Measured data in the text of CSV files: as tables of a job, with what is wrong by file, line and column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from solver.errors import SceneError, SettingError
from solver.scene.scene import Scene

_SHOWN = 2000
"""Points of a run that are told besides."""


def read_measurements(scene: Scene, files: Sequence[Mapping[str, str]]) -> dict[str, Any]:
    """Read the texts against a scene, each for itself.

    Parameters
    ----------
    scene : what was measured.
    files : `name` and `text` of each.

    Returns
    -------
    `files` have the `name` and the `table` of each that can be read, in the words of a job, and its `runs`
    with what they measured; `issues` have `file`, `line`, `column` (null where it is of the whole) and
    `detail`.
    """
    # Loaded here: it brings SciPy along, which a service that only lists does not need.
    from optim.errors import DesignError
    from optim.identification.readers.csv_text import described
    from optim.identification.reading import read_data

    paths = frozenset(scene.parameter_paths())
    read, issues = [], []
    for file in files:
        name = file["name"]
        try:
            from_text = described(file["text"], name, paths)
            runs = read_data(scene, [from_text])
            read.append({"name": name, "table": from_text.job_table, "runs": [_shown(run) for run in runs]})
        except DesignError as error:
            issues.append({
                "file": name, "line": getattr(error, "line", None),
                "column": getattr(error, "column", "") or None, "detail": str(error),
            })  # fmt: skip
        except (SceneError, SettingError) as error:
            issues.append({"file": name, "line": None, "column": None, "detail": str(error)})
    return {"files": read, "issues": issues}


def _shown(run: Any) -> dict[str, Any]:
    """A run as it is drawn before anything is fitted: the data stand where a fit would."""
    import numpy as np

    told = run.to_json(run.observations, np.zeros(run.observations.size))
    count = len(told["x"])
    kept = np.unique(np.linspace(0, count - 1, min(count, _SHOWN)).round().astype(int)).tolist()
    return {
        "kind": told["kind"], "conditions": told["conditions"], "of": told.get("contact") or told.get("dof"),
        "points": count, "x": [told["x"][i] for i in kept], "data": [told["data"][i] for i in kept],
    }  # fmt: skip
