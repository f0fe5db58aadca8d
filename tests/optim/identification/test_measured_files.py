"""Files of measured data in the styles of the usual programs: each is read right, or refused by its name."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyuff
from each import each
from measured_files import HERTZ, MOTION, UNITS, Measured, Text, Universal

import solver
from optim.identification.data.response import ResponseRun
from optim.identification.readers.csv_text import read_text
from optim.identification.readers.text_layout import Choice, decoded, guesses, layout_of
from optim.identification.reading import job_tables, read_data, with_columns
from optim.problem.checks import DataError
from solver.errors import SceneError

SCENE = solver.load_scene("two-dof")
PATHS = frozenset(SCENE.parameter_paths())
PEAK, RECEPTANCE, ACCELERANCE = UNITS[1], UNITS[11], UNITS[16]
G_RMS = Measured(2, "g rms", 9.80665 * np.sqrt(2.0))
MM_PP, MM_RMS = Measured(0, "mm pk-pk", 0.5e-3), Measured(0, "mm rms", np.sqrt(2.0) * 1e-3)
RIGHT = ""


def read(file: Path, behind: str = "", columns: Sequence[str] = ()) -> ResponseRun:
    [run] = read_data(SCENE, with_columns(SCENE, [f"{file}{behind}"], columns))
    assert isinstance(run, ResponseRun)
    return run


def judge(run: ResponseRun, rounding: np.ndarray | float = 0.0) -> None:
    """Raise unless a run is the motion that was written."""
    assert run.frequency_hz == pytest.approx(HERTZ, rel=1e-5)
    truth = MOTION if np.iscomplexobj(run.data) else np.abs(MOTION)
    assert np.all(np.abs(run.data - truth) <= 1e-4 * np.abs(MOTION) + rounding)


def outcome(folder: Path, style: Universal | Text, behind: str = "") -> str:
    """Return the refusal of a file; nothing if it was read right. Read as something else it is an error."""
    file = folder / f"rig{style.suffix if isinstance(style, Text) else '.uff'}"
    file.write_bytes(style.written())
    try:
        run = read(file, behind, columns_of(style))
    except DataError as error:
        return str(error)
    judge(run, style.rounding if isinstance(style, Text) else 0.0)
    return RIGHT


U, T = Universal, Text
SINGLE = {"double": False}
GERMAN = {
    "decimal": ",",
    "separator": ";",
    "heads": ("Frequenz", "Weg Realteil", "Weg Imaginärteil"),
    "form": "parts",
}
TESTLAB = "Simcenter Testlab\t2024\nProject\tRig 3\n\n"
LVM = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t,\n"
    "***End_of_Header***\t\n\t\nChannels\t2\t\nSamples\t15\t15\t\n***End_of_Header***\t\t\t\n"
)
FILES: dict[str, tuple[Universal | Text, str]] = {
    # Universal files
    "receptance m/N": (U(), RIGHT),
    "accelerance (m/s²)/N in single precision, even": (U(unit=ACCELERANCE, even=True, **SINGLE), RIGHT),
    "mobility mm/s/N": (U(unit=UNITS[15]), RIGHT),
    "mm/kN": (U(unit=UNITS[13]), RIGHT),
    "m/s2/kN": (U(unit=UNITS[17], even=True), RIGHT),
    "g/N": (U(unit=UNITS[18]), RIGHT),
    "g/lbf": (U(unit=UNITS[19], **SINGLE), RIGHT),
    "in/lbf": (U(unit=UNITS[14]), RIGHT),
    "accelerance without labels, 164 in mm and N": (
        U(unit=ACCELERANCE, labelled=False, system=(1e3, 1.0)),
        RIGHT,
    ),
    "receptance without labels, 164 in feet and lbf": (
        U(labelled=False, system=(3.280839895, 0.2248089431)),
        RIGHT,
    ),
    "labels before 164": (U(unit=UNITS[13], system=(3.280839895, 0.2248089431)), RIGHT),
    "amplitude, real": (U(unit=UNITS[0], real=True), RIGHT),
    "amplitude, real, single, uneven": (U(unit=UNITS[0], real=True, **SINGLE), RIGHT),
    "no denominator": (U(unit=PEAK), RIGHT),
    "binary, little-endian": (U(binary="<"), RIGHT),
    "binary, big-endian, even": (U(binary=">", even=True), RIGHT),
    "binary, single": (U(binary="<", unit=ACCELERANCE, **SINGLE), RIGHT),
    "exponents with D": (U(exponent="D"), RIGHT),
    "along -Z by a force along +Z": (U(direction=-3, reference=(1, 3), sign=-1.0), RIGHT),
    "along -Z by a force along -Z": (U(direction=-3, reference=(1, -3)), RIGHT),
    "spectrum, rms": (U(function=12, unit=G_RMS), RIGHT),
    "spectrum, pk-pk": (U(function=12, unit=MM_PP), RIGHT),
    "type unknown, complex by a force": (U(function=0), RIGHT),
    "ordinate general with a label": (U(unit=ACCELERANCE, ordinate=1), RIGHT),
    "spectrum, not said whether rms": (U(function=12, unit=PEAK), "says pk, rms or pk-pk"),
    "type unknown": (U(function=0, unit=PEAK, real=True), "general or unknown"),
    "time response": (U(function=1, abscissa=17, unit=UNITS[0], real=True), "time response"),
    "auto spectrum": (U(function=2, unit=UNITS[0], real=True), "auto spectrum"),
    "cross spectrum": (U(function=3), "cross spectrum"),
    "transmissibility": (U(function=5, unit=UNITS[7]), "transmissibility"),
    "transmissibility as a frequency response": (U(unit=UNITS[7], denominator=12), "transmissibility"),
    "coherence": (U(function=6, unit=UNITS[0], real=True), "coherence"),
    "PSD": (U(function=9, unit=UNITS[0], real=True), "power spectral density"),
    "PSD by its label": (U(unit=UNITS[0], real=True, ordinate_label="m^2/Hz"), "a spectral density"),
    "square by its label": (
        U(unit=UNITS[0], real=True, ordinate_label="(m/s^2)^2"),
        "the square of a motion",
    ),
    "order function": (U(function=27), "order function"),
    "over the speed": (U(abscissa=19), "over the frequency"),
    "a rotation": (U(direction=5), "translation"),
    "by a moment": (U(reference=(1, 6)), "not a moment"),
    "a strain": (U(ordinate=3), "displacement"),
    "volts": (U(ordinate_label="V"), "must be in m, "),
    "a velocity in g": (U(unit=UNITS[18], ordinate=11), "velocity"),
    "VAX floats": (U(binary="<", floats=1), "floating point format"),
    # Text
    "Excel, German": (T(**GERMAN), RIGHT),
    "Excel, German, thousands": (T(**GERMAN, group=".", digits=4), RIGHT),
    "Excel, German, whole mm": (
        T(group=".", decimal=",", form="amplitude", unit=Measured(0, "µm", 1e-6), digits=2),
        RIGHT,
    ),
    "Excel, German, UTF-16": (T(**GERMAN, encoding="utf-16", ending="\r\n"), RIGHT),
    "Excel, German, cp1252": (T(**GERMAN, unit=UNITS[2], encoding="cp1252", digits=3), RIGHT),
    "Excel, French": (T(**GERMAN, group="\u202f", digits=4, encoding="utf-8-sig"), RIGHT),
    "Excel, French, cp1252": (T(**GERMAN, group="\u00a0", digits=4, encoding="cp1252"), RIGHT),
    "Excel, Swiss": (T(group="'", form="phase", heads=("Frequenz", "Auslenkung", "Phase")), RIGHT),
    "Excel, Swiss, curly": (T(group="\u2019", form="phase", digits=3), RIGHT),
    "Excel, US, thousands in quotes": (T(separator=",", group=",", quoted=True, digits=4), RIGHT),
    "Excel, US": (T(separator=",", unit=UNITS[14], form="parts"), RIGHT),
    "decimal commas in quotes": (T(separator=",", decimal=",", quoted=True, form="phase"), RIGHT),
    "MATLAB, complex cells": (T(separator=",", form="cells"), RIGHT),
    "NumPy, complex cells in brackets": (T(separator="\t", form="cells", index="j", exponent="e"), RIGHT),
    "Fortran, D exponents": (T(separator="\t", form="parts", exponent="D"), RIGHT),
    "LabVIEW": (
        T(
            separator="\t",
            decimal=",",
            above=LVM,
            heads=("X_Value", "Weg", "Phase"),
            form="phase",
            suffix=".lvm",
        ),
        RIGHT,
    ),
    "Testlab": (
        T(
            separator="\t",
            above=TESTLAB,
            unit=UNITS[16],
            form="parts",
            heads=("Frequency", "Real", "Imag"),
            encoding="utf-16-le",
        ),
        RIGHT,
    ),
    "B&K, units below": (
        T(
            separator="\t",
            unit=UNITS[8],
            units_below=True,
            form="parts",
            heads=("Frequency", "Real", "Imaginary"),
            encoding="cp1252",
        ),
        RIGHT,
    ),
    "OROS, RMS said": (T(unit=G_RMS, form="amplitude", heads=("Frequency", "Accel")), RIGHT),
    "m+p, pk-pk said": (T(unit=MM_PP, form="amplitude", heads=("Frequency", "Disp p-p")), RIGHT),
    "RMS by its heading": (T(form="amplitude", heads=("Frequency", "Displacement RMS")), "mm rms"),
    "pk-pk by its heading": (T(form="amplitude", heads=("Frequency", "Weg Spitze-Spitze")), "mm pk-pk"),
    "coherence as text": (
        T(form="amplitude", unit=UNITS[0], heads=("Frequency", "Coherence")),
        "a coherence",
    ),
    "PSD as text": (
        T(form="amplitude", unit=Measured(0, "m²/Hz", 1.0), heads=("f", "x")),
        "a spectral density",
    ),
    "auto spectrum as text": (T(form="amplitude", heads=("Frequency", "Autospectrum")), "auto spectrum"),
    "cross spectrum as text": (T(form="amplitude", heads=("Frequency", "Crosspower")), "cross spectrum"),
    "transmissibility as text": (
        T(form="amplitude", unit=Measured(2, "g/g", 1.0), heads=("f", "x")),
        "transmissibility",
    ),
    "decibels": (T(form="amplitude", unit=Measured(0, "dB", 1.0), heads=("f", "x")), "decibels"),
    "receptance without its newtons": (T(form="amplitude", heads=("Frequency", "Receptance")), "by a force"),
    "acceleration in mm": (T(form="amplitude", heads=("Frequency", "Beschleunigung")), "an acceleration"),
    "over the time": (T(form="amplitude", heads=("Time", "Displacement")), "over the frequency"),
    "three decimals, or thousands": (
        T(form="amplitude", digits=3, unit=Measured(0, "um", 1e-6), decimal="."),
        RIGHT,
    ),
}


def columns_of(style: Universal | Text) -> list[str]:
    if isinstance(style, Universal):
        return []
    told = style.choices()
    if style.units_below or "X_Value" in style.heads:
        names = dict(zip(style.columns(), style.heads, strict=True))
        told = [f"{name}={quantity}" for quantity, name in names.items()]
    return told


@each("name", FILES)
def test_each_is_read_right_or_refused_by_its_name(tmp_path: Path, name: str) -> None:
    style, wanted = FILES[name]
    found = outcome(tmp_path, style)
    assert wanted in found
    assert bool(wanted) == bool(found), found


def test_there_are_sixty_of_all_functions() -> None:
    assert len(FILES) >= 60
    assert {style.function for style, _ in FILES.values() if isinstance(style, Universal)} >= {
        *range(7),
        9,
        12,
    }


MARKS = {";": (",", "."), "\t": (",", "."), ",": (".",), "|": (",", ".")}
GROUPS = ("", "", " ", "'", "\u00a0", "\u202f", "\u2019")
ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252")
ABOVE = ("", TESTLAB, "Prüfstand 3;x\nDatum;12.3.\n\n", LVM)
NO_RESPONSE = {
    2: "auto spectrum",
    3: "cross spectrum",
    5: "transmissibility",
    6: "coherence",
    9: "power spectral",
}


def universal_at_random(draw: random.Random) -> tuple[Universal, str]:
    function = draw.choice((4, 4, 4, 4, 12, *NO_RESPONSE))
    unit = draw.choice([each for each in UNITS if "²" not in each.unit or draw.random() < 0.5])
    if function == 12:
        scaled = draw.choice((G_RMS, MM_PP, MM_RMS, unit))
        unit = scaled if scaled is not unit or unit.force else PEAK
    labelled = function == 12 or draw.random() < 0.7
    directions = draw.choice(((1, 1), (-2, -2), (3, -3), (-1, 2), (0, 0)))
    sign = np.prod([np.sign(each or 1) for each in (directions if unit.force else directions[:1])])
    made = Universal(
        function=function,
        unit=unit if labelled else replace(unit, factor=1.0, newtons=1.0),
        labelled=labelled,
        direction=directions[0],
        reference=(draw.randrange(9), directions[1]),
        even=draw.random() < 0.5,
        double=draw.random() < 0.5,
        binary=draw.choice(("", "<", ">")),
        exponent=draw.choice("ED"),
        sign=float(sign),
        system=draw.choice((None, (1e3, 1.0), (1e3, 1e3), (39.37007874, 0.2248089431))),
        node=draw.randrange(99),
        title=draw.choice(("NONE", "Prüfstand: Lauf 3", "damper.N0 = 100")),
    )
    said = unit.force or unit in (G_RMS, MM_PP, MM_RMS)
    return made, NO_RESPONSE.get(function, RIGHT if function == 4 or said else "says pk, rms or pk-pk")


def text_at_random(draw: random.Random) -> tuple[Text, str]:
    separator = draw.choice([*MARKS])
    decimal = draw.choice(MARKS[separator])
    quoted = separator == "," and draw.random() < 0.5
    decimal = draw.choice(",.") if quoted else decimal
    apart = {".": ",", ",": "."}[decimal]
    group = draw.choice((*GROUPS, apart if separator != "," or quoted else ""))
    whole = draw.random() < 0.3
    unit = draw.choice((UNITS[1], UNITS[2], UNITS[5]) if whole else UNITS)
    encoding = draw.choice(ENCODINGS)
    if encoding == "cp1252" and group in ("\u202f", "'"):
        group = "\u00a0"
    heads = draw.choice(((), ("Frequenz", "x", "y"), ("f_err", "Kanal 1", "Kanal 2")))
    above = draw.choice(ABOVE) if heads else ""
    made = Text(
        unit=unit,
        form=draw.choice(("amplitude", "phase", "parts", "cells")),
        heads=heads,
        separator=separator,
        decimal=decimal,
        group=group,
        digits=draw.choice((3, 4, 6, 9)),
        encoding=encoding,
        quoted=quoted,
        above=above.replace("\t", separator) if not quoted else "",
        exponent=draw.choice(("", "", "", "e", "D")),
        ending=draw.choice(("\n", "\r\n")),
        index=draw.choice("ij"),
        suffix=draw.choice((".csv", ".txt", ".lvm")),
        whole=whole,
        minutes=draw.random() < 0.5,
    )
    return made, RIGHT


@pytest.mark.few(40)
@pytest.mark.parametrize("seed", range(800))
def test_files_at_random(tmp_path: Path, seed: int) -> None:
    """Function, unit, separators, encoding and headings at random: right, or refused by name."""
    draw = random.Random(seed)
    made: Universal | Text
    made, wanted = (universal_at_random if seed % 2 else text_at_random)(draw)
    found = outcome(tmp_path, made)
    # What can be two numbers is asked, and is right as soon as that is said.
    if "say which by `decimal=" in found and isinstance(made, Text):
        said = {".": "point", ",": "comma"}[made.decimal]
        found = outcome(tmp_path, made, f":decimal={said}")
    assert wanted in found
    assert bool(wanted) == bool(found), found


def test_places_are_listed_and_chosen(tmp_path: Path) -> None:
    functions = [
        Universal(node=node, direction=way, reference=(ref, 1))
        for node, way, ref in ((1, 1, 5), (2, 1, 5), (2, 3, 5), (2, 3, 8))
    ]
    coherence = replace(functions[2], function=6, real=True, unit=UNITS[0])
    file = tmp_path / "rig.uff"
    file.write_bytes(b"".join(each.written() for each in (*functions, coherence)))
    steps = (("", "function"), (":function=frf", "node"), (":function=4,node=2", "direction"))
    for behind, asked in (*steps, (":function=frf,node=2,direction=Z", "reference")):
        with pytest.raises(DataError, match=f"differ in `{asked}`: choose one by rig.uff:{asked}="):
            read(file, behind)
    judge(read(file, ":function=frf,node=2,direction=Z,reference=8"))
    judge(read(file, ":function=frf,node=1,damper.N0=80"))
    with pytest.raises(DataError, match=r"must choose one of function=.*node=1, direction=X"):
        read(file, ":node=7")
    with pytest.raises(DataError, match="`nodes` must be a parameter path, or one of"):
        read(file, ":nodes=1")
    with pytest.raises(DataError, match="`node` must be a parameter path, or one of"):
        read(tmp_path / "rig.csv", ":node=1")


def test_levels_of_one_place_are_runs(tmp_path: Path) -> None:
    functions = [Universal(title=f"damper.N0 = {load}") for load in (80, 160)]
    file = tmp_path / "rig.uff"
    file.write_bytes(b"".join(each.written() for each in functions))
    runs = read_data(SCENE, [file])
    assert [run.conditions for run in runs] == [{"damper.N0": 80.0}, {"damper.N0": 160.0}]


def test_another_reader_finds_the_same_numbers(tmp_path: Path) -> None:
    """pyuff, which shares nothing with ours, of what is written here."""
    for i, made in enumerate(
        (Universal(), Universal(even=True, double=False), Universal(unit=UNITS[0], real=True))
    ):
        file = tmp_path / f"{i}.uff"
        file.write_bytes(made.written())
        [one] = [pyuff.UFF(str(file)).read_sets(0)]
        run = read(file)
        assert run.frequency_hz == pytest.approx(one["x"], rel=1e-12)
        assert run.data == pytest.approx(one["data"] * (100.0 if made.unit.force else 1.0), rel=1e-12)


def test_numbers_that_can_be_two_are_asked(tmp_path: Path) -> None:
    file = tmp_path / "rig.csv"
    file.write_text("frequency;max_abs [mm]\n1;601\n2;1.446\n", encoding="utf-8")
    with pytest.raises(
        DataError, match=r"can be 1\.446 or 1446: say which by `decimal=point` or `decimal=comma`"
    ):
        read(file)
    assert read(file, ":decimal=comma").data.tolist() == pytest.approx([0.601, 1.446])
    assert read(file, ":decimal=point").data.tolist() == pytest.approx([0.601, 1.446e-3])
    [table] = job_tables(SCENE, [f"{file}:decimal=comma"])
    assert table["max_abs"] == [601.0, 1446.0]
    [run] = read_data(SCENE, [read_text("# decimal = comma\n" + file.read_text("utf-8"), "rig.csv", PATHS)])
    assert run.observations.tolist() == pytest.approx([0.601, 1.446])
    file.write_text("frequency;max_abs [mm]\n0,5;601\n1,5;1.446\n2,5;1446\n", encoding="utf-8")
    with pytest.raises(DataError, match="same decimal and thousands separators"):
        read(file)
    file.write_text("frequency;max_abs [mm]\n0,5;601\n1,5;1_446\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"line 3.*must be a number"):
        read(file)


def test_decimal_commas_between_commas_are_told(tmp_path: Path) -> None:
    file = tmp_path / "rig.csv"
    file.write_text("frequency,amplitude [mm]\n0,5,1,25\n0,6,1,5\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"line 2.*decimal commas between commas must stand in quotes"):
        read(file)


def test_units_of_conditions_count(tmp_path: Path) -> None:
    file = tmp_path / "rig.csv"
    rows = "frequency,amplitude,excitation.amplitude [kN],damper.N0 [lbf]\n1,1,0.1,10\n1.1,1,0.1,10\n"
    file.write_text(rows, encoding="utf-8")
    assert read(file).conditions == pytest.approx(
        {"excitation.amplitude": 100.0, "damper.N0": 44.482216152605}
    )
    file.write_text(rows.replace("damper.N0 [lbf]", "damper.kt [N/mm]"), encoding="utf-8")
    with pytest.raises(DataError, match=r"`damper\.kt`: must be in N/m, got 'N/mm'"):
        read(file)


def test_parts_are_of_one_kind_of_unit() -> None:
    table = {
        "frequency": [1.0, 1.1],
        "real": [1.0, 1.0],
        "imag": [1.0, 1.0],
        "units": {"real": "mm", "imag": "mm/s2"},
    }
    with pytest.raises(DataError, match="both displacements"):
        read_data(SCENE, [table])
    complex_one = {"frequency": [1.0, 1.1], "amplitude": [1.0 + 2.0j, 2.0], "units": {"amplitude": "mm"}}
    [run] = read_data(SCENE, [complex_one])
    assert run.observations.tolist() == pytest.approx([1e-3, 2e-3, 2e-3, 0.0])


def test_a_look_leaves_out_what_is_no_response() -> None:
    text = "Frequency [Hz];Coherence;Displ RMS [mm]\n0.5;1;2\n0.6;1;2\n"
    assert guesses(layout_of(text, "rig.csv"), PATHS) == (
        Choice("frequency", "Hz"),
        Choice(""),
        Choice("amplitude", "mm rms"),
    )
    with pytest.raises(DataError, match="is a universal file"):
        layout_of(decoded(Universal().written()), "rig.csv")


def test_a_mark_in_a_scene_and_decimal_commas(tmp_path: Path) -> None:
    file = tmp_path / "rig.toml"
    text = (Path(solver.__file__).parent / "scene" / "shipped" / "two-dof.toml").read_text("utf-8")
    file.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert solver.load_scene(file) == solver.load_scene("two-dof")
    file.write_text("mu = 0,3\n" + text, encoding="utf-8")
    with pytest.raises(SceneError, match=r"line 1.*0,3: a decimal point, as in 0\.3"):
        solver.load_scene(file)
