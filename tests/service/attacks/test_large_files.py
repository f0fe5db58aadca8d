"""Large files, in parts and whole: the service holds little of them, loses none, and others are served."""

from __future__ import annotations

import hashlib
import io
import random
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from besieged import Besieged, besieged, running
from service_helpers import until

from service.db.upload_files import WORK

ADDED_MB = 150.0
MB = 10**6
QUICK = {"kind": "iteration", "size": 2, "fresh": True}


def matrix(megabytes: int) -> bytes:
    """A dense matrix of about so many megabytes as npy: 1, 2, … on the diagonal."""
    rows = int((megabytes * MB / 8) ** 0.5)
    found = np.zeros((rows, rows))
    np.fill_diagonal(found, np.arange(1.0, rows + 1.0))
    file = io.BytesIO()
    np.save(file, found)
    return file.getvalue()


def deck(megabytes: int) -> bytes:
    """A deck of nodes of about so many megabytes."""
    nodes = range(1, megabytes * 26_000)
    rows = (f"{node},{node % 997:9.3f},{node % 991:9.3f},{node % 983:9.3f}\n" for node in nodes)
    return ("*NODE\n" + "".join(rows)).encode()


def in_parts(client: httpx.Client, data: bytes, most: int) -> list[str]:
    """Send the parts of a file; their ids."""
    ids = []
    for begin in range(0, len(data), most):
        answer = client.post(
            "/v1/uploads", params={"name": "K.npy", "format": "part"}, content=data[begin : begin + most]
        )
        assert answer.status_code == 201, answer.text
        ids.append(answer.json()["id"])
    return ids


def whole(client: httpx.Client, ids: list[str], **more: str) -> httpx.Response:
    """Have parts put together."""
    return client.post("/v1/uploads", params={"name": "K.npy", "part": ids, **more}, timeout=600.0)


def highest(service: Besieged) -> tuple[Callable[[threading.Event], None], list[float]]:
    """Who looks at the memory of the service process, and the highest above idle so far [MB]."""
    seen = [0.0]

    def watch(over: threading.Event) -> None:
        while not over.wait(0.005):
            seen[0] = max(seen[0], service.added())

    return watch, seen


def named(ids: list[str]) -> dict[str, Any]:
    """A plan that names a file as both of its matrices."""
    structure = {"kind": "matrices", "M": f"upload:{ids[0]}", "K": f"upload:{ids[-1]}", "dofs": {"tip": 1}}
    return {
        "scene": {
            "name": "large", "structure": structure, "contacts": [],
            "excitation": {"dof": "tip", "amplitude": 1.0}, "observe": {"dof": "tip", "band": [1.0, 2.0]},
        }
    }  # fmt: skip


