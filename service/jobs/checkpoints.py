"""What an unfinished job has computed so far, for an attempt that comes after.

A run that can go on gets a `Checkpoints`: what earlier attempts kept, and a place to keep more. It hands over
numbered pieces, plain arrays; they go to the service by the way of the results and are stored as they come,
so that a write costs what is new and no more. They are gone when the job ends.
"""

from __future__ import annotations

import hashlib
import io
import json
import logging
import time
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from service.jobs.job_parts import Division, PartOutput
from service.jobs.outputs import JobOutput, Pace, Progress, ResultPiece, Run, ShouldStop
from service.jobs.stored_figures import StoredArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Arrays = Mapping[str, NDArray[Any]]

log = logging.getLogger("stickslip.worker")

_VERSION, _REQUEST = "stickslip", "request"
_ARRAY = "array:"


class UnusableError(Exception):
    """What was kept cannot be used: of another version or request, or not what it should be."""


def packed(part: int, arrays: Arrays, request: str) -> ResultPiece:
    """Arrays of numbers as a piece: NumPy's npz format with version and digest of request, never pickle."""
    # Loaded here, and below: the module of the workers imports nothing heavy.
    import numpy as np

    buffer = io.BytesIO()
    about = {_VERSION: np.array(version("stickslip")), _REQUEST: np.array(request)}
    np.savez(buffer, allow_pickle=False, **arrays, **about)
    data = buffer.getvalue()
    return ResultPiece(part=part, sha256=hashlib.sha256(data).hexdigest(), data=data)


def unpacked(piece: ResultPiece, request: str) -> Arrays:
    """The arrays of a piece.

    UnusableError if its bytes are not those that were packed, another version packed them, or for another
    request.
    """
    import numpy as np

    if hashlib.sha256(piece.data).hexdigest() != piece.sha256:
        raise UnusableError(f"piece {piece.part} does not match its checksum")
    try:
        with np.load(io.BytesIO(piece.data), allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise UnusableError(f"piece {piece.part} cannot be read: {error}") from error
    writer = str(arrays.pop(_VERSION, "an unknown version"))
    if writer != version("stickslip"):
        raise UnusableError(f"piece {piece.part} is of another version, {writer}")
    if str(arrays.pop(_REQUEST, "")) != request:
        # That a kind takes the pieces says little: a point of one branch may solve another's equations.
        raise UnusableError(f"piece {piece.part} is of another request")
    return arrays


@dataclass(frozen=True, slots=True)
class KeptPieces:
    """From a worker: pieces to be stored; `anew` if they replace all that was kept before."""

    pieces: tuple[ResultPiece, ...]
    anew: bool = False


class Checkpoints:
    """What one attempt finds, and where it keeps what it has.

    Parameters
    ----------
    job_id : of the job, for the log.
    found : what earlier attempts kept.
    send : takes what is to be stored.
    pace : how often pieces are sent, and how much a job may keep.
    request : digest of what is computed; pieces of another one are not used.
    """

    def __init__(
        self, job_id: str, found: Sequence[ResultPiece], send: Callable[[KeptPieces], None], pace: Pace,
        request: str,
    ) -> None:  # fmt: skip
        self._job_id, self._request = job_id, request
        self._found = sorted(found, key=lambda piece: piece.part)
        self._send = send
        self._pace = pace
        self._next = time.monotonic() + pace.checkpoint_seconds
        self._waiting: list[ResultPiece] = []
        self._anew = False
        self._size = sum(len(piece.data) for piece in found)
        self._full = pace.checkpoint_bytes <= self._size

    @classmethod
    def none(cls) -> Checkpoints:
        """For a run that goes on from nothing and keeps nothing."""
        pace = Pace(progress_seconds=0.0, checkpoint_seconds=0.0, checkpoint_bytes=0)
        return cls("", (), lambda _kept: None, pace, "")

    def found(self) -> dict[int, Arrays]:
        """The pieces of earlier attempts by their numbers; none of them if one cannot be used."""
        try:
            return {piece.part: unpacked(piece, self._request) for piece in self._found}
        except UnusableError as error:
            self.begin_anew(str(error))
            return {}

    def begin_anew(self, reason: str) -> None:
        """Forget what earlier attempts kept, which cannot be used."""
        log.warning("job %s begins anew, its checkpoint cannot be used: %s", self._job_id, reason)
        self._found, self._waiting, self._anew, self._size = [], [], True, 0
        self._full = self._pace.checkpoint_bytes <= 0

    def due(self) -> bool:
        """Whether it is time to hand over a piece."""
        return not self._full and time.monotonic() >= self._next

    def add(self, part: int, arrays: Arrays) -> None:
        """Keep a piece; it is sent at once if that is due, else with a later one."""
        if self._full:
            return
        piece = packed(part, arrays, self._request)
        if self._size + len(piece.data) > self._pace.checkpoint_bytes:
            self._full = True
            log.warning(
                "job %s keeps no more for later attempts than %d bytes (`checkpoint_bytes`)",
                self._job_id,
                self._size,
            )
        else:
            self._size += len(piece.data)
            self._waiting.append(piece)
        if self._full or self.due():
            self.flush()

    def flush(self) -> None:
        """Send what waits."""
        if self._waiting:
            self._send(KeptPieces(tuple(self._waiting), self._anew))
            self._waiting, self._anew = [], False
        self._next = time.monotonic() + self._pace.checkpoint_seconds


@dataclass(frozen=True, slots=True)
class FromTheStart:
    """A run that keeps nothing."""

    run: Run

    def __call__(
        self, spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop, _checkpoints: Checkpoints
    ) -> JobOutput:
        """Compute."""
        return self.run(spec, progress, should_stop)


@dataclass(frozen=True, slots=True)
class RunParts:
    """The run of a divided kind that keeps the parts it has and computes those that are not known."""

    parts: Division

    def __call__(
        self, spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop, checkpoints: Checkpoints
    ) -> JobOutput:
        """Compute the parts and join them."""

        def keep(part: int, output: PartOutput) -> None:
            keep_part(checkpoints, part, output)

        return self.parts.run(spec, progress, should_stop, known_parts(checkpoints), keep)


def known_parts(checkpoints: Checkpoints) -> dict[int, PartOutput]:
    """The outputs of parts that earlier attempts kept, by their places."""
    try:
        return {part: _output(arrays) for part, arrays in checkpoints.found().items()}
    except (KeyError, ValueError, TypeError) as error:
        checkpoints.begin_anew(f"{type(error).__name__}: {error}")
        return {}


def keep_part(checkpoints: Checkpoints, part: int, output: PartOutput) -> None:
    """Keep the output of a part for a later attempt."""
    checkpoints.add(part, _arrays(output))


def _arrays(output: PartOutput) -> Arrays:
    """What a part gave back, as arrays."""
    import numpy as np

    about = {"result": output.result, "points": output.points, "final": output.final}
    arrays = {"about": np.frombuffer(json.dumps(about, allow_nan=False).encode(), np.uint8)}
    return arrays | {
        _ARRAY + name: np.frombuffer(stored.data, np.uint8) for name, stored in output.arrays.items()
    }


def _output(arrays: Arrays) -> PartOutput:
    about = json.loads(arrays["about"].tobytes())
    data = {name: array.tobytes() for name, array in arrays.items() if name.startswith(_ARRAY)}
    return PartOutput(
        result=about["result"],
        arrays={name.removeprefix(_ARRAY): StoredArray.of_bytes(stored) for name, stored in data.items()},
        points=about["points"],
        final=about["final"],
    )
