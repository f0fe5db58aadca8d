"""Results in Python: pictures, texts, tables and arrays of each, and files that give them back."""

from __future__ import annotations

import contextlib
import dataclasses
import re
import sys
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from each import each
from matplotlib.figure import Figure

import optim
import solver
from solver.results.base import Shown
from solver.results.files import Dataset, Variable
from solver.results.told import Piece, Told
from solver.views.io import SUFFIXES


def two_dof() -> solver.Scene:
    return solver.load_scene("two-dof")


def mistuned_disk() -> solver.Scene:
    return solver.mistuned(solver.load_scene("bladed-disk"), of="tip", spread=0.02, seed=1)


MAKERS: dict[str, Callable[[], Any]] = {
    "branch": lambda: solver.sweep(two_dof(), "frequency", 0.8, 1.4, harmonics=5),
    "solution": lambda: solver.solve(two_dof(), frequency_hz=1.2, harmonics=5),
    "march": lambda: solver.march(two_dof(), frequency_hz=1.2),
    "map": lambda: solver.response_map(
        two_dof(), "damper.N0", 50.0, 200.0, steps=4, frequencies=9, harmonics=3
    ),
    "peaks": lambda: solver.track_peak(two_dof(), "damper.N0", 50.0, 200.0, harmonics=3),
    "accuracy": lambda: solver.accuracy_study(two_dof(), 1.2, harmonics=[1, 3], samples=[64], repeats=1),
    "mistuning": lambda: solver.mistuning_study(
        solver.load_scene("bladed-disk"), of=["tip"], samples=2, harmonics=1, start=740.0, stop=780.0
    ),
    "interference": lambda: solver.interference_diagram(solver.load_scene("bladed-disk"), speed_rpm=11_000.0),
    "modes": lambda: solver.nonlinear_mode(two_dof(), amplitudes=(0.1, 3.0), harmonics=3),
    "least": lambda: solver.least_peak(two_dof(), "damper.N0", 50.0, 200.0, harmonics=3),
    "blade peaks": lambda: solver.blade_peaks(mistuned_disk(), 740.0, 780.0, harmonics=1),
    "blades": lambda: solver.blade_amplitudes(solver.solve(mistuned_disk(), frequency_hz=755.0, harmonics=1)),
    "stability": lambda: solver.stability(solver.solve(two_dof(), frequency_hz=1.2, harmonics=5)),
    "plan": lambda: solver.plan(two_dof(), harmonics=3),
    "design": lambda: optim.design(two_dof(), variables={"damper.N0": (20.0, 500.0)}, harmonics=3),
    "pareto": lambda: optim.pareto_front(
        two_dof(), variables={"damper.N0": (20.0, 500.0)}, limit=2.0, points=3, harmonics=3
    ),
    "campbell": lambda: optim.campbell_diagram(two_dof(), speeds_rpm=(50.0, 80.0), harmonics=3),
    "sensitivities": lambda: optim.sensitivities(two_dof(), harmonics=3),
    "robust": lambda: optim.robust_design(
        two_dof(), variables={"damper.N0": (20.0, 500.0)}, uncertain={"damper.mu": [0.28, 0.32]}, harmonics=1
    ),
}
_made: dict[str, Any] = {}


_SLOW = ("blade peaks", "mistuning", "robust", "accuracy", "sensitivities")


@pytest.fixture(params=[pytest.param(k, marks=pytest.mark.long if k in _SLOW else ()) for k in MAKERS])
def result(request: pytest.FixtureRequest) -> Any:
    """One of every kind of result, computed once."""
    if request.param not in _made:
        _made[request.param] = MAKERS[request.param]()
    return _made[request.param]


def same(one: Dataset, other: Dataset, *, numbers_only: bool = False) -> None:
    assert set(one.variables) == set(other.variables)
    for name, wanted in one.variables.items():
        got = other.variables[name]
        assert got.values.shape == wanted.values.shape, name
        if numbers_only and wanted.values.dtype.kind in "iuf":
            np.testing.assert_array_equal(
                np.asarray(wanted.values, float), np.asarray(got.values, float), err_msg=name
            )
            continue
        np.testing.assert_array_equal(wanted.values, got.values, err_msg=name)
        if not numbers_only:
            assert (got.dims, got.unit, got.about) == (wanted.dims, wanted.unit, wanted.about), name
            assert got.values.dtype.kind == wanted.values.dtype.kind, name
    if not numbers_only:
        assert (other.kind, other.rows) == (one.kind, one.rows)
        np.testing.assert_equal(dict(other.attributes), dict(one.attributes))


