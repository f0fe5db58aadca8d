"""Matrices of finite-element programs: every layout read, damaged files told by line or byte, rows named."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from each import each
from fe_file_set import NODES, A, files
from fe_files import abaqus_input, ansys_mapping, dmig, hbmat, op4_binary, op4_text

from solver.matrices.load_set import (
    MatrixFileError,
    array_names,
    in_si,
    read_labelled,
    read_labels,
    read_matrix,
    read_set,
)
from solver.matrices.readers.numbers_in_text import FormatError, Label, label

LABELS = tuple(Label(*pair) for pair in ((3, "UX"), (3, "UY"), (8, "UX"), (8, "ROTZ"), (12, "UZ")))
# Two masses by hand after the documents, so that our writer and reader do not share a mistake.
BY_HAND = {
    "stiff.matrix": (
        "Stiffness matrix from ANSYS FULL file dumped into Harwell-Boeing format         \n"
        "             9             3             3             3             0\n"
        "RSA                        2             2             3             0\n"
        "(I14)           (I14)           (d25.15)            (d25.15)            \n"
        "             1\n             3\n             4\n             1\n             2\n             2\n"
        "    0.300000000000000D+01\n   -0.150000000000000D+01\n    0.250000000000000D+01\n"
    ),
    "k.mtx": "** stiffness\n1,1, 1,1,  3.000000000000000e+00\n2,1, 1,1, -1.500000000000000e+00\n"
    "2,1, 2,1,  2.500000000000000e+00\n",
    "k-full.mtx": "1,1, 1,1, 3.0e+00\n1,1, 2,1, -1.5e+00\n2,1, 1,1, -1.5e+00\n2,1, 2,1, 2.5e+00\n",
    "k-coordinate.mtx": "1 1 3.0e+00\n2 1 -1.5e+00\n2 2 2.5e+00\n",
    "blade.sti": "1 1  3.0000000000000e+00\n1 2 -1.5000000000000e+00\n2 2  2.5000000000000e+00\n",
    "k.pch": (
        "DMIG    KAAX           0       6       2       0\n"
        "DMIG*   KAAX                           1               1\n"
        "*                      1               1 3.000000000D+00\n"
        "*                      2               1-1.500000000D+00\n"
        "DMIG*   KAAX                           2               1\n"
        "*                      2               1 2.500000000D+00\n"
    ),
    "small.bdf": (
        "$ after the Quick Reference Guide\nGRID,1,,0.,0.,0.\n"
        "DMIG    STIF           0       6       1\n"
        "DMIG    STIF           1       1               1       1    3.+0\n"
        "+              2       1   -1.5\n"
        "DMIG,STIF,2,1,,2,1,2.5\nENDDATA\n"
    ),
    "k.op4": (
        "       2       2       6       2KAA     1P,3E23.16\n"
        "       1       1       4\n 3.0000000000000000E+00-1.5000000000000000E+00\n"
        "       2       1       4\n-1.5000000000000000E+00 2.5000000000000000E+00\n"
        "       3       1       1\n 1.0000000000000000E+00\n"
    ),
    "strings.op4": (
        "       2      -2       6       1KAA     1P,5E16.9\n"
        "       1       0       4\n       3       1\n 3.000000000E+00-1.500000000E+00\n"
        "       2       0       3\n       2       2\n 2.500000000E+00\n"
        "       3       1       1\n 1.000000000E+00\n"
    ),
}


@each("name", BY_HAND)
def test_layouts_by_hand(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(BY_HAND[name])
    assert np.array_equal(read_matrix(tmp_path / name, "K").toarray(), [[3.0, -1.5], [-1.5, 2.5]])


@each("name", files())
def test_every_layout_gives_the_matrix(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(files()[name])
    found = read_matrix(tmp_path / name, "K").toarray()
    assert found == pytest.approx(A, rel=1e-6 if "single" in name else 1e-9)
    assert np.array_equal(found, found.T)


def test_large_harwell_boeing_files_are_read_as_small_ones(tmp_path: Path) -> None:
    """The quick way and the one that knows all of Fortran's rules give the same numbers."""
    rng = np.random.default_rng(1)
    B = rng.normal(size=(30, 30)) * 10.0 ** rng.integers(-20, 20, size=(30, 30))
    B = B + B.T
    text = hbmat(B)
    (tmp_path / "b.matrix").write_text(text)
    (tmp_path / "slow.matrix").write_text(text.replace("D+00", "+000"))
    quick, slow = (read_matrix(tmp_path / name, "K").toarray() for name in ("b.matrix", "slow.matrix"))
    assert np.array_equal(quick, slow)
    assert quick == pytest.approx(B, rel=1e-14)


