"""A report of a stored design, made in a process of its own with limits of memory and time.

A report computes responses; what a scene takes then ends that process and not the service.
"""

from __future__ import annotations

import base64
import json
import multiprocessing as mp
import threading
from collections.abc import Mapping
from multiprocessing.connection import Connection
from typing import Any

from service.errors import ConflictError, QueueFullError
from service.workers.processes import start

MEMORY_BYTES = 2 * 1024**3
_MOST_BYTES = 64 * 1024**2
_PATIENCE_SECONDS = 10.0
_ONE = threading.BoundedSemaphore(1)


def report_apart(
    scene: Mapping[str, Any], problem: Mapping[str, Any], result: Mapping[str, Any],
    about: Mapping[str, Any], form: str, seconds: float,
) -> bytes:  # fmt: skip
    """The report of a design, as bytes of the form.

    Parameters
    ----------
    scene, problem, result, about : as `service.rendering.report.sections.Designed` has them, the scene as
        tables.
    form : one of `service.rendering.report.making.FORMS`.
    seconds : longest time it may take.

    Raises
    ------
    ConflictError
        It takes more time or memory than it may, or there is nothing to report; the message says what to do.
    QueueFullError
        If others are being made for long.
    """
    if not _ONE.acquire(timeout=_PATIENCE_SECONDS):
        raise QueueFullError("other reports are being made: try again later", retry_after=5)
    try:
        ours, theirs = mp.Pipe(duplex=False)
        with ours:
            argument = {"scene": dict(scene), "problem": dict(problem), "result": dict(result),
                        "about": dict(about), "form": form}  # fmt: skip
            process = start(_main, (theirs, argument, seconds), "report")
            theirs.close()
            try:
                if not ours.poll(seconds):
                    raise ConflictError(_beyond(f"longer than {seconds:g} s"))
                answer = json.loads(ours.recv_bytes(_MOST_BYTES))
            except (EOFError, OSError) as error:
                raise ConflictError(_beyond("more memory or time than there is for it")) from error
            finally:
                process.kill()
                process.join()
                process.close()
    finally:
        _ONE.release()
    if "error" in answer:
        raise ConflictError(answer["error"])
    return base64.b64decode(answer["report"])


def _beyond(what: str) -> str:
    return f"making the report takes {what}: `stickslip report JOB` makes it on your machine"


def _main(connection: Connection, argument: Mapping[str, Any], seconds: float) -> None:
    """The life of the process."""
    import contextlib

    from service.uploads.inspection import limit_process

    limit_process(seconds, MEMORY_BYTES)
    # The other end may have lost its patience.
    with contextlib.suppress(BrokenPipeError):
        connection.send_bytes(json.dumps(_answer(argument)).encode())


def _answer(given: Mapping[str, Any]) -> dict[str, str]:
    from service.errors import InputError
    from service.rendering.report.making import report_of
    from service.rendering.report.sections import Designed
    from solver.errors import SolverError
    from solver.scene.scene import Scene

    try:
        scene = Scene.from_dict(given["scene"])
        made = report_of(
            Designed(scene=scene, problem=given["problem"], result=given["result"], about=given["about"]),
            given["form"],
        )
        return {"report": base64.b64encode(made).decode()}
    except (InputError, SolverError) as error:
        return {"error": str(error)}
    except MemoryError:
        return {"error": _beyond("more memory than there is for it")}