def test_a_result_says_what_it_is(result: Any) -> None:
    text, page = repr(result), result._repr_html_()
    assert len(text) < 3000
    assert "array(" not in text
    assert type(result).__name__ in text
    assert page.startswith("<table>")
    assert page.endswith("</table>")
    assert all(pair for pairs in result.summary().pairs for pair in pairs)


# What a user gives, and what is short by itself.
NOT_LOOKED_AT = {
    "Case", "ContinuationSettings", "Course", "Effects", "IntentionalMistuning", "Issue", "LawParameter",
    "Limit", "MarchStart", "Mission", "Sampling", "Summary", "WearLaw", "WorstSearch",
}  # fmt: skip


REACHED = {"COMPLETED", "CONVERGED", "TRACKED", "OPTIMAL", "KNOWN", "SAMPLED", "COMPARED"}


def public_dataclasses() -> list[type]:
    named = [getattr(package, name) for package in (solver, optim) for name in package.__all__]
    return [one for one in named if isinstance(one, type) and dataclasses.is_dataclass(one)]


@each("kind", public_dataclasses)
def test_every_public_result_says_what_it_is(kind: type) -> None:
    assert issubclass(kind, Told) != (kind.__name__ in NOT_LOOKED_AT)
    if issubclass(kind, Told):
        assert kind.__repr__ is Told.__repr__
        assert issubclass(kind, Shown | Piece)


@each("kind", public_dataclasses)
def test_every_result_with_a_status_says_in_one_word_whether_it_answers(kind: type) -> None:
    status = next((one for one in dataclasses.fields(kind) if one.name == "status"), None)
    if issubclass(kind, Shown) and status is not None:
        owner = next(one for one in kind.__mro__ if "reached" in vars(one))
        words = vars(sys.modules[kind.__module__]).get(str(status.type))
        # The root takes the first of the words for what was asked for.
        assert owner is not Shown or next(iter(words)).name in REACHED


def test_the_word_of_before_warns() -> None:
    branch = solver.sweep(two_dof(), "frequency", 0.8, 1.4, harmonics=1)
    with pytest.warns(DeprecationWarning, match="reached"):
        assert branch.completed is branch.reached is True


def test_pieces_say_their_numbers_with_units() -> None:
    scene = two_dof()
    branch = solver.sweep(scene, "frequency", 0.8, 1.4, harmonics=3, limit=2.0)
    assert branch.peak is not None
    assert re.fullmatch(
        r"<Peak: value 2\.\d+ m, at 1\.0\d+, solution 7 numbers, interior yes>", repr(branch.peak)
    )
    assert repr(branch.band).startswith("<Band: limit 2 m, width 0.")
    solution = solver.solve(scene, frequency_hz=1.2, harmonics=3)
    power = solver.power_balance(solution)
    assert repr(power).startswith("<PowerBalance: input_w ")
    assert "contacts_w damper " in repr(power)
    wear = solver.contact_wear(solution)["damper"]
    assert "shares stick 0." in repr(wear)
    assert "<Measured: value " in repr(wear)
    assert wear._repr_html_().startswith("<table><caption style='text-align:left'>ContactWear</caption>")


def test_everything_is_told_in_one_line() -> None:
    scene = two_dof()
    assert repr(scene) == str(scene)
    assert repr(scene) == "<Scene two-dof: lumped, 2 DOFs, contacts damper, m2 observed from 0.2 to 2.6 Hz>"
    stretches: list[solver.Stretch] = []
    branch = solver.sweep(
        scene, "frequency", 0.8, 1.4, harmonics=3, course=solver.Course(on_stretch=stretches.append)
    )
    solution = solver.solve(scene, frequency_hz=1.2, harmonics=3)
    data = branch.to_dataset()
    points = len(branch.values)
    assert repr(data).startswith(f"<Dataset branch: parameter point {points} [Hz], ")
    assert branch.band is not None
    shown = [branch, branch.band, solution, *solution.contacts, data, *data.variables.values(), *stretches]
    assert [one for one in shown if "\n" in repr(one) or len(repr(one)) > 2000] == []


@pytest.mark.few(3)
def test_a_result_draws_itself(result: Any) -> None:
    if isinstance(result, solver.Plan):
        return
    page = result.plot()
    assert isinstance(page, Figure)
    assert page._repr_png_().startswith(b"\x89PNG")
    mine = Figure()
    axes = mine.subplots(1, 2)
    assert result.plot(ax=axes[1]) is mine
    assert axes[1].has_data()
    assert not axes[0].has_data()
    assert axes[1].get_xlabel()
    with pytest.raises(solver.SettingError, match="`ax`"):
        result.plot(ax="left")


