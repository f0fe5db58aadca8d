"""Files of measurements: units, conditions, formats; what is wrong is told with its line."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import pyuff
from each import each

import optim
import solver
from optim.identification.reading import read_data
from optim.problem.checks import DataError

SCENE = solver.load_scene("two-dof")
HEAD = "# excitation.amplitude = 50\nfrequency,amplitude [mm],phase [rad]\n"
ROWS = "1.0,1900,-0.5\n1.1,2100,-1.0\n1.2,1800,-1.5\n"


def read(folder: Path, text: str, suffix: str = "", name: str = "rig.csv") -> Any:
    (folder / name).write_text(text, encoding="utf-8")
    return read_data(SCENE, [f"{folder / name}{suffix}"])


def test_units_and_conditions_of_a_csv(tmp_path: Path) -> None:
    (run,) = read(tmp_path, HEAD + ROWS, ":damper.N0=80,dof=m1")
    assert run.conditions == {"excitation.amplitude": 50.0, "damper.N0": 80.0}
    assert run.dof == "m1"
    assert np.abs(run.data) == pytest.approx([1.9, 2.1, 1.8])
    assert np.angle(run.data) == pytest.approx([-0.5, -1.0, -1.5])


def test_columns_of_conditions_part_the_runs(tmp_path: Path) -> None:
    text = "damper.N0;frequency [rad/s];max_abs\n50;6;1\n50;7;1\n80;6;2\n80;7;2\n"
    first, second = read(tmp_path, text)
    assert (first.conditions, second.conditions) == ({"damper.N0": 50.0}, {"damper.N0": 80.0})
    assert second.frequency_hz == pytest.approx(np.array([6.0, 7.0]) / (2.0 * math.pi))


def test_accelerations_per_newton_are_displacements(tmp_path: Path) -> None:
    text = "# excitation.amplitude = 50\nfrequency,real [m/s2/N],imag [m/s2/N]\n1.0,2.0,0.5\n1.1,2.0,0.5\n"
    (run,) = read(tmp_path, text)
    spin = 2.0 * math.pi * np.array([1.0, 1.1])
    assert run.data == pytest.approx(-50.0 * (2.0 + 0.5j) / spin**2)


def test_parquet_is_read_as_csv(tmp_path: Path) -> None:
    columns = {"frequency": [1.0, 1.1], "amplitude [mm]": [1900.0, 2100.0], "damper.N0": [80.0, 80.0]}
    told = pa.table(columns).replace_schema_metadata({"excitation.amplitude": "50"})
    pq.write_table(told, tmp_path / "rig.parquet")
    (run,) = read_data(SCENE, [tmp_path / "rig.parquet"])
    assert run.conditions == {"excitation.amplitude": 50.0, "damper.N0": 80.0}
    assert run.data == pytest.approx([1.9, 2.1])


def in_binary(file: Path, data: np.ndarray) -> None:
    """Turn a file of data set 58 into 58b after the format's documentation: little-endian doubles."""
    lines = file.read_bytes().splitlines()
    numbers = np.column_stack([data.real, data.imag]).astype("<f8").tobytes()
    first = f"    58b{1:6d}{2:6d}{11:12d}{len(numbers):12d}{0:6d}{0:6d}{0:12d}{0:12d}".encode()
    head = b"\n".join([lines[0], first, *lines[2:13], b""])
    file.write_bytes(head + numbers + b"\n    -1\n")


@pytest.mark.parametrize("binary", [False, True])
def test_universal_files_are_read(tmp_path: Path, binary: bool) -> None:
    hertz, receptance = np.array([1.0, 1.1, 1.2]), np.array([0.02 - 0.01j, 0.01 - 0.04j, -0.02 - 0.03j])
    block = pyuff.prepare_58(
        binary=0, id1="damper.N0 = 80", id2="a rig", id3="", id4="", id5="", func_type=4, ver_num=0,
        load_case_id=0, rsp_ent_name="blade", rsp_node=2, rsp_dir=1, ref_ent_name="shaker", ref_node=1,
        ref_dir=1, ord_data_type=6, abscissa_spacing=1, abscissa_min=1.0, abscissa_inc=0.1, z_axis_value=0.0,
        num_pts=3, abscissa_spec_data_type=18, abscissa_axis_units_lab="Hz", ordinate_spec_data_type=8,
        ordinate_axis_units_lab="m", orddenom_spec_data_type=13, orddenom_axis_units_lab="N",
        z_axis_spec_data_type=0, abscissa_len_unit_exp=0, abscissa_force_unit_exp=0,
        abscissa_temp_unit_exp=0, ordinate_len_unit_exp=0, ordinate_force_unit_exp=0,
        ordinate_temp_unit_exp=0, orddenom_len_unit_exp=0, orddenom_force_unit_exp=0,
        orddenom_temp_unit_exp=0, z_axis_len_unit_exp=0, z_axis_force_unit_exp=0, z_axis_temp_unit_exp=0,
        z_axis_axis_units_lab="NONE", x=hertz, data=receptance, return_full_dict=True, byte_ordering=1,
        fp_format=2, n_ascii_lines=11, n_bytes=72, spec_data_type=0,
    )  # fmt: skip
    pyuff.UFF(str(tmp_path / "rig.uff")).write_sets([block], "overwrite")
    if binary:
        in_binary(tmp_path / "rig.uff", receptance)
    (run,) = read_data(SCENE, [f"{tmp_path / 'rig.uff'}:excitation.amplitude=50"])
    assert run.conditions == {"damper.N0": 80.0, "excitation.amplitude": 50.0}
    assert run.frequency_hz == pytest.approx(hertz)
    assert run.data == pytest.approx(50.0 * receptance, rel=1e-5)