OP4 = BY_HAND["k.op4"]
DAMAGED = {
    "a.mtx": ("1,1, 1,1, 3.0\n2,1, 1,x, 1.0\n", "line 2: 'x' is not a number"),
    "b.mtx": ("** c\n1,1, 1,1, 3.0\n2,1, 1.0\n", "line 3 must hold node, DOF, node, DOF and value"),
    "c.mtx": ("1,1.5, 1,1, 3.0\n", "line 1: the DOF must be a whole number"),
    "d.mtx": ("*MATRIX,TYPE=STIFFNESS\n1\n", "line 1: '*MATRIX,TYPE=STIFFNESS' belongs to matrices of el"),
    "e.mtx": ("", "line 1: the file holds no line"),
    "f.mtx": ("0 1 3.0\n", "line 1: the row must be a whole number from 1, got 0"),
    "g.mtx": ("1 1 3.0\n\xe9", "byte 8 is not ASCII"),
    "h.mtx": ("1 99999999 3.0\n", "may have 10000000 rows"),
    "a.sti": ("1 1 3.0\n1 2\n", "line 2 must hold row, column and value"),
    "a.pch": (BY_HAND["k.pch"].replace("-1.500000000D+00", " -1.5zz"), "line 2: '-1.5zz' is not a number"),
    "b.pch": (BY_HAND["k.pch"].replace("  6  ", "  2  ", 1), "line 1: 'KAAX' must have the form 1"),
    "c.pch": ("\n".join(BY_HAND["k.pch"].splitlines()[1:]), "line 1: a column of 'KAAX' stands before"),
    "d.pch": ("GRID,1\n", "holds no DMIG entry"),
    "e.pch": (BY_HAND["k.pch"].splitlines()[0] + "\n", "'KAAX' has a heading but no entries"),
    "f.pch": (BY_HAND["k.pch"].replace("2               1", "2               9", 1), "a component must be"),
    "g.pch": (BY_HAND["k.pch"].replace("  2       0", "  3       0"), "type 1 or 2 (real)"),
    "a.op4": (OP4.replace("2KAA", "xKAA"), "line 1 must hold columns, rows, form and type"),
    "b.op4": (OP4.replace("1P,3E23.16", "nothing"), "line 1: 'nothing' is no format"),
    "c.op4": (OP4.replace("       1       1       4", "       1       9       4"), "line 2: rows 9 to 10"),
    "d.op4": (OP4.replace("-1.5000000000000000E+00\n", "-1.500000000000000xE+00\n"), "line 3, column 24"),
    "e.op4": ("\n".join(OP4.splitlines()[:4]), "line 5 is missing"),
    "f.op4": (OP4.replace("       2       1       4", "       2       1       3"), "3 words are no whole"),
    "g.op4": (OP4.replace("       6       2KAA", "       3       2KAA"), "'KAA' is diagonal"),
    "h.op4": (OP4.replace("       2KAA", "       4KAA"), "real numbers, got complex128"),
    "i.op4": (OP4 + OP4, "two matrices 'KAA'"),
    "j.op4": (OP4 + OP4.replace("KAA", "KGG"), "it holds `KAA`, `KGG`"),
    "k.op4": (BY_HAND["strings.op4"].replace("       3       1\n", "       9       1\n"), "longer than"),
}  # fmt: skip


@each("name", DAMAGED)
def test_a_damaged_file_names_its_line(name: str, tmp_path: Path) -> None:
    text, message = DAMAGED[name]
    (tmp_path / name).write_bytes(text.encode("latin-1"))
    with pytest.raises(MatrixFileError) as caught:
        read_matrix(tmp_path / name, "K")
    assert message in str(caught.value)
    assert str(tmp_path / name) in str(caught.value)


def test_a_damaged_binary_file_names_its_byte(tmp_path: Path) -> None:
    """Every cut and many changed bytes: refused with the byte, or another matrix, never another error."""
    whole = op4_binary({"K": A}, sparse=True, bigmat=True)
    path = tmp_path / "k.op4"
    for length in range(5, len(whole) - 1, 7):
        path.write_bytes(whole[:length])
        with pytest.raises(MatrixFileError, match="byte"):
            read_matrix(path, "K")
    rng = np.random.default_rng(2)
    for _ in range(300):
        changed = bytearray(whole)
        changed[rng.integers(len(whole))] = rng.integers(256)
        path.write_bytes(changed)
        with suppress(MatrixFileError):
            read_matrix(path, "K")


