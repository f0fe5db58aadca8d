"""Files from strangers are read in a process of their own, with limits of memory and time.

What a reader does with a hostile file (allocate what its header promises, inflate without end, loop) then
ends that process and not the service. It gets a folder and answers with JSON; nothing is ever unpickled.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import shutil
import signal
import threading
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from service.errors import InvalidRequestError, QueueFullError, UnreadableUploadError, issues_to_json
from service.workers.processes import EndedError, told_apart
from solver.first_use import on_demand

MEMORY_BYTES = 2 * 1024**3
"""Most that one reader may take, and all of them together beside what they are born with."""
_LEAST_BYTES = 512 * 1024**2
_TIMES = 16
"""Memory of a reader for each byte of its files: lines, and what is read of them, as Python keeps it."""
_INFLATED, _INFLATED_BYTES = 20, 64 * 1024**2
"""What an archive may hold for each byte of it, and besides."""
_PIECE = 1 << 20
_USUAL_BYTES = 16 * 1024**2
"""Files that are larger together have more time, in proportion."""
_PATIENCE_SECONDS = 30.0
_TOO_LONG = (
    "reading it takes longer than {:g} s: raise STICKSLIP_INSPECTION_SECONDS (of each 16 MiB), or reduce "
    "the model first, stickslip import FILES --reduce"
)
_DESCRIBE, _RESOLVE, _LOOK = "describe", "resolve", "look"


def contents(
    file: Path, seconds: float, parts: Sequence[str] = (), size: int = 0
) -> tuple[list[dict[str, Any]], str | None]:
    """The matrices, modes or nodes in a file: name, rows, columns and entries of each.

    It is put together first of parts beside it, if there are some, `size` bytes in all; its SHA-256 then.

    Raises
    ------
    UnreadableUploadError
        If there are none, the file is damaged, or reading it takes too much.
    QueueFullError
        If too many are being read.
    OSError
        If there is no room for so many bytes.
    """
    if shutil.disk_usage(file.parent).free < size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    sha256, found = _ask(_DESCRIBE, file.parent, [file.name, *parts], seconds, 1024**2, writes=size)
    return found, sha256


def resolved_structure(
    structure: Mapping[str, Any], folder: Path, seconds: float, most_bytes: int, orders: Sequence[int] = ()
) -> dict[str, Any]:
    """The tables of a structure with the files it names, in `folder`, replaced by what they hold.

    InvalidRequestError with pointers into the scene; UnreadableUploadError if a file cannot be read, or
    reading takes too much. `orders`: engine orders of the excitation, for which a sector is reduced.
    """
    scene = {"structure": dict(structure), "excitation": [{"engine_order": order} for order in orders]}
    found: dict[str, Any] = _ask(_RESOLVE, folder, scene, seconds, most_bytes)
    return found


def look_at(asked: Mapping[str, Any], folder: Path, seconds: float, most_bytes: int) -> dict[str, Any]:
    """What files in `folder` hold and are good for, as `service.uploads.matrix_summary.look` says.

    Errors are those of `resolved_structure`.
    """
    found: dict[str, Any] = _ask(_LOOK, folder, dict(asked), seconds, most_bytes)
    return found


def _ask(task: str, folder: Path, argument: Any, seconds: float, most_bytes: int, writes: int = 0) -> Any:
    sent = sum(file.stat().st_size for file in folder.iterdir())  # never what an archive says of itself
    inside = _INFLATED * sent if any(map(zipfile.is_zipfile, folder.iterdir())) else 0
    memory = min(_LEAST_BYTES + _TIMES * (sent + inside), MEMORY_BYTES)
    seconds *= max(1.0, sent / _USUAL_BYTES)
    with (_budget if sent > _SMALL_BYTES else _budget_of_small).taken(memory):
        try:
            answer = told_apart(
                _in_folder, (task, str(folder), argument), "reader", seconds=seconds, most_bytes=most_bytes,
                memory=memory, beside=True, writes=writes,
            )  # fmt: skip
        except TimeoutError as error:
            raise UnreadableUploadError(_TOO_LONG.format(seconds)) from error
        except EndedError as error:
            raise UnreadableUploadError(_end(error.status, seconds)) from error
        except OSError as error:
            message = f"what it holds takes more than {most_bytes} bytes as text"
            raise UnreadableUploadError(message) from error
    if "issues" in answer:
        raise InvalidRequestError.from_json(answer["issues"])
    if "error" in answer:
        raise UnreadableUploadError(answer["error"])
    return answer["found"]


def _end(code: int | None, seconds: float) -> str:
    """What is said of a file whose reader ended without an answer within so much time [s]."""
    if code is not None and -code == signal.SIGXCPU:
        return _TOO_LONG.format(seconds)
    if code is not None and -code in (signal.SIGSEGV, signal.SIGBUS, signal.SIGABRT, signal.SIGFPE):
        return "it is damaged: its reader ended at it"
    return "reading it takes more memory or time than there is for it"


class _Budget:
    """What several may take together."""

    def __init__(self, most: int) -> None:
        self._left = most
        self._changed = threading.Condition()

    @contextlib.contextmanager
    def taken(self, amount: int) -> Iterator[None]:
        """Take so much of it inside the block (QueueFullError if others have it for too long)."""
        with self._changed:
            if not self._changed.wait_for(lambda: self._left >= amount, _PATIENCE_SECONDS):
                raise QueueFullError("other files are being read: try again later", retry_after=5)
            self._left -= amount
        try:
            yield
        finally:
            with self._changed:
                self._left += amount
                self._changed.notify_all()


_budget, _budget_of_small = _Budget(MEMORY_BYTES), _Budget(2 * _LEAST_BYTES)
_SMALL_BYTES = 1024**2
"""Files of so much together do not wait for large ones."""


def _in_folder(asked: tuple[str, str, Any]) -> dict[str, Any]:
    task, folder, argument = asked
    os.chdir(folder)
    return _answer(task, argument)


def _answer(task: str, argument: Any) -> dict[str, Any]:
    from solver.errors import SceneError
    from solver.matrices.load_set import MatrixFileError

    tasks: dict[str, Callable[[Any], Any]] = {
        _DESCRIBE: lambda names: (_join(*names), _describe(names[0])), _RESOLVE: _resolve,
        _LOOK: lambda asked: on_demand("service.uploads.matrix_summary:look")(asked),
    }  # fmt: skip
    try:
        return {"found": tasks[task](argument)}
    except SceneError as error:
        return {"issues": issues_to_json(error.issues)}
    except MatrixFileError as error:
        return {"error": str(error)}
    except MemoryError:
        return {"error": "reading it takes more memory than there is for it"}
    except Exception as error:  # noqa: BLE001 - whatever a hostile file brings about is said of the file
        return {"error": f"it cannot be read: {type(error).__name__}: {str(error)[:300]}"}


def _describe(name: str) -> list[dict[str, Any]]:
    from solver.matrices.load_set import array_names, labels_of, read_matrix, read_modes
    from solver.matrices.readers import reader_registry as registry
    from solver.matrices.sectors.sector_reduction import read_sector

    file = Path(name)
    _refuse_inflating(file)
    if file.suffix.lower() in registry.suffixes("labels"):
        return [{"name": "mapping", "rows": len(labels_of(file)), "columns": 1, "entries": None}]
    if file.suffix.lower() in registry.suffixes("nodes"):
        return [{"name": "nodes", "rows": _nodes_of(file), "columns": 3, "entries": None}]
    names = array_names(file)
    if "diameters" in names:
        reduced, _, _ = read_sector(file)
        count = len(reduced.diameters)
        return [{"name": "diameters", "rows": reduced.size, "columns": count, "entries": None}]
    if "modes" in names:
        modes = read_modes(file)
        return [{"name": "modes", "rows": modes.size, "columns": int(modes.omega2.size), "entries": None}]
    matrices: list[str | None] = [key for key in ("M", "K", "C") if key in names]
    found = []
    for key in matrices or [None]:
        matrix = read_matrix(file, key or "M")
        rows, columns = (int(count) for count in matrix.shape)
        found.append({"name": key, "rows": rows, "columns": columns, "entries": int(matrix.nnz)})
    return found


def _join(name: str, *parts: str) -> str | None:
    if not parts:
        return None
    known = hashlib.sha256()
    with Path(name).open("wb") as whole:
        for part in parts:
            with Path(part).open("rb") as file:
                for piece in iter(partial(file.read, _PIECE), b""):
                    whole.write(piece)
                    known.update(piece)
    return known.hexdigest()


def _refuse_inflating(file: Path) -> None:
    """Refuse an archive that holds far more than it is."""
    from solver.matrices.load_set import MatrixFileError

    if not zipfile.is_zipfile(file):
        return
    size = file.stat().st_size
    with zipfile.ZipFile(file) as archive:
        inside = sum(member.file_size for member in archive.infolist())
    most = _INFLATED_BYTES + _INFLATED * size
    if inside > most:
        raise MatrixFileError(
            f"{file.name!r} holds {inside} bytes, at most {most} are read of an archive of {size}: save a "
            "sparse matrix, or without compression"
        )


def _nodes_of(file: Path) -> int:
    """How many nodes a deck has."""
    from solver.matrices.readers.numbers_in_text import FormatError
    from solver.matrices.readers.reader_registry import MatrixFileError
    from solver.matrices.sectors.loading import check_alone, read_deck

    try:
        check_alone(file)
        return len(read_deck(file).nodes)
    except FormatError as error:
        raise MatrixFileError(f"{file.name!r}: {error}") from error


def _resolve(scene: dict[str, Any]) -> dict[str, Any]:
    from solver.errors import SceneError
    from solver.matrices.readers.numbers_in_text import FormatError
    from solver.matrices.scene_files import with_files
    from solver.matrices.sectors.loading import check_alone
    from solver.matrices.values import as_json

    for place in (("structure", "cyclic"), ("structure",)):
        table = scene["structure"].get("cyclic") if place[1:] else scene["structure"]
        name = table.get("nodes") if isinstance(table, dict) else None
        if not isinstance(name, str):
            continue
        try:
            check_alone(Path(name))
        except FormatError as error:
            raise SceneError.of((*place, "nodes"), f"`nodes`: {name!r}: {error}", named=False) from error
    tables = with_files(scene, Path())["structure"]
    if not isinstance(tables, dict):
        raise TypeError(f"the structure is {type(tables).__name__}")
    return as_json(tables)
