"""Large arrays outside of the database: the same to who reads, deleted with their run, checked."""

import os
import shutil
from pathlib import Path

import pytest
from service_helpers import MakeSettings

from service.client.embedded import EmbeddedService
from stickslip.lab.stores.array_store import OUTSIDE_BYTES, FsspecStore
from service.db.repositories.integrity import check
from service.errors import ConfigurationError, DatabaseError
from service.jobs.stored_figures import StoredArray
from service.queue.core import Service
from service.queue.retention import prune_database

SWEEP = {"scene": "bladed-disk", "harmonics": 5}


@pytest.fixture(params=["folder", "memory"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    return str(tmp_path / "arrays") if request.param == "folder" else f"memory://{tmp_path}"


def computed(service: EmbeddedService) -> str:
    """The sweep of a job that has ended."""
    [sweep] = service._service.stored.of_job(service.wait(service.submit("sweep", SWEEP)).id)
    return str(sweep.id)


def test_arrays_are_the_same_wherever_they_are(make_settings: MakeSettings, place: str) -> None:
    with EmbeddedService(make_settings()) as service:
        inside = service._service.stored.arrays(computed(service))
    Path(make_settings().database.removeprefix("sqlite:///")).unlink()
    settings = make_settings(arrays=place)
    with EmbeddedService(settings) as service:
        outside = service._service.stored.arrays(computed(service))
        assert {name: (a.sha256, a.data) for name, a in outside.items() if name != "seconds"} == {
            name: (a.sha256, a.data) for name, a in inside.items() if name != "seconds"
        }
        [job] = service._service.jobs.page()
        found = list(service._service.database.arrays.jobs())
        assert found == [job.id]
    large = sum(len(one.data) >= OUTSIDE_BYTES for one in outside.values())
    assert 0 < large < len(outside)
    assert check(settings.database, place).trouble == ()
    assert len([words for words in check(settings.database).trouble if "STICKSLIP_ARRAYS" in words]) == large
    assert prune_database(settings.database, 0.0, keep_designs=False, arrays=place).sweeps == 1
    service = Service(settings)
    assert list(service.database.arrays.jobs()) == []
    service.database.close()


def test_an_array_is_on_disk_before_its_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the folders that name it; the system is asked, as a power cut cannot be had here."""
    synced: list[int] = []
    monkeypatch.setattr(
        "service.db.upload_files.os.fsync", lambda opened: synced.append(os.fstat(opened).st_ino)
    )
    data = bytes(OUTSIDE_BYTES)
    FsspecStore(str(tmp_path / "arrays")).put("job", StoredArray(sha256="digest", data=data, size=len(data)))
    file = tmp_path / "arrays" / "job" / "digest.npy"
    assert file.read_bytes() == data
    assert synced == [path.stat().st_ino for path in (file, file.parent, file.parent.parent)]


def test_what_is_damaged_or_left_over_is_named(make_settings: MakeSettings, tmp_path: Path) -> None:
    place = tmp_path / "arrays"
    settings = make_settings(arrays=str(place))
    with EmbeddedService(settings) as service:
        sweep = computed(service)
    first = min(place.glob("*/*.npy"))
    data = first.read_bytes()
    first.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    [words] = check(settings.database, str(place)).trouble
    assert sweep in words
    assert "checksum" in words
    first.unlink()
    [words] = check(settings.database, str(place)).trouble
    assert "cannot be read" in words
    with EmbeddedService(settings) as service, pytest.raises(DatabaseError, match=first.name):
        service._service.stored.arrays(sweep)
    first.write_bytes(data)
    shutil.copytree(first.parent, place / "gone")
    [words] = check(settings.database, str(place)).trouble
    assert "1 jobs that are not there" in words


def test_only_what_nothing_refers_to_is_deleted(make_settings: MakeSettings, place: str) -> None:
    settings = make_settings(arrays=place)
    with EmbeddedService(settings) as service:
        sweep = computed(service)
        store, arrays = service._service.database.arrays, service._service.stored.arrays(sweep)
        [job] = store.jobs()
        kept = {one.sha256 for one in arrays.values()}
        store.keep(job, kept)
        assert service._service.stored.arrays(sweep).keys() == arrays.keys()
        store.keep(job, set())
        assert list(store.jobs()) == []


def test_a_place_that_cannot_be_is_refused(make_settings: MakeSettings) -> None:
    with pytest.raises(ConfigurationError, match="STICKSLIP_ARRAYS"):
        Service(make_settings(arrays="nowhere://bucket"))
