"""What uploads hold, outside of rows: beside SQLite's file, in pieces in PostgreSQL."""

import hashlib
import os
import subprocess
import sys
import tempfile
import time
import tracemalloc
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import sqlalchemy as sa
from service_helpers import is_problem, stored_upload
from sqlalchemy import event
from test_migrations import contents, down
from upload_cases import npz, upload

from service.db import revisions
from service.db.clock import new_id, utc_now
from service.db.engine import Database, backup, is_sqlite, migrating
from service.db.models import Upload, UploadPiece
from service.db.repositories import UploadRepository
from service.db.repositories.integrity import check
from service.db.upload_files import PIECE_BYTES, WORK
from service.errors import DatabaseAwayError, UnreadableUploadError
from service.uploads import inspection

SAID = {"owner": "ann", "name": "K.npz", "format": "npz"}
LARGE = os.urandom(3 * PIECE_BYTES + 5)


def kept(database: Database) -> set[str]:
    """The uploads of which something is kept."""
    if is_sqlite(database.url):
        return {path.name for path in files(database).iterdir()}
    with database.reading() as connection:
        return set(connection.execute(sa.select(UploadPiece.upload_id)).scalars())


def files(database: Database) -> Path:
    return Path(f"{sa.make_url(database.url).database}.files")


def test_bytes_come_in_pieces_before_the_row_and_go_after_it(database: Database) -> None:
    """No statement has more than a piece, and the row is written last and deleted first."""
    uploads, sent = UploadRepository(database), []

    def seen(_conn: object, _cursor: object, statement: str, values: Any, *_: object) -> None:
        if "upload" in statement and not statement.startswith("SELECT"):
            given = values.values() if isinstance(values, dict) else values
            size = max((len(one) for one in given if isinstance(one, bytes)), default=0)
            sent.append((statement.split()[0], "upload_piece" in statement, size, there()))

    def there() -> bool:
        return not is_sqlite(database.url) or any(len(one.name) == 36 for one in files(database).iterdir())

    event.listen(database._write, "before_cursor_execute", seen)
    row, _ = stored_upload(uploads, LARGE, sha256=hashlib.sha256(LARGE).hexdigest(), **SAID)
    uploads.delete(row.id)
    event.remove(database._write, "before_cursor_execute", seen)
    assert all(size <= PIECE_BYTES for _, _, size, _ in sent)
    rows = [verb for verb, piece, *_ in sent if not piece]
    assert rows == ["INSERT", "DELETE", "DELETE"], "the second is of no parts"
    assert all(bytes_are_there for *_, piece, _, bytes_are_there in sent if not piece)
    if not is_sqlite(database.url):
        assert [piece for verb, piece, *_ in sent if verb == "INSERT"] == [True] * 4 + [False]
        assert sent[-1][:2] == ("DELETE", True)
    assert row.id not in kept(database)


def test_what_is_read_is_what_was_sent(database: Database) -> None:
    uploads = UploadRepository(database)
    for data in (LARGE, LARGE[:PIECE_BYTES], b"", b"x"):
        row, _ = stored_upload(uploads, data, sha256=hashlib.sha256(data).hexdigest(), **SAID)
        assert b"".join(uploads.files.pieces(row.id)) == data
        with uploads.files.work() as folder:
            uploads.files.place(row, folder / "file")
            assert (folder / "file").read_bytes() == data
    assert check(database.url).sound


def test_a_crash_leaves_too_much_and_that_is_swept(database: Database) -> None:
    uploads = UploadRepository(database)
    row, _ = stored_upload(uploads, LARGE, sha256="", **SAID)
    left = new_id()
    with uploads.files.work() as folder:
        (folder / "file").write_bytes(LARGE)
        uploads.files.put(left, folder / "file")
    assert kept(database) == {row.id, left}
    uploads.files.sweep(utc_now() + timedelta(hours=23))
    assert kept(database) == {row.id, left}, "it may be about to have a row"
    uploads.files.sweep(utc_now() + timedelta(hours=25))
    assert kept(database) == {row.id}
    if is_sqlite(database.url):
        abandoned = files(database) / f"{WORK}1"
        abandoned.mkdir()
        (abandoned / "K.npz").write_bytes(b"x")
        os.utime(abandoned, (time.time() - 1e5,) * 2)
        uploads.files.sweep(utc_now())
        assert kept(database) == {row.id}