def test_a_result_is_a_table_and_arrays(result: Any) -> None:
    frame, arrays = result.to_pandas(), result.to_xarray()
    data = result.to_dataset()
    assert len(frame) == np.prod([data.sizes[dim] for dim in data.rows])
    table = result.to_polars()
    assert table.columns == list(frame.columns)
    assert len(table) == len(frame)
    path = arrays.attrs.get("parameter", "")
    named = {"point": path} if path in arrays.dims else {}
    assert dict(arrays.sizes) == {named.get(dim, dim): size for dim, size in data.sizes.items()}
    assert arrays.attrs["source"].startswith("stickslip")
    for name, variable in data.variables.items():
        assert arrays[name].dims == tuple(named.get(dim, dim) for dim in variable.dims)
        assert arrays[name].attrs.get("units", "") == variable.unit


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_file_gives_a_result_back(result: Any, suffix: str, tmp_path: Path) -> None:
    file = tmp_path / f"result{suffix}"
    solver.save(result, file)
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    data, got = result.to_dataset(), solver.load(file)
    if suffix == ".csv":
        same(data.table(), got, numbers_only=True)
    else:
        same(data.table() if suffix == ".parquet" else data, got)


def test_the_scene_in_a_file_reproduces_the_result(tmp_path: Path) -> None:
    scene = solver.load_scene("bladed-disk").with_values({"shroud.N0": 150.0})
    branch = solver.sweep(scene, "frequency", 700.0, 800.0, harmonics=3)
    solver.save(branch, tmp_path / "branch.nc")
    (tmp_path / "scene.toml").write_text(str(solver.load(tmp_path / "branch.nc").attributes["scene"]))
    again = solver.load_scene(tmp_path / "scene.toml")
    assert again == scene
    repeated = solver.sweep(again, "frequency", 700.0, 800.0, harmonics=3)
    np.testing.assert_array_equal(repeated.amplitude, branch.amplitude)


def test_the_parts_of_a_branch_with_odd_harmonics_alone_are_those_of_its_points() -> None:
    scene = two_dof().with_values({"damper.N1": 0.0})
    branch = solver.sweep(scene, "frequency", 0.8, 1.0, harmonics=5)
    assert branch.balance.system.ks.tolist() == [1, 3, 5]
    solution = solver.solve(scene, frequency_hz=float(branch.values[-1]), harmonics=5)
    found, wanted = branch.to_dataset(), solution.to_dataset()
    for name in ("displacement_cos", "displacement_sin"):
        np.testing.assert_allclose(found[name][-1], wanted[name], atol=1e-8)


def test_cosine_and_sine_parts_make_the_motion() -> None:
    solution = solver.solve(two_dof(), frequency_hz=1.2, harmonics=5)
    arrays = solution.to_xarray()
    angle = 2.0 * np.pi * 1.2 * arrays.time * arrays.harmonic
    motion = (arrays.displacement_cos * np.cos(angle) + arrays.displacement_sin * np.sin(angle)).sum(
        "harmonic"
    )
    np.testing.assert_allclose(motion, arrays.displacement, atol=1e-12)
    assert float(abs(arrays.displacement).max()) == pytest.approx(solution.max_abs, rel=1e-3)
    assert arrays.displacement.attrs["units"] == "m"


def test_xarray_reads_the_netcdf_file_itself(tmp_path: Path) -> None:
    import xarray

    branch = solver.sweep(two_dof(), "frequency", 0.8, 1.4, harmonics=5)
    solver.save(branch, tmp_path / "branch.nc")
    with xarray.open_dataset(tmp_path / "branch.nc", engine="scipy") as read:
        np.testing.assert_array_equal(read.amplitude, branch.amplitude)
        assert set(read.state.values.ravel().tolist()) <= {"stuck", "stick and slip"}
        assert read.amplitude.attrs == {"units": "m", "long_name": "max|x| of the observed DOF"}


