"""Harwell-Boeing files as other programs write them: every number comes back, or the file is refused."""

from pathlib import Path

import numpy as np
from each import each
from matrix_cases import hb_text
from scipy.io import hb_read, hb_write
from scipy.sparse import csc_array, random_array

from solver.matrices.readers.harwell_boeing import read_harwell_boeing
from solver.matrices.readers.numbers_in_text import FormatError

DATA = Path(__file__).parent.parent.parent / "data"
WIDTHS = ("{:24.16E}", "{:25.16E}", "{:26.17E}", "{:23.15E}")


def test_a_file_of_scipy_is_read() -> None:
    """Its header says 25 characters a number, its lines hold 24."""
    expected = [[2.0, -1.0], [-1.0, 2.0]]
    assert np.array_equal(read_harwell_boeing(DATA / "tiny.hb").toarray(), expected)


def random_matrix(seed: int, exponents: float) -> csc_array:
    """Any shape and filling, both signs, exponents up to a power of ten."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(1, 30, 2).tolist())
    stored = csc_array(random_array(shape, density=float(rng.uniform(0.05, 1.0)), rng=rng))
    stored.data = rng.choice([-1.0, 1.0], stored.nnz) * rng.random(stored.nnz)
    stored.data *= 10.0 ** rng.uniform(-exponents, exponents, stored.nnz)
    return stored


@each("seed", range(60))
def test_what_scipy_writes_is_read(seed: int, tmp_path: Path) -> None:
    """Above 1e99 and below 1e-99 numbers touch, which SciPy itself cannot read back."""
    A = random_matrix(seed, 90.0 if seed % 3 else 290.0)
    if A.nnz == 0:
        return  # SciPy writes no empty matrix
    hb_write(tmp_path / "a.hb", A)
    found = read_harwell_boeing(tmp_path / "a.hb")
    assert np.array_equal(found.toarray(), A.toarray())
    if seed % 3:
        assert np.array_equal(found.toarray(), hb_read(tmp_path / "a.hb", spmatrix=False).toarray())


def test_whole_numbers_of_scipy_are_read(tmp_path: Path) -> None:
    A = csc_array(np.array([[2, -11], [0, 305]]))
    hb_write(tmp_path / "a.hb", A)
    assert np.array_equal(read_harwell_boeing(tmp_path / "a.hb").toarray(), A.toarray())


@each("kind", ["RSA", "RUA"])
@each("written", WIDTHS)
@each("letter", ["E", "D", ""])
def test_any_width_under_any_header(kind: str, written: str, letter: str, tmp_path: Path) -> None:
    """Columns narrower, as wide or wider than the header says; exponents with E, with D, without a letter."""
    rng = np.random.default_rng(7)
    A = rng.normal(size=(7, 7)) * 10.0 ** rng.uniform(-120.0, 120.0, (7, 7))
    A = A + A.T if kind == "RSA" else A
    text = hb_text(A, kind)
    for value in np.unique(A):
        text = text.replace(f"{value:26.17E}", written.format(value).replace("E", letter))
    (tmp_path / "a.hb").write_text(text)
    found = read_harwell_boeing(tmp_path / "a.hb").toarray()
    assert np.allclose(found, A, rtol=1e-14, atol=0.0)


@each("seed", range(20))
def test_a_character_lost_is_noticed_or_does_no_harm(seed: int, tmp_path: Path) -> None:
    """A blank that is missing moves columns: the values stay, or the file is refused."""
    A = random_matrix(1000 + seed, 30.0).toarray() + 1.0
    text = hb_text(A @ A.T, "RUA")
    head, last = text.rsplit("\n", 2)[0], text.rsplit("\n", 2)[1]
    lines = [*head.split("\n"), last]
    at = 4 + sum(int(lines[1][k : k + 14]) for k in (14, 28))
    row = at + seed % (len(lines) - at)
    blanks = [i for i, letter in enumerate(lines[row]) if letter == " "]
    place = blanks[seed % len(blanks)]
    lines[row] = lines[row][:place] + lines[row][place + 1 :]
    (tmp_path / "a.hb").write_text("\n".join(lines) + "\n")
    try:
        found = read_harwell_boeing(tmp_path / "a.hb").toarray()
    except FormatError:
        return
    assert np.array_equal(found, A @ A.T)
