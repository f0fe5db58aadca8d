"""Exports of rigs: separators, decimal commas, headings and units are told apart."""

from __future__ import annotations

from pathlib import Path

import pytest

import solver
from optim.identification.readers.csv_text import read_text
from optim.identification.readers.text_layout import Choice, guesses, layout_of, text_of
from optim.identification.reading import read_data, with_columns
from optim.problem.checks import DataError

SCENE = solver.load_scene("bladed-disk")
PATHS = frozenset(SCENE.parameter_paths())
HERTZ = [640.0, 645.5, 650.0]
MICROMETRES = [8.65, 9.01, 9.4]
DEGREES = [-11.2, -11.9, -12.8]


def german(separator: str = ";", decimal: str = ",", above: str = "Prüfstand 3\nDatum;12.3.\n\n") -> str:
    heads = ["Frequenz [Hz]", "Kraft [N]", "Spitze max [µm]", "Phase [°]", "Bemerkung"]
    lines = [above + separator.join(heads)]
    for f, x, p in zip(HERTZ, MICROMETRES, DEGREES, strict=True):
        lines.append(separator.join([*(str(v).replace(".", decimal) for v in (f, 30, x, p)), "ok"]))
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("separator", "decimal"), [(";", ","), (";", "."), ("\t", ","), (",", "."), ("|", ",")]
)
def test_every_layout_gives_the_same_numbers(separator: str, decimal: str) -> None:
    text = german(separator, decimal)
    layout = layout_of(text, "rig.csv")
    assert (layout.separator, layout.head_line, len(layout.rows)) == (separator, 4, 3)
    guessed = guesses(layout, PATHS)
    assert [one.quantity for one in guessed] == ["frequency", "excitation.amplitude", "max_abs", "phase", ""]
    choices = dict(zip(layout.heads, guessed, strict=True))
    table = read_text(text, "rig.csv", PATHS, choices).table
    assert table.columns["frequency"].tolist() == HERTZ
    assert table.columns["max_abs"].tolist() == pytest.approx([1e-6 * x for x in MICROMETRES], rel=1e-14)
    assert table.columns["phase"].tolist() == DEGREES
    assert table.columns["excitation.amplitude"].tolist() == [30.0] * 3
    assert set(table.columns) == {"frequency", "max_abs", "phase", "excitation.amplitude"}


@pytest.mark.parametrize(
    ("heads", "found"),
    [
        ("Freq (kHz);Accel in g", [("frequency", "kHz"), ("amplitude", "g")]),
        ("f_Erreger [Hz];Weg\n;µm", [("frequency", "Hz"), ("amplitude", "µm")]),
        ("Frequenz;Auslenkung\nHz;mm", [("frequency", "Hz"), ("amplitude", "mm")]),
        ("frequency;harmonic_1;T_Platte [°C]", [("frequency", None), ("", None), ("", None)]),
    ],
)
def test_headings_say_what_they_are(heads: str, found: list[tuple[str, str | None]]) -> None:
    columns = heads.split("\n")[0].count(";") + 1
    rows = "\n".join(";".join(["1,5"] * columns) for _ in range(3))
    guessed = guesses(layout_of(f"{heads}\n{rows}", "rig.csv"), PATHS)
    for one, (quantity, unit) in zip(guessed, found, strict=True):
        if quantity:
            assert one == Choice(quantity, unit)


def test_a_unit_of_a_force_becomes_newtons_and_what_is_wrong_has_its_line() -> None:
    text = "Hz;kN;mm\n640,0;0,03;2,5\n641,1;0,03;x\n"
    choices = {
        "Hz": Choice("frequency"),
        "kN": Choice("excitation.amplitude", "kN"),
        "mm": Choice("amplitude", "mm"),
    }
    with pytest.raises(DataError, match="line 3") as refused:
        read_text(text, "rig.csv", PATHS, choices)
    assert "amplitude" in str(refused.value)
    right = text.replace("x", "2,6")
    [run] = read_data(SCENE, [read_text(right, "rig.csv", PATHS, choices)])
    assert run.conditions == {"excitation.amplitude": pytest.approx(30.0, rel=1e-15)}
    assert run.observations.tolist() == pytest.approx([2.5e-3, 2.6e-3])
    with pytest.raises(DataError, match="must be a heading: Hz, kN, mm"):
        read_text(text, "rig.csv", PATHS, {"Weg": Choice("amplitude")})
    wrong = {"Hz": Choice("frequency"), "mm": Choice("amplitude", "kg")}
    with pytest.raises(DataError, match="must be in m, "):
        read_text(text.replace("x", "2,6"), "rig.csv", PATHS, wrong)


def test_a_text_without_headings_or_numbers_is_refused() -> None:
    for text in ("", "a;b\nc;d\n", "1,5;2,5\n1,6;2,6\n"):
        with pytest.raises(DataError, match="must have a line of column heads"):
            layout_of(text, "rig.csv")


def test_files_of_the_command_are_read_by_their_columns(tmp_path: Path) -> None:
    """In the code page of western Windows too, with conditions behind the name."""
    file = tmp_path / "rig.csv"
    file.write_bytes(german().replace("\n", "\r\n").encode("cp1252"))
    assert "Prüfstand" in text_of(file)
    columns = ["Frequenz=frequency", "Spitze max [µm]=max_abs:um"]
    runs = read_data(SCENE, with_columns(SCENE, [f"{file}:shroud.N0=150"], columns))
    assert [dict(run.conditions) for run in runs] == [{"shroud.N0": 150.0}]
    assert runs[0].observations.tolist() == pytest.approx([1e-6 * x for x in MICROMETRES])
    with pytest.raises(DataError, match="must be HEADING=QUANTITY:UNIT"):
        with_columns(SCENE, [str(file)], ["Weg"])


def test_decimal_commas_need_no_columns_where_the_headings_are_known(tmp_path: Path) -> None:
    file = tmp_path / "rig.csv"
    file.write_text("frequency [Hz];amplitude [mm]\n640,5;1,25\n641;1,5\n642;1,4\n", encoding="utf-8")
    [run] = read_data(SCENE, [str(file)])
    assert run.observations.tolist() == pytest.approx([1.25e-3, 1.5e-3, 1.4e-3])