def test_matlab_gets_a_readable_struct(tmp_path: Path) -> None:
    from scipy.io import loadmat

    branch = solver.sweep(two_dof(), "frequency", 0.8, 1.4, harmonics=5)
    solver.save(branch, tmp_path / "branch.mat")
    struct = loadmat(tmp_path / "branch.mat", simplify_cells=True)["stickslip"]
    np.testing.assert_array_equal(struct["amplitude"], branch.amplitude)
    assert struct["units"]["amplitude"] == "m"
    assert struct["attributes"]["status"] == branch.status.value


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_names_that_differ_in_a_hyphen_keep_their_values(suffix: str, tmp_path: Path) -> None:
    """MATLAB allows none in a field: of two variables of a design one was lost."""
    names = ("a-b.N0", "a_b.N0", 70 * "c" + "1", 70 * "c" + "2")
    columns = {name: Variable(dims=("row",), values=np.array([i, i + 0.5])) for i, name in enumerate(names)}
    data = Dataset(kind="table", rows=("row",), variables=columns)
    solver.save(data, tmp_path / f"result{suffix}")
    same(data, solver.load(tmp_path / f"result{suffix}"), numbers_only=suffix == ".csv")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_damaged_file_is_refused_in_words(suffix: str, tmp_path: Path) -> None:
    file = tmp_path / f"result{suffix}"
    solver.save(solver.plan(two_dof()), file)
    whole = file.read_bytes()
    for damaged in (b"", b"\0\xff damaged" + whole[:40]):
        file.write_bytes(damaged)
        with pytest.raises(solver.ResultFileError, match="cannot be read as a result"):
            solver.load(file)
    flipped = (whole[:i] + bytes([whole[i] ^ 255]) + whole[i + 1 :] for i in range(0, len(whole), 97))
    cut = (whole[:i] for i in range(0, len(whole), 97))
    for damaged in chain(flipped, cut):
        file.write_bytes(damaged)
        with contextlib.suppress(solver.ResultFileError):  # what is a table still may go unseen
            solver.load(file)


def test_what_cannot_be_saved_is_refused(tmp_path: Path) -> None:
    with pytest.raises(solver.SettingError, match="must end in one of"):
        solver.save(solver.plan(two_dof()), tmp_path / "plan.xlsx")
    with pytest.raises(solver.SettingError, match="must be something the package computed"):
        solver.save("text", tmp_path / "plan.csv")  # type: ignore[arg-type]
    with pytest.raises(solver.SettingError, match="must end in one of"):
        solver.load(tmp_path / "plan.xlsx")


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = solver.plan(two_dof())
    for package in ("pandas", "polars", "xarray", "pyarrow", "pyarrow.parquet"):
        monkeypatch.setitem(__import__("sys").modules, package, None)
    for use in (found.to_pandas, found.to_xarray):
        with pytest.raises(solver.MissingExtraError, match=r"pip install 'stickslip\[data\]'"):
            use()
    with pytest.raises(solver.MissingExtraError, match=r"stickslip\[polars\]"):
        found.to_polars()
    with pytest.raises(solver.MissingExtraError, match=r"stickslip\[parquet\]"):
        solver.save(found, tmp_path / "plan.parquet")
    assert not list(tmp_path.iterdir())


def test_points_are_selected_and_drawn_by_the_frequency() -> None:
    branch = solver.sweep(two_dof(), "frequency", 0.8, 1.2, harmonics=3)
    arrays = branch.to_xarray()
    at = arrays.sel(frequency=1.0, method="nearest")
    nearest = int(np.abs(branch.values - 1.0).argmin())
    assert float(at.amplitude) == branch.to_dataset()["amplitude"][nearest]
    (line,) = arrays.max_abs.plot()
    np.testing.assert_array_equal(line.get_xdata(), branch.values)
    assert "Hz" in line.axes.get_xlabel()


def test_a_scene_shows_its_numbers_in_a_notebook() -> None:
    page = solver.load_scene("platform-wedge")._repr_html_()
    for said in ("<caption", "platform-wedge", "wedge", "mass", "mu", "excitation", "kg"):
        assert said in page


def test_a_notebook_gets_escaped_text() -> None:
    summary = solver.Summary(title="<a>", pairs=(("<b>", "1 < 2 & 3"),))

    class Odd(solver.Shown):
        def summary(self) -> solver.Summary:
            return summary

        def to_dataset(self) -> Dataset:
            return Dataset(kind="odd", rows=(), variables={})

    page = Odd()._repr_html_()
    assert "&lt;a&gt;" in page
    assert "&lt;b&gt;" in page
    assert "1 &lt; 2 &amp; 3" in page


class Bar:
    """What a bar of tqdm does, as far as it is used."""

    made: ClassVar[list[Bar]] = []

    def __init__(self, total: float, desc: str = "") -> None:
        self.total, self.desc, self.n, self.closed, self.text = total, desc, 0.0, False, ""
        Bar.made.append(self)

    def update(self, by: float) -> None:
        assert by >= 0.0
        assert not self.closed
        self.n += by

    def set_postfix_str(self, text: str) -> None:
        self.text = text

    def close(self) -> None:
        self.closed = True


def test_progress_goes_to_a_bar() -> None:
    Bar.made.clear()
    branch = solver.sweep(
        two_dof(), "frequency", 0.8, 1.4, harmonics=3, on_progress=solver.progress_bar(Bar, desc="two")
    )
    (bar,) = Bar.made
    assert bar.n == pytest.approx(1.0)
    assert bar.closed
    assert (bar.desc, bar.text) == ("two", str(len(branch.values)))