def costs(folder: Path, megabytes: int, parts: int) -> float:
    """Memory of a service above idle [MB] while a file comes in parts, is looked at and planned with."""
    data = matrix(megabytes)
    most = -(-len(data) // parts)
    limits = {"max_upload_bytes": most, "inspection_seconds": 100.0}
    with besieged(folder, "ann", **limits) as service, service.client("ann") as client:
        client.post("/v1/plan", json={"scene": "two-dof"}).raise_for_status()
        client.post("/v1/uploads", params={"name": "K.npy"}, content=matrix(1)).raise_for_status()
        service.idle = service.memory()
        watch, seen = highest(service)
        with running(watch):
            ids = in_parts(client, data, most)
            del data
            steps = [("parts", seen[0])]
            nested = whole(client, ids, format="part")
            assert nested.status_code == 422, nested.text
            found = whole(client, ids)
            assert found.status_code in (201, 422), found.text
            steps.append((f"whole {found.status_code}", seen[0]))
            names = [found.json()["id"]] if found.is_success else ids[:1]
            looked = client.post("/v1/matrices", json={"uploads": names}, timeout=600.0)
            assert looked.status_code in (200, 422), looked.text
            steps.append((f"look {looked.status_code}", seen[0]))

            def plan(_over: threading.Event) -> None:
                with service.client("ann") as one:
                    answer = one.post("/v1/plan", json=named(names), timeout=600.0)
                    assert answer.status_code in (200, 422, 429, 503), answer.text

            with running(*[plan] * 4):
                pass
            steps.append(("plans", seen[0]))
    print({name: round(value) for name, value in steps})  # noqa: T201
    return seen[0]


def test_a_file_in_parts_is_never_in_the_service(tmp_path: Path) -> None:
    """Of 64 MB in eight parts the service keeps a piece at a time."""
    assert costs(tmp_path, 64, 8) < 40.0


@pytest.mark.long
@pytest.mark.parametrize("megabytes", [420, 1000])
def test_a_very_large_file_in_parts_is_never_in_the_service(tmp_path: Path, megabytes: int) -> None:
    assert costs(tmp_path, megabytes, 8) < ADDED_MB


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.long)])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """A new database."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path}/jobs.db"
        return
    with request.getfixturevalue("cluster").database() as made:
        yield made


@pytest.mark.long
@pytest.mark.parametrize("kills", [2, 30])
def test_parts_or_the_file_are_there_whenever_the_service_is_killed(
    place: str, tmp_path: Path, kills: int
) -> None:
    """And whatever order they are named in first."""
    rng = random.Random(kills)
    data = matrix(12)
    size = -(-len(data) // 6)
    digest = hashlib.sha256(data).hexdigest()
    limits: dict[str, object] = {"max_upload_bytes": size, "require_keys": False, "allow_remote": True}
    with besieged(tmp_path, url=place, **limits) as service, service.client() as client:
        ids = in_parts(client, data, size)
        shuffled = whole(client, list(reversed(ids)))
        assert shuffled.status_code == 422, shuffled.text
        begun = time.monotonic()
        found = whole(client, ids)
        takes = time.monotonic() - begun
        assert found.status_code == 201, found.text
        client.delete(found.headers["location"]).raise_for_status()
    outcomes: list[str] = []
    for kill in range(kills + 1):
        with besieged(tmp_path, url=place, **limits) as service, service.client() as client:
            if kill:
                outcomes.append(_left(client, ids, digest, rng))
                left = list(service.folder.glob(f"**/{WORK}*"))
                until(lambda left=left: not any(one.exists() for one in left))
                print(f"kill {kill}: {outcomes[-1]}", flush=True)  # noqa: T201
            if kill == kills:
                break
            ids = in_parts(client, data, size)
            asked = threading.Thread(target=_hung_up_on, args=(client, ids))
            asked.start()
            time.sleep(takes * 1.3 * (kill + rng.random()) / kills)
            service.process.kill()
            service.process.wait()
            asked.join(60.0)
    print({one: outcomes.count(one) for one in ("parts", "file")})  # noqa: T201


def _left(client: httpx.Client, ids: list[str], digest: str, rng: random.Random) -> str:
    """What a kill left, all `parts` or the `file`, either of them whole; it is deleted."""
    there = [client.get(f"/v1/uploads/{one}").status_code == 200 for one in ids]
    files = [one for one in client.get("/v1/uploads").json()["items"] if one["format"] != "part"]
    assert len(files) == (0 if all(there) else 1), "parts or the file"
    assert all(there) or not any(there)
    if all(there):
        for order in (ids[::-1], [*ids[1:], ids[0]], rng.sample(ids[1:], len(ids) - 1)):
            assert whole(client, order).status_code == 422
        again = whole(client, ids)
        assert again.status_code == 201, again.text
        files = [again.json()]
    assert files[0]["sha256"] == digest
    look = client.post("/v1/matrices", json={"uploads": [files[0]["id"]]}, timeout=60.0)
    assert "'K.npy' alone must hold M and K" in look.text, "it can be read"
    client.delete(f"/v1/uploads/{files[0]['id']}").raise_for_status()
    return "parts" if all(there) else "file"


def _hung_up_on(client: httpx.Client, ids: list[str]) -> None:
    try:
        whole(client, ids)
    except httpx.HTTPError:
        return


def quantile(values: list[float], share: float) -> float:
    """The time that so many did not exceed [s]."""
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


class Others:
    """Another owner's requests: reads, jobs, small uploads."""

    def __init__(self, service: Besieged, owner: str) -> None:
        self.took: dict[str, list[float]] = {"GET": [], "POST": [], "upload": []}
        self.refused: list[int] = []
        self._service, self._owner = service, owner

    def __call__(self, over: threading.Event) -> None:
        file = io.BytesIO()
        np.save(file, np.eye(3))
        with self._service.client(self._owner) as client:
            number = 0
            while not over.is_set():
                number += 1
                file.seek(file.getbuffer().nbytes - 8)
                file.write(np.float64(number).tobytes())
                self._time("GET", client, "GET", "/v1/jobs?limit=1")
                if number % 5 == 0:
                    self._time("POST", client, "POST", "/v1/jobs", json=QUICK)
                if number % 50 == 0:
                    self._time(
                        "upload",
                        client,
                        "POST",
                        "/v1/uploads",
                        params={"name": "M.npy"},
                        content=file.getvalue(),
                    )
                over.wait(0.005)

    def _time(self, what: str, client: httpx.Client, *how: Any, **more: Any) -> None:
        begun = time.monotonic()
        answer = client.request(*how, **more)
        self.took[what].append(time.monotonic() - begun)
        if answer.status_code >= 300:
            self.refused.append(answer.status_code)

    def told(self) -> str:
        return ", ".join(
            f"{what} {len(took)}: p50 {1e3 * quantile(took, 0.5):.0f} p99 {1e3 * quantile(took, 0.99):.0f} "
            f"most {1e3 * max(took):.0f} ms" for what, took in self.took.items() if took
        ) + f", refused {self.refused}"  # fmt: skip