_WORKS = """
import os, signal, sys
from service.db.engine import Database
from service.db.repositories import UploadRepository
with UploadRepository(Database(sys.argv[1])).files.work() as folder:
    (folder / "file").write_bytes(b"x")
    print(folder, flush=True)
    sys.stdin.read()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_folder_of_a_process_that_was_killed_goes_at_once(
    database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that is in use stays, whatever the clock says."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    files = UploadRepository(database).files
    command = [sys.executable, "-c", _WORKS, database.url]
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout is not None
        folder = Path(process.stdout.readline().strip())
        files.sweep(utc_now() + timedelta(days=2))
        assert (folder / "file").exists()
        process.communicate("")
    files.sweep(utc_now() - timedelta(days=2))
    assert not folder.exists()


@pytest.mark.usefixtures("earlier")
def test_what_an_older_version_stored_is_moved_and_moved_back(url: str) -> None:
    revisions.upgrade(url, "0012")
    held = {new_id(): data for data in (LARGE, b"abc", b"")}
    with migrating(url) as connection:
        table = sa.Table("upload", sa.MetaData(), autoload_with=connection)
        for one, data in held.items():
            values = {"id": one, "size": len(data), "sha256": hashlib.sha256(data).hexdigest(), "data": data}
            connection.execute(sa.insert(table).values(created=utc_now(), **values, **SAID))
    before = contents(url, ("upload",))
    revisions.upgrade(url)
    database = Database(url)
    try:
        pieces = UploadRepository(database).files.pieces
        assert {one: b"".join(pieces(one)) for one in held} == held
    finally:
        database.close()
    assert check(url).sound
    down(url, "0012")
    assert contents(url, ("upload",)) == before
    revisions.upgrade(url)
    assert check(url).sound


def test_a_backup_has_the_files_and_the_check_reads_them(tmp_path: Path) -> None:
    url, copy = f"sqlite:///{tmp_path}/jobs.db", f"sqlite:///{tmp_path}/copy.db"
    revisions.upgrade(url)
    database = Database(url)
    uploads = UploadRepository(database)
    row, _ = stored_upload(uploads, b"abc", sha256=hashlib.sha256(b"abc").hexdigest(), **SAID)
    backup(url, tmp_path / "copy.db")
    uploads.delete(row.id)
    database.close()
    assert check(copy).sound
    held = tmp_path / "copy.db.files" / row.id
    assert held.stat().st_mode & 0o777 == 0o400
    held.chmod(0o600)
    held.write_bytes(b"abd")
    [words] = check(copy).trouble
    assert row.id in words
    held.unlink()
    [words] = check(copy).trouble
    assert "gone" in words


def test_a_full_disk_is_no_error_of_the_program(database: Database) -> None:
    with pytest.raises(DatabaseAwayError, match="no room"), UploadRepository(database).files.work():
        raise OSError(28, "No space left on device")
    with pytest.raises(OSError, match="other"), UploadRepository(database).files.work():
        raise OSError(5, "other")


def test_the_memory_of_storing_and_reading_does_not_grow_with_a_file(database: Database) -> None:
    """Of 24 MB a few pieces are held; the file that is read is a link, or is written piece by piece."""
    uploads = UploadRepository(database)
    with uploads.files.work() as folder:
        with (folder / "file").open("wb") as file:
            file.truncate(24 * PIECE_BYTES)
        tracemalloc.start()
        row, _ = uploads.add(folder / "file", Upload(size=24 * PIECE_BYTES, sha256="", **SAID))
        uploads.files.place(row, folder / "again")
        highest = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert highest < 6 * PIECE_BYTES


def test_what_is_refused_leaves_the_parts(http: httpx.Client) -> None:
    data = npz(K=np.arange(1.0, 10.0).reshape(3, 3) + 5.0 * np.eye(3))
    cut = len(data) // 2
    ids = [
        upload(http, "K.npz", one, format="part").json()["id"] for one in (data[:cut], data[cut:])
    ]  # fmt: skip
    put = {"name": "K.npz", "part": ids}
    is_problem(http.post("/v1/uploads", params={**put, "part": ids[::-1]}), 422)
    nested = is_problem(http.post("/v1/uploads", params={**put, "format": "part"}), 422)
    assert [one["pointer"] for one in nested["errors"]] == ["/part"]
    assert http.post("/v1/uploads", params=put).status_code == 201
    assert [http.get(f"/v1/uploads/{one}").status_code for one in ids] == [404, 404]


def test_an_archive_that_inflates_is_refused_at_once(tmp_path: Path) -> None:
    zeros = np.zeros((9000, 9000), np.uint8)
    file = tmp_path / "K.npz"
    np.savez_compressed(file, K=zeros)
    begun = time.monotonic()
    with pytest.raises(UnreadableUploadError, match="of an archive"):
        inspection.contents(file, 60.0)
    assert time.monotonic() - begun < 30.0
    np.savez_compressed(file, K=np.eye(100))
    assert inspection.contents(file, 60.0)[0][0]["rows"] == 100
