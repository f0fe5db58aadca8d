"""A format of measured data of this module: named once, files of it are read and the docs have it."""

import json
from pathlib import Path

import numpy as np
import pytest
from docs_tables import TABLES

from optim.identification.data.measured_table import Table
from optim.identification.readers.data_readers import DataFormat, Head, table_of
from optim.identification.reading import read_data
from optim.problem.checks import DataError
from solver import extensions
from solver.scene.scene import load_scene


def read_pairs(path: Path, paths: frozenset[str]) -> list[Table]:
    """Read lines of two numbers: frequency in Hz, amplitude in mm."""
    columns = np.loadtxt(path).T
    head = Head(conditions={}, words={})
    return [table_of(path.name, ["frequency [Hz]", "max_abs [mm]"], list(columns), head, paths)]


PAIRS = DataFormat(name="Pairs", suffixes=(".pairs",), help="Two numbers a line.", read=read_pairs)


def test_files_of_it_are_read_once_it_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    file = tmp_path / "rig.pairs"
    file.write_text("1.0 2.5\n1.1 3.5\n")
    scene = load_scene("two-dof")
    with pytest.raises(DataError, match=r"must end in \.csv"):
        read_data(scene, [file])
    monkeypatch.setenv(extensions.VARIABLE, json.dumps([f"{__name__}:PAIRS"]))
    (run,) = read_data(scene, [file])
    np.testing.assert_allclose(run.observations, [2.5e-3, 3.5e-3], rtol=1e-15)
    assert "| Pairs | `.pairs` | Two numbers a line. |" in TABLES["identification.md"]["formats"]()