def beside(service: Besieged, seconds: float, *attackers: Callable[[threading.Event], object]) -> Others:
    """What another owner's requests take beside attackers, at least so long."""
    others = Others(service, "bob")
    with running(*attackers, others):
        time.sleep(seconds)
    return others


@pytest.mark.long
@pytest.mark.parametrize("attack", ["parts", "decks"])
def test_others_are_served_beside_large_files(tmp_path: Path, attack: str) -> None:
    with besieged(tmp_path, "ann", "bob", "cat", answer_workers=2, inspection_seconds=100.0) as service:
        control = beside(service, 10.0)
        statuses: list[int] = []
        large, text = matrix(420 if attack == "parts" else 1), deck(24 if attack == "decks" else 0)

        def parts(over: threading.Event) -> None:
            with service.client("ann") as client:
                while not over.is_set():
                    statuses.append(whole(client, in_parts(client, large, 60 * MB)).status_code)

        def decks(owner: str) -> Callable[[threading.Event], None]:
            def send(over: threading.Event) -> None:
                with service.client(owner) as client:
                    number = 0
                    while not over.is_set():
                        number += 1
                        body = f"** {owner} {number}\n".encode() + text
                        answer = client.post(
                            "/v1/uploads", params={"name": "d.inp"}, content=body, timeout=600.0
                        )
                        statuses.append(answer.status_code)

            return send

        attackers = [parts] if attack == "parts" else [decks("ann"), decks("cat")]
        found = beside(service, 30.0, *attackers)
    print(f"control: {control.told()}\nbeside {attack}: {found.told()}; {statuses}")  # noqa: T201
    limit = max(0.25, 2.0 * quantile(control.took["GET"], 0.99))
    assert quantile(found.took["GET"], 0.99) <= limit
    assert not found.refused
    assert quantile(found.took["POST"], 0.5) <= max(0.05, 3.0 * quantile(control.took["POST"], 0.5))
    assert max(found.took["upload"]) < 10.0
