"""`import stickslip`: every public name under one, loaded on first use, with types and short texts."""

import pickle
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from every_module import every_module

import optim
import solver
import stickslip
import stickslip.lab
from service.client.client import Client
from service.errors import ServiceProblem
from service.jobs.kinds import studies
from solver.first_use import on_demand
from solver.results.base import Views

ROOT = Path(__file__).resolve().parent.parent.parent
HEAVY = {"numba", "llvmlite", "numpy", "scipy", "pydantic", "casadi", "httpx", "typer", "rich", "matplotlib"}


FUNCTIONS = {"solve", "peak", "least_peak", "damping_ratio"}
DOORS = {"jax": FUNCTIONS, "openmdao": FUNCTIONS, "export": {"save_mat", "save_fmu"}}
"""Modules of functions for another program: no subjects of names."""
SUBJECTS = sorted(path.stem for path in (ROOT / "stickslip").glob("[!_]*.py") if path.stem not in DOORS)


def passed_on(subject: str) -> set[str]:
    """The names a subject gives."""
    return set(import_module(f"stickslip.{subject}").__all__)


def test_every_public_name_is_at_the_top_or_in_one_subject() -> None:
    names = {*solver.__all__, *optim.__all__, "Client", "ServiceProblem"}
    top = set(stickslip.__all__) - set(SUBJECTS)
    found = [*top, *(name for subject in SUBJECTS for name in passed_on(subject))]
    assert set(found) == names
    twice = {name for name in found if found.count(name) > 1}
    assert twice == {"SceneError", "SettingError", "SolverError"}
    assert len(top) <= 34
    assert set(stickslip.__all__) - top == set(SUBJECTS)


def test_every_name_is_that_of_its_home() -> None:
    for home in (solver, optim):
        for name in home.__all__:
            given = [stickslip, *(getattr(stickslip, subject) for subject in SUBJECTS)]
            assert {getattr(one, name) for one in given if name in one.__all__} <= {getattr(home, name)}
    assert stickslip.Client is Client
    assert stickslip.errors.ServiceProblem is ServiceProblem


def test_the_names_of_before_lead_to_their_subject_and_say_so() -> None:
    for subject in SUBJECTS:
        for name in passed_on(subject) - set(stickslip.__all__):
            with pytest.warns(DeprecationWarning, match=rf"is stickslip\.{subject}\.{name} now"):
                found = getattr(stickslip, name)
            assert found is getattr(getattr(stickslip, subject), name)


@pytest.mark.parametrize("door", sorted(DOORS))
def test_a_door_says_what_it_has(door: str) -> None:
    module = pytest.importorskip(f"stickslip.{door}", exc_type=solver.SolverError)
    names = {name: getattr(module, name) for name in module.__all__}
    assert DOORS[door] <= set(names)
    assert [name for name, value in names.items() if not value.__doc__] == []


@pytest.mark.parametrize("module", [stickslip, solver, optim], ids=lambda module: module.__name__)
def test_completion_offers_every_public_name(module: object) -> None:
    assert set(module.__all__) <= set(dir(module))  # type: ignore[attr-defined]


def test_what_is_not_there_is_said() -> None:
    with pytest.raises(AttributeError, match=r"module 'stickslip' has no attribute 'solv'") as raised:
        stickslip.solv  # type: ignore[attr-defined]  # noqa: B018
    # By these Python asks "Did you mean: 'solve'?"
    assert (raised.value.name, raised.value.obj) == ("solv", stickslip)
    with pytest.raises(ImportError):
        from stickslip import solv  # type: ignore[attr-defined]  # noqa: F401


def test_a_name_that_is_not_there_loads_nothing() -> None:
    code = (
        "import sys, stickslip; "
        "print(hasattr(stickslip, 'solv'), 'solver.scene' in sys.modules, *sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    found, scenes, *loaded = done.stdout.split()
    assert (found, scenes) == ("False", "False")
    assert [name for name in loaded if name.startswith(("stickslip.", "optim", "numpy"))] == []


def test_the_version_is_that_of_the_project() -> None:
    assert f'version = "{stickslip.__version__}"' in (ROOT / "pyproject.toml").read_text("utf-8")


def loaded_by(code: str) -> set[str]:
    """The modules a new process has after these lines."""
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys; sys.stderr.write(' '.join(sys.modules))"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return set(done.stderr.split())


def test_importing_loads_nothing_heavy() -> None:
    code = "import stickslip; dir(stickslip); 'solve' in stickslip.__all__"
    assert loaded_by(code) & HEAVY == set()


def test_errors_and_scenes_load_no_kernels() -> None:
    """What a script does before it computes."""
    code = "import stickslip; stickslip.SceneError; stickslip.load_scene('two-dof')"
    assert loaded_by(code) & {"numba", "scipy", "casadi", "matplotlib", "httpx"} == set()


def test_every_result_is_shown_by_functions_that_are_there() -> None:
    """`Views` names them as text, which no checker follows when they move."""
    modules = every_module(solver, optim, stickslip.lab)
    views = {
        each.VIEWS
        for module in modules
        for each in vars(module).values()
        if isinstance(each, type) and isinstance(getattr(each, "VIEWS", None), Views)
    }
    assert len(views) > 15
    for view in views:
        for what in ("told", "to_dataset", *(["figure"] if view.figure else [])):
            assert callable(on_demand(view.place(what)))
    shown = {view.place("told") for view in views}
    assert {study.TOLD for study in studies().values()} <= shown, "said by a study and by its result"


def test_the_name_of_a_scene_does_where_a_scene_does(tmp_path: Path) -> None:
    by_name = stickslip.solve("two-dof", frequency_hz=1.0, harmonics=3)
    given = stickslip.solve(stickslip.load_scene("two-dof"), frequency_hz=1.0, harmonics=3)
    assert by_name.max_abs == given.max_abs
    file = tmp_path / "mine.toml"
    file.write_text((ROOT / "solver" / "scene" / "shipped" / "two-dof.toml").read_text())
    assert stickslip.plan(scene=file, harmonics=3).unknowns == stickslip.plan("two-dof", harmonics=3).unknowns
    with pytest.raises(stickslip.SceneError, match="did you mean"):
        stickslip.sweep("two-dofs")
    with pytest.raises(stickslip.SettingError, match=r"`scene` must be a Scene .* got 'dict'"):
        stickslip.solve({"name": "two-dof"}, frequency_hz=1.0)  # type: ignore[arg-type]
    assert pickle.loads(pickle.dumps(stickslip.solve)) is stickslip.solve


def test_words_of_a_range_as_they_were_still_work_and_warn() -> None:
    with pytest.warns(DeprecationWarning, match="`low` is `start` now") as told:
        stickslip.SceneBuilder("one").observe("x", low=1.0, stop=2.0)
    with pytest.warns(DeprecationWarning, match="`high` is `stop` now") as more:
        found = stickslip.peaks.least_peak("two-dof", "damper.N0", start=50.0, high=200.0, harmonics=1)
    assert {one.filename for one in (*told, *more)} == {__file__}
    assert found.at == stickslip.peaks.least_peak("two-dof", "damper.N0", 50.0, 200.0, harmonics=1).at