@each(
    ("text", "words"),
    [
        ("", ["column heads"]),
        ("frequency,amplitude\n", ["rows of numbers"]),
        ("1.0,2.0\n1.1,2.0\n", ["line 1", "names of the columns"]),
        ("frequency,amplitude\n1.0,abc\n", ["line 2", "amplitude", "'abc'", "number"]),
        ("frequency,amplitude\n1.0,1.0\n1.1,\n", ["line 3", "amplitude", "leave the whole row out"]),
        ("frequency,amplitude\n1.0,1.0\n1.1,nan\n", ["line 3", "amplitude", "finite"]),
        ("frequency,amplitude\n1.0,1.0\n1.1\n", ["line 3", "2 numbers"]),
        ("frequency,amplitude\n1.0,1\n1.2,1\n1.1,1\n", ["line 4", "frequency", "sort the rows"]),
        ("frequency,amplitude\n1.0,1\n1.0,1\n", ["line 3", "frequency", "repeated"]),
        ("frequency,amplitude\n1.0,1\n-1.1,1\n", ["line 3", "frequency", "> 0"]),
        ("frequency,amplitude\n1000,1\n1100,1\n", ["line 2", "0.2 to 2.6 Hz", "rad/s"]),
        ("frequency,amplitude\n1.0,1\n1.1,-1\n", ["line 3", "amplitude", ">= 0"]),
        ("frequency,amplitude\n1.0,1\n", ["at least 2 points"]),
        ("frequency,amplitud\n1.0,1\n1.1,1\n", ["line 1", "amplitud", "did you mean `amplitude`"]),
        ("frequency,amplitude [furlong]\n1.0,1\n1.1,1\n", ["furlong", "mm"]),
        ("frequency,frequency\n1.0,1\n", ["line 1", "once"]),
        ("frequency,phase\n1.0,1\n1.1,1\n", ["columns", "amplitude"]),
        ("# dampr.N0 = 3\nfrequency,amplitude\n1.0,1\n1.1,1\n", ["line 1", "dampr.N0", "damper.N0"]),
        ("# damper.N0 = x\nfrequency,amplitude\n1.0,1\n1.1,1\n", ["line 1", "damper.N0", "number"]),
        ("# damper.N0 = -3\nfrequency,amplitude\n1.0,1\n1.1,1\n", ["damper.N0", "-3"]),
        ("# dof = m9\nfrequency,amplitude\n1.0,1\n1.1,1\n", ["dof", "m9", "m1"]),
        ("frequency,max_abs [g]\n1.0,1\n1.1,1\n", ["displacement"]),
        ("frequency,amplitude,phase\n1.0,1,5000\n1.1,1,0\n", ["line 2", "phase", "720"]),
        ("motion,force\n0,0\n1,1\n", ["at least 16"]),
    ],
)
def test_bad_data_are_told_with_their_line(tmp_path: Path, text: str, words: list[str]) -> None:
    with pytest.raises(DataError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert "rig.csv" in message
    assert all(word in message for word in words), message


def test_a_loop_that_feeds_energy_is_refused() -> None:
    tau = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    data = [{"motion": np.sin(tau).tolist(), "force": (-np.cos(tau)).tolist()}]
    with pytest.raises(DataError, match="dissipates"):
        read_data(SCENE, data)


def test_a_loop_without_its_whole_period_is_refused() -> None:
    time = np.linspace(0.0, 0.3, 64)
    columns = {
        "time": time.tolist(),
        "motion": np.sin(6.0 * time).tolist(),
        "force": np.cos(6.0 * time).tolist(),
    }
    with pytest.raises(DataError, match="whole period"):
        read_data(SCENE, [{**columns, "frequency": 1.0}])


def test_amplitudes_in_millimetres_without_their_unit_are_told() -> None:
    data = [{"frequency": [1.0, 1.1, 1.2], "amplitude": [1900.0, 2100.0, 1800.0]}]
    with pytest.raises(DataError, match=r"give the unit"):
        optim.identify(SCENE, data, {"damper.mu": (0.1, 0.6)}, harmonics=3, starts=1)


@each(
    ("data", "words"),
    [
        ([], ["data", "at least one"]),
        ([3], ["data[0]", "file or a table"]),
        (["nowhere.csv"], ["nowhere.csv", "there"]),
        (["rig.xls"], [".csv", ".uff"]),
        ([{"frequency": [1.0, 1.1], "amplitude": [1.0, "x"]}], ["data[0], row 1", "amplitude"]),
        ([{"frequency": [1.0, 1.1], "amplitude": [1.0]}], ["data[0]", "amplitude", "as the other columns"]),
        ([{"frequency": [1.0, 1.1], "amplitude": [1.0, 1.0], "colour": "red"}], ["colour"]),
        (
            [{"frequency": [1.0, 1.1], "amplitude": [1.0, 1.0], "conditions": {"damper.mu": 0.3}}],
            ["damper.mu", "looked for"],
        ),
    ],
)
def test_bad_descriptions_are_told(data: list[Any], words: list[str]) -> None:
    with pytest.raises(DataError) as caught:
        read_data(SCENE, data, unknown=("damper.mu",))
    assert all(word in str(caught.value) for word in words), str(caught.value)


@pytest.mark.parametrize(
    ("text", "line"), [("", 1), ("# damper.N0 = 100\n\nfrequency [Hz],amplitude [mm]\n", 3)]
)
def test_a_file_without_rows_is_told_with_its_line(tmp_path: Path, text: str, line: int) -> None:
    with pytest.raises(DataError, match=rf"rig\.csv, line {line}: must have a line of column heads"):
        read(tmp_path, text)
