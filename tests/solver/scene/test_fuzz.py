"""Damaged scenes and files of matrices: the documented errors and no other, in bounded time and memory."""

import copy
import io
import json
import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fe_file_set import files
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from matrix_cases import beam, hb_text
from scipy.io import mmwrite, savemat
from scipy.sparse import coo_array, csc_array, dia_array, save_npz

import solver
from solver.errors import SceneError
from solver.matrices.load_set import MatrixFileError, array_names, read_matrix, read_modes
from solver.scene.scene import Scene

MEMORY = 2 * 1024**3
FEW = settings(
    max_examples=60, deadline=5000, suppress_health_check=[HealthCheck.function_scoped_fixture], database=None
)
MANY = settings(parent=FEW, max_examples=600)
M, _ = beam(4)
MODES = {"modes": np.eye(3), "omega2": np.arange(1.0, 4.0), "damping_ratio": np.array([0.01])}


@pytest.fixture(autouse=True)
def _little_memory() -> Iterator[None]:
    """A reader that believes what a header says runs into this."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, hard))
    yield
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


VALUES = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8),
    st.sampled_from([0, -1, 1e308, -1e308, 5e-324, 2**63, 10**400, "ground", "tip@next", "../x", "upload:1"]),
    st.lists(st.floats(), max_size=3), st.dictionaries(st.text(max_size=3), st.floats(), max_size=2),
    st.just([[[[]]]]),
)  # fmt: skip


def places(tree: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every key and index of a scene."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, inner in items:
        yield (*at, key)
        yield from places(inner, (*at, key))


@st.composite
def damaged_scenes(draw: st.DrawFn) -> dict[str, Any]:
    """A shipped scene with some of its values replaced, taken away, added or doubled."""
    scene = copy.deepcopy(solver.load_scene(draw(st.sampled_from(["two-dof", "bladed-disk"]))).to_dict())
    for _ in range(draw(st.integers(1, 4))):
        *path, key = draw(st.sampled_from(sorted(places(scene), key=str)))
        owner: Any = scene
        for step in path:
            owner = owner[step]
        match draw(st.sampled_from(["replace", "delete", "add", "double"])):
            case "delete":
                del owner[key]
            case "add" if isinstance(owner, dict):
                owner[draw(st.text(max_size=8))] = copy.deepcopy(draw(VALUES))
            case "double" if isinstance(owner, list):
                owner.append(copy.deepcopy(owner[key]))
            case _:
                owner[key] = copy.deepcopy(draw(VALUES))
    return scene


def refused(read: Callable[[], object], kind: type[Exception]) -> str | None:
    """The message of the documented error; None if there was none. Any other one fails the test."""
    try:
        read()
    except kind as error:
        return str(error)
    return None


def check_scene(scene: dict[str, Any]) -> None:
    message = refused(lambda: Scene.from_dict(scene), SceneError)
    if message is not None:
        assert 0 < len(message) < 20_000
        return
    read = Scene.from_dict(scene)
    assert Scene.from_dict(read.to_dict()) == read
    json.dumps(read.to_dict(), allow_nan=False)


@FEW
@given(damaged_scenes())
def test_a_damaged_scene(scene: dict[str, Any]) -> None:
    check_scene(scene)


@pytest.mark.long
@MANY
@given(damaged_scenes())
def test_many_damaged_scenes(scene: dict[str, Any]) -> None:
    check_scene(scene)


ANYTHING = st.recursive(
    VALUES, lambda inner: st.dictionaries(st.text(max_size=5), inner, max_size=4), max_leaves=20
)


@FEW
@given(ANYTHING)
def test_anything_as_a_scene(value: Any) -> None:
    for whole in (value, {"structure": value}, {"contacts": value}):
        assert refused(lambda whole=whole: Scene.from_dict(whole), SceneError)


def saved(write: Callable[[Any], object]) -> bytes:
    buffer = io.BytesIO()
    write(buffer)
    return buffer.getvalue()


TEXTS = {
    "scene.json": json.dumps(solver.load_scene("two-dof").to_dict()).encode(),
    "scene.toml": (Path(solver.__file__).parent / "scene" / "shipped" / "bladed-disk.toml").read_bytes(),
}
FILES: dict[str, bytes] = {
    "M.npz": saved(lambda f: np.savez(f, M=M, K=M)),
    "packed.npz": saved(lambda f: np.savez_compressed(f, M=M)),
    "csr.npz": saved(lambda f: save_npz(f, coo_array(M).tocsr())),
    "csc.npz": saved(lambda f: save_npz(f, csc_array(M), compressed=False)),
    "coo.npz": saved(lambda f: save_npz(f, coo_array(M), compressed=False)),
    "dia.npz": saved(lambda f: save_npz(f, dia_array(M), compressed=False)),
    "M.npy": saved(lambda f: np.save(f, M)),
    "M.mat": saved(lambda f: savemat(f, {"M": M})),
    "packed.mat": saved(lambda f: savemat(f, {"M": csc_array(M)}, do_compression=True)),
    "four.mat": saved(lambda f: savemat(f, {"M": M}, format="4")),
    "coordinate.mtx": saved(lambda f: mmwrite(f, coo_array(M))),
    "array.mtx": saved(lambda f: mmwrite(f, M)),
    "M.rsa": hb_text(M, "RSA").encode(),
    "M.rua": hb_text(M, "RUA", right_hand_side=True).encode(),
    "M.rb": hb_text(M, "RSA", rutherford=True).encode(),
    "modes.npz": saved(lambda f: np.savez(f, **MODES)),
    "modes.mat": saved(lambda f: savemat(f, MODES)),
}  # fmt: skip


OF_PROGRAMS = ("k.matrix", "k.mtx", "triplets.mtx", "k.sti", "k.pch", "k.dmig", "dense.op4", "strings.op4",
               "little-False-False-4.op4", "big-True-True-8.op4")  # fmt: skip
FILES |= {name: data for name, data in files().items() if name in OF_PROGRAMS}
WORDS = [b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\0", b"-1e9"]


@st.composite
def damages(draw: st.DrawFn, data: bytes) -> bytes:
    """Bytes changed, cut, doubled, moved; numbers written as text made large or negative."""
    found = bytearray(data)
    for _ in range(draw(st.integers(1, 6))):
        if not found:
            break
        at = draw(st.integers(0, len(found) - 1))
        size = draw(st.integers(1, 16))
        match draw(st.sampled_from(["set", "cut", "remove", "insert", "double", "digit", "word"])):
            case "set":
                found[at] = draw(st.integers(0, 255))
            case "cut":
                del found[at:]
            case "remove":
                del found[at : at + size]
            case "insert":
                found[at:at] = draw(st.binary(min_size=1, max_size=size))
            case "double":
                found[at:at] = found[at : at + size * 16]
            case "digit":
                digits = [place for place, byte in enumerate(found) if chr(byte).isdigit()]
                if digits:
                    found[draw(st.sampled_from(digits))] = ord(draw(st.sampled_from("0189-e.")))
            case _:
                found[at : at + 4] = draw(st.sampled_from(WORDS))
    return bytes(found)


def check_file(name: str, data: bytes, folder: Path) -> None:
    path = folder / name
    path.write_bytes(data)
    for read in (lambda: read_matrix(path, "M"), lambda: array_names(path), lambda: read_modes(path)):
        message = refused(read, MatrixFileError)
        assert message is None or (str(path) in message and len(message) < 3000)


# SciPy's reader of .mat files ends the process at some damaged ones (1.17, `read_var_array`): only what is
# known to pass is tried. The service reads in a process of its own.
KNOWN = settings(parent=FEW, derandomize=True)


@pytest.mark.few(3)
@pytest.mark.parametrize("name", FILES)
def test_a_damaged_file_of_matrices(name: str, tmp_path: Path) -> None:
    @(KNOWN if name.endswith(".mat") else FEW)
    @given(damages(FILES[name]))
    def attempt(data: bytes) -> None:
        check_file(name, data, tmp_path)

    attempt()


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in FILES if not name.endswith(".mat")])
def test_many_damaged_files_of_matrices(name: str, tmp_path: Path) -> None:
    @MANY
    @given(damages(FILES[name]))
    def attempt(data: bytes) -> None:
        check_file(name, data, tmp_path)

    attempt()


@pytest.mark.parametrize("name", TEXTS)
def test_a_damaged_scene_file(name: str, tmp_path: Path) -> None:
    @FEW
    @given(damages(TEXTS[name]))
    def attempt(data: bytes) -> None:
        path = tmp_path / name
        path.write_bytes(data)
        assert refused(lambda: solver.load_scene(path), SceneError) != ""

    attempt()
