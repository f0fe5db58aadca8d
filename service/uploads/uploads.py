"""Uploaded files of matrices and modes, and scenes that refer to them."""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from service.auth.allowances import Storage
from service.auth.callers import KEYLESS, Caller
from service.db.models import Upload
from service.db.repositories.owned import UploadRepository, visible
from service.errors import InvalidRequestError, NotFoundError, UnreadableUploadError
from service.jobs.common.scene_requests import UPLOAD, Place, named_files, with_named
from service.jobs.strict_json import digest, encoded
from service.settings.settings import Settings
from service.uploads.inspection import contents, look_at, resolved_structure
from solver.errors import Issue

PART = "part"
"""The format of a part of a larger file, which is not read."""
_LARGEST_STRUCTURE = 16 * 1024 * 1024
"""As text [bytes]; of those that were resolved last, as many are kept."""
_REDUCE = (
    ": keep fewer modes in `cyclic.keep_modes`, or reduce the sector with `stickslip import --sectors … "
    "--reduce` and upload its file as `diameters`"
)


def format_of(asked: str | None, name: str, content_type: str) -> str:
    """The word of the format that was asked for, that of the ending of the name, or of the content type.

    InvalidRequestError if none of them says it, or no reader has the word.
    """
    from solver.matrices.readers import reader_registry as registry

    known = (*registry.words(), PART)
    found = registry.word_of(name, content_type) if asked is None else asked
    if found in known:
        return found
    reason = f"got {asked!r}" if asked else f"neither the name {name!r} nor the content type says it"
    raise InvalidRequestError.of(("format",), f"must be one of {', '.join(known)}: {reason}", source="query")


class Uploads:
    """The uploaded files of one service."""

    def __init__(self, repository: UploadRepository, settings: Settings, storage: Storage) -> None:
        self.repository = repository
        self.storage = storage
        self._seconds = settings.inspection_seconds
        self._lock = threading.Lock()
        self._resolved: OrderedDict[str, str] = OrderedDict()

    def add(
        self, path: Path, given: Upload, parts: Sequence[str] = (), caller: Caller = KEYLESS
    ) -> tuple[Upload, list[dict[str, Any]], bool]:
        """Look at a file and store it; what it holds, and whether it is new to its owner.

        `given` says what came; of a file in `parts` there is nothing at `path` yet.

        Raises
        ------
        UnreadableUploadError
            If it holds no usable matrix or modes.
        StorageFullError
            If its owner may not store so much more.
        InvalidRequestError
            If a part is not there, or is none.
        """
        given.owner = caller.owner
        whole = self._parts(parts, caller)
        ids = {part.id: part for part in whole}
        if whole:
            given.size = sum(part.size for part in whole)
        more = given.size - sum(part.size for part in ids.values())
        if more > 0 or not whole:
            self.storage.require(caller, more)
        for part_id, part in ids.items():
            self.repository.files.place(part, path.with_name(part_id))
        found: list[dict[str, Any]] = []
        if given.format != PART:
            found, known = contents(path, self._seconds, parts, given.size if whole else 0)
            given.sha256 = known or given.sha256
        row, added = self.repository.add(path, given, None if given.format == PART else list(ids))
        for owner in {part.owner for part in whole}:
            self.storage.forget(owner)
        return row, found, added

    def _parts(self, ids: Sequence[str], caller: Caller) -> list[Upload]:
        rows = []
        for at, upload_id in enumerate(ids):
            rows.append(self._row("part", at, upload_id, caller, "query"))
            if rows[-1].format != PART:
                wanted = f"must be an upload of the format {PART!r}"
                raise InvalidRequestError.of(("part", at), wanted, rows[-1].format, source="query")
        return rows

    def get(self, upload_id: str, caller: Caller = KEYLESS) -> Upload:
        """An upload (NotFoundError if there is none of this id that the caller may see)."""
        return visible(self.repository.get(upload_id), caller.sees, f"there is no upload {upload_id!r}")

    def delete(self, upload_id: str, caller: Caller = KEYLESS) -> None:
        """Forget an upload (errors as of `get`); scenes and jobs that were made with it keep what it held."""
        row = self.get(upload_id, caller)
        self.repository.delete(upload_id)
        self.storage.forget(row.owner)

    def resolved(self, body: Mapping[str, object], caller: Caller = KEYLESS) -> Mapping[str, object]:
        """A scene with what its uploads hold in place of their ids; one without uploads as it is.

        InvalidRequestError with pointers into the scene: an upload that is not there, or that does not fit.
        """
        structure = body.get("structure")
        if not isinstance(structure, Mapping) or structure.get("kind") != "matrices":
            return body
        if not any(map(_is_reference, named_files(structure).values())):
            return body
        rows = self._rows(structure, caller)
        return {**body, "structure": self._with(structure, rows, _engine_orders(body))}

    def looked_at(self, asked: Mapping[str, Any], caller: Caller = KEYLESS) -> dict[str, Any]:
        """What uploaded matrices hold, and the scene that is asked for, as
        `service.uploads.matrix_summary.look` says.

        What a scene's structure resolves to is kept in mind: the scene is about to be used.
        InvalidRequestError with pointers into the scene, or to the upload: one that is not there, or that
        does not fit.
        """
        structure = asked["structure"]
        if structure is None:
            rows: dict[Place, Upload] = {
                (f"{at}",): self._row("uploads", at, id, caller) for at, id in enumerate(asked["uploads"])
            }
        else:
            rows = self._rows(structure, caller)
        names = file_names(rows)
        uploaded = {names[place]: f"{UPLOAD}{row.id}" for place, row in rows.items()}
        placed = None if structure is None else with_named(structure, names)
        with self._placed(rows, names) as folder:
            try:
                files = list(names.values())
                found = look_at(
                    {**asked, "structure": placed, "files": files}, folder, self._seconds, _LARGEST_STRUCTURE
                )
            except UnreadableUploadError as error:
                key = "uploads" if structure is None else "structure"
                raise InvalidRequestError.of((key,), error.detail, named=False) from error
        resolved = found.pop("resolved", None)
        if resolved is not None:
            self._remember(_digest(structure, rows, _engine_orders(asked)), resolved)
        for tables in (found, found.get("scene") or {}):
            if "structure" in tables:
                named = named_files(tables["structure"])
                ids = {place: uploaded.get(name, name) for place, name in named.items()}
                tables["structure"] = with_named(tables["structure"], ids)
        return found

    def _row(self, key: str, at: int, upload_id: str, caller: Caller, source: str = "body") -> Upload:
        try:
            return self.get(upload_id, caller)
        except NotFoundError as error:
            raise InvalidRequestError.of((key, at), error.detail, named=False, source=source) from error

    def _rows(self, structure: Mapping[str, Any], caller: Caller) -> dict[Place, Upload]:
        """The uploads a structure names, by their places, or all that is wrong with its references."""
        rows, issues = {}, []
        for place, given in named_files(structure).items():
            key = place[-1]
            if not _is_reference(given):
                wanted = f"must be inline or an upload, `{UPLOAD}ID`: files are not read here"
                issues.append(Issue(("structure", *place), wanted))
                continue
            try:
                rows[place] = self.get(given.removeprefix(UPLOAD), caller)
            except NotFoundError as error:
                issues.append(Issue(("structure", *place), f"`{key}`: {error.detail}", named=False))
        if issues:
            raise InvalidRequestError(issues)
        return rows

    def _with(
        self, structure: Mapping[str, Any], rows: Mapping[Place, Upload], orders: list[int]
    ) -> dict[str, Any]:
        known = _digest(structure, rows, orders)
        with self._lock:
            text = self._resolved.pop(known, None)
            if text is not None:
                self._resolved[known] = text
        if text is not None:
            kept: dict[str, Any] = json.loads(text)
            return kept
        names = file_names(rows)
        with self._placed(rows, names) as folder:
            try:
                placed = with_named(structure, names)
                found = resolved_structure(placed, folder, self._seconds, _LARGEST_STRUCTURE, orders)
            except UnreadableUploadError as error:
                message = error.detail + (_REDUCE if structure.get("sectors") is not None else "")
                raise InvalidRequestError.of(
                    ("structure", *next(iter(rows))), message, named=False
                ) from error
        self._remember(known, found)
        return found

    @contextmanager
    def _placed(self, rows: Mapping[Place, Upload], names: Mapping[Place, str]) -> Iterator[Path]:
        """A folder that holds the files of uploads under their names."""
        with self.repository.files.work() as folder:
            for name, row in {names[place]: row for place, row in rows.items()}.items():
                self.repository.files.place(row, folder / name)
            yield folder

    def _remember(self, known: str, found: dict[str, Any]) -> None:
        text = encoded(found)
        with self._lock:
            self._resolved[known] = text
            while sum(map(len, self._resolved.values())) > _LARGEST_STRUCTURE:
                self._resolved.popitem(last=False)