def test_changed_bytes_are_refused_or_read_but_never_another_error(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    texts = {**files(), **{name: text.encode() for name, text in BY_HAND.items()}}
    letters = b"0123456789.,+-eEdD \n*\t$%x\0\xff_"
    for name, content in texts.items():
        for _ in range(25):
            changed, at = bytearray(content), int(rng.integers(len(content)))
            if rng.integers(2):
                changed[at] = letters[rng.integers(len(letters))]
            else:
                del changed[at : at + int(rng.integers(1, 30))]
            (tmp_path / name).write_bytes(changed)
            with suppress(MatrixFileError):
                read_matrix(tmp_path / name, "K")


def test_rows_are_named_by_the_files_that_know(tmp_path: Path) -> None:
    for name in ("k.mtx", "k.pch"):
        (tmp_path / name).write_bytes(files()[name])
        assert read_labelled(tmp_path / name, "K").labels == LABELS
    (tmp_path / "K.matrix").write_text(hbmat(A))
    (tmp_path / "M.matrix").write_text(hbmat(np.eye(5)))
    paths = {key: tmp_path / f"{key}.matrix" for key in "MK"}
    assert read_set(paths).labels is None
    mapping = [(found.node, found.component) for found in LABELS]
    (tmp_path / "K.mapping").write_text(ansys_mapping(mapping))
    found = read_set(paths)
    assert found.labels == LABELS
    assert found.row(Label(8, "ROTZ")) == 3
    assert found.row(Label(8, "UZ")) is None
    (tmp_path / "rows.dof").write_text("3.1\n3.2\n8.1\n8.6\n12.3\n")
    assert read_labels(tmp_path / "rows.dof") == LABELS
    (tmp_path / "rows.dof").write_text("3.1\n3.2\n")
    with pytest.raises(MatrixFileError, match="names 2 rows, the matrices have 5"):
        read_set(paths, tmp_path / "rows.dof")


@pytest.mark.parametrize("text", ["8.ROTZ", "8.6", "8.R3", "8.rz"])
def test_a_label_may_be_written_in_the_ways_of_the_programs(text: str) -> None:
    assert label(text) == Label(8, "ROTZ")
    assert label("tip") is None


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.dof", "3.1\n3\n", "line 2 must hold node.direction, got '3'"),
        ("b.dof", "", "line 1 is missing"),
        ("c.dof", "3.1\n4.1\n3.1\n", "rows 1 and 3 are both 3.UX"),
        ("a.mapping", "  Matrix Eqn  Node DOF\n 1 3 UX\n 3 4 UX\n", "line 3 must be equation 2, got 3"),
        ("b.mapping", "  Matrix Eqn  Node DOF\n 1 UX\n", "line 2 must hold equation, node and DOF"),
    ],
)
def test_a_damaged_file_of_labels_names_its_line(name: str, text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(FormatError, match=message):
        read_labels(tmp_path / name)


def test_rows_come_together_by_their_labels(tmp_path: Path) -> None:
    """Abaqus: the mass in another order and without the rotation; a DOF that is held has 1e36."""
    (tmp_path / "K.mtx").write_text(abaqus_input(A, NODES) + "99,1, 99,1, 1.000000000000000e+36\n")
    order = [2, 0, 4, 1]
    masses = np.diag([5.0, 6.0, 7.0, 8.0])
    (tmp_path / "M.mtx").write_text(abaqus_input(masses, [NODES[i] for i in order]) + "99,1, 99,1, 1.0e+00\n")
    found = read_set({"M": tmp_path / "M.mtx", "K": tmp_path / "K.mtx"})
    assert (found.labels, found.held) == (LABELS, 1)
    assert np.array_equal(found.matrices["K"].toarray(), A)
    assert np.array_equal(np.diag(found.matrices["M"].toarray()), [6.0, 8.0, 5.0, 0.0, 7.0])


def test_units_are_brought_to_si_with_angles_apart(tmp_path: Path) -> None:
    (tmp_path / "K.mtx").write_text(abaqus_input(A, NODES))
    found = read_set({"K": tmp_path / "K.mtx", "M": tmp_path / "K.mtx"})
    K = in_si(found, "mm").matrices["K"].toarray()
    assert K[0, 0] == pytest.approx(4e3)  # 4 N/mm
    assert K[3, 3] == pytest.approx(7e-3)  # 7 N mm
    inch = in_si(found, "in").matrices["K"].toarray()
    assert inch[0, 0] == pytest.approx(4 * 175.12683524)
    assert inch[3, 3] == pytest.approx(7 * 0.11298482902)


def test_what_stands_beside_the_matrices_of_nastran_is_passed_over(tmp_path: Path) -> None:
    """PARAM,EXTOUT writes loads (form 9) and structural damping (K4AAX) into the same punch file."""
    loads = (
        "DMIG    PAX            0       9       2       0                       1\n"
        "DMIG*   PAX                            1               0\n"
        "*                      3               1 1.000000000D+00\n"
    )
    text = "TITLE = BLADE\nSUBCASE 1\n" + dmig("K4AAX", np.eye(5), NODES) + loads + dmig("KAAX", A, NODES)
    (tmp_path / "k.pch").write_text(text)
    assert read_matrix(tmp_path / "k.pch", "K").toarray() == pytest.approx(A)
    (tmp_path / "k.op4").write_text(op4_text({"K4AA": np.eye(5), "KRECT": A[:, :2], "KAA": A}))
    assert np.array_equal(read_matrix(tmp_path / "k.op4", "K").toarray(), A)
    wide = BY_HAND["k.op4"].splitlines()
    wide[0] = "".join(f"{n:16d}" for n in (2, 2, 6, 2)) + "KAA     1P,3E23.16"
    wide[1] = "".join(f"{n:16d}" for n in (1, 1, 4))
    (tmp_path / "wide.op4").write_text("\n".join(wide))
    assert np.array_equal(read_matrix(tmp_path / "wide.op4", "K").toarray(), [[3.0, -1.5], [-1.5, 2.5]])


def test_a_file_of_several_matrices_tells_their_names(tmp_path: Path) -> None:
    for name in ("dense.op4", "k.pch"):
        (tmp_path / name).write_bytes(files()[name])
        assert {"M", "K"} <= set(array_names(tmp_path / name))