def file_names(rows: Mapping[Place, Upload]) -> dict[Place, str]:
    """Names of files for uploads by their places: those they came with, each upload its own."""
    owners: dict[str, str] = {}
    names = {}
    for at, (place, row) in enumerate(rows.items(), start=1):
        name = file_name(row.name, row.format)
        # Never with the place in it: the name of a part is the client's, and might lead out of the folder.
        while owners.setdefault(name, row.id) != row.id:
            name = f"{at}-{name}"
        names[place] = name
    return names


def file_name(name: str, form: str) -> str:
    """The name an upload came with, with an ending of its format."""
    from solver.matrices.readers import reader_registry as registry

    return name if registry.word_of(name, "") == form else f"{name}.{form}"


def _digest(structure: Mapping[str, Any], rows: Mapping[Place, Upload], orders: list[int]) -> str:
    """What a structure resolves to depends on: its tables, what the files hold under which names, and the
    engine orders, which say at which nodal diameters a sector is reduced.
    """
    names = file_names(rows)
    held = [[*place, row.sha256, names[place]] for place, row in rows.items()]
    return digest({"structure": with_named(structure, names), "files": held, "orders": orders})


def _engine_orders(body: Mapping[str, object]) -> list[int]:
    """Engine orders of the excitation of a scene that has sectors."""
    structure, given = body.get("structure"), body.get("excitation")
    if not isinstance(structure, Mapping) or structure.get("sectors") is None:
        return []
    rows = given if isinstance(given, list) else [given]
    found = {row.get("engine_order", 0) for row in rows if isinstance(row, Mapping)}
    return sorted(order for order in found if type(order) is int)


def _is_reference(value: object) -> bool:
    return isinstance(value, str) and value.startswith(UPLOAD)
