"""Jobs on a real Dask cluster: the same results, whatever happens to workers and scheduler."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from dask_cluster import DaskCluster, lives
from private_kinds import PRIVATE
from service_helpers import PATIENCE, pids, until
from sqlalchemy import select

import solver
from service.client.embedded import EmbeddedService
from service.db.models import Checkpoint, JobState
from service.errors import ConfigurationError
from service.jobs import strict_json
from service.jobs.kinds import SHIPPED
from service.jobs.outputs import Silent
from service.jobs.kind_registry import Registry
from service.jobs.strict_json import validated
from service.queue.health import check
from service.settings.settings import Settings, load_settings
from service.workers.executors import executor_of

BOTH = PRIVATE.extended(*SHIPPED)
DISK: dict[str, Any] = dict(solver.load_scene("bladed-disk").to_dict())
DISK["structure"] = {**DISK["structure"], "sectors": 3}
RANGE: dict[str, Any] = {"scene": "two-dof", "parameter": "damper.N0", "from": 60, "to": 160, "harmonics": 3}
BODIES: dict[str, dict[str, Any]] = {
    "sweep": {"scene": "two-dof", "harmonics": 3},
    "map": {**RANGE, "steps": 9, "frequencies": 1500},
    "peaks": RANGE,
    "design": {"scene": "two-dof", "variables": {"damper.N0": [20, 500]}, "harmonics": 3},
    "pareto": {"scene": "two-dof", "variables": {"damper.N0": [20, 500]}, "harmonics": 3, "points": 3},
    "solve": {"scene": "two-dof", "frequency_hz": 1.2, "harmonics": 3},
    "march": {"scene": "two-dof", "frequency_hz": 1.2},
    "wear": {
        "scene": "two-dof", "hours": 1e-4, "coefficient": {"damper": 1e-11}, "area": {"damper": 2e-4},
        "load_loss_per_depth": {"damper": 4e6}, "harmonics": 3,
    },
    "quasi-periodic": {
        "scene": "two-dof", "frequency_hz": 1.05, "second_hz": 1.3821, "amplitude": 60,
        "harmonics": 3, "turns": 24,
    },
    "transient": {"scene": "two-dof", "begin_hz": 0.9, "end_hz": 1.2, "ramp_seconds": 20.0},
    "accuracy": {"scene": "two-dof", "harmonics": [1, 3], "samples": [64], "repeats": 1},
    "campbell": {"scene": "two-dof", "speeds_rpm": [[60, 100]], "harmonics": 3},
    "interference": {"scene": "bladed-disk", "speed_rpm": 11000},
    "worst-mistuning": {
        "scene": "bladed-disk", "of": "tip", "starts": 2, "climbs": 2, "climb": 2, "harmonics": 1,
        "from": 740, "to": 780,
    },
    "mistuning": {
        "scene": DISK, "of": ["tip_middle", "tip"], "spread": 0.03, "samples": 6, "seed": 5, "from": 700,
        "to": 850, "harmonics": 1,
    },
    "modes": {"scene": "two-dof", "from": 0.01, "to": 10.0, "harmonics": 3},
    "controlled": {"scene": "two-dof", "amplitude": 1.0, "harmonics": 3},
    "margin": {"scene": "two-dof", "from": 20, "to": 120, "points": 3, "limit": 2.0, "harmonics": 3},
    "sensitivities": {"scene": "two-dof", "harmonics": 3},
    "plan": {"scene": "two-dof"},
    "posterior": {
        "scene": {
            "name": "rig",
            "structure": {
                "kind": "lumped", "masses": {"m": 1.0},
                "springs": [{"between": ["m", "ground"], "k": 41.0, "c": 0.5}],
            },
            "excitation": {"dof": "m", "amplitude": 2.0}, "observe": {"dof": "m", "band": [0.8, 1.3]},
        },
        "data": [{"frequency": [0.9, 1.0, 1.1], "amplitude": [0.22, 0.56, 0.27], "sd": [0.02, 0.02, 0.02]}],
        "unknowns": {"excitation.amplitude": [1.0, 3.0]}, "harmonics": 1, "starts": 1, "draws": 160,
    },
    "identify": {
        "scene": "two-dof", "unknowns": {"damper.N0": [20, 500]}, "harmonics": 3, "starts": 1,
        "data": [{"frequency": [0.9, 1.0, 1.1], "amplitude": [0.85, 1.95, 2.1]}],
    },
}  # fmt: skip
OF_TIME = ("seconds", "milliseconds", "pareto")  # the last: whether no other row is faster and as exact


def settings_on(folder: Path, cluster: DaskCluster, **values: object) -> Settings:
    defaults: dict[str, object] = {"grace_seconds": 0.3, "poll_seconds": 1.0, "max_attempts": 3}
    return load_settings(
        database=f"sqlite:///{folder}/jobs.db", executor="dask", dask_scheduler=cluster.address,
        **{**defaults, **values},
    )  # fmt: skip


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DaskCluster]:
    """Two workers; none of their processes is left afterwards."""
    with DaskCluster(tmp_path_factory.mktemp("cluster"), workers=2) as cluster:
        yield cluster
        left = [each for process in (*cluster.workers, cluster.scheduler) for each in cluster.family(process)]
    assert not [process for process in left if lives(process)]


@pytest.fixture(scope="module")
def service(
    dask: DaskCluster, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[EmbeddedService, DaskCluster]]:
    with EmbeddedService(settings_on(tmp_path_factory.mktemp("service"), dask), BOTH) as embedded:
        until(lambda: check(embedded._service).workers_ready == 2)
        yield embedded, dask


def timeless(value: Any) -> Any:
    """A result without the time it took."""
    if isinstance(value, dict):
        return {key: timeless(each) for key, each in value.items() if key not in OF_TIME}
    return [timeless(each) for each in value] if isinstance(value, list) else value


Ended = tuple[Any, list[dict[str, str]]]
"""The result of a job without the time it took, and the checksums of the arrays of its sweeps."""


def ended(service: EmbeddedService, kind: str, body: dict[str, Any]) -> Ended:
    return results_of(service, service.submit(kind, body))


def results_of(service: EmbeddedService, job: str) -> Ended:
    done = service.wait(job, timeout=PATIENCE)
    assert done.status is JobState.SUCCESSFUL, done
    results = service.results(job)
    arrays = [service._service.stored.arrays(sweep.id) for sweep in results.sweeps]
    return timeless(results.result), [{k: a.sha256 for k, a in each.items()} for each in arrays]


def computed(service: EmbeddedService, kind: str, body: dict[str, Any]) -> Ended:
    """The same, computed here and now."""
    resolved = SHIPPED[kind].resolve(validated(SHIPPED[kind].request, body), service._service.scenes)
    output = SHIPPED[kind].run(resolved.spec, Silent(), lambda: False)
    result = json.loads(json.dumps(strict_json.finite(output.result)))
    return timeless(result), [{k: a.sha256 for k, a in each.arrays.items()} for each in output.sweeps]


def threads_idle(service: EmbeddedService) -> bool:
    status = service._service.queue.status()
    return status.ready == 2 and status.busy == 0


@pytest.mark.few(2)
@pytest.mark.parametrize("kinds", [("sweep", "mistuning"), tuple(BODIES)], ids=["two", "all"])
def test_every_kind_gives_what_it_gives_here(
    service: tuple[EmbeddedService, DaskCluster], kinds: tuple[str, ...]
) -> None:
    """Bit for bit, divided or not, with the arrays of all sweeps."""
    assert set(BODIES) == {kind.name for kind in SHIPPED}
    jobs = {kind: service[0].submit(kind, BODIES[kind]) for kind in kinds}
    here = {kind: computed(service[0], kind, BODIES[kind]) for kind in kinds}
    for kind, job in jobs.items():
        assert results_of(service[0], job) == here[kind], kind


@pytest.mark.long
def test_every_kind_gives_what_local_workers_give(
    service: tuple[EmbeddedService, DaskCluster], tmp_path: Path
) -> None:
    settings = load_settings(database=f"sqlite:///{tmp_path}/jobs.db", workers=1)
    with EmbeddedService(settings) as local:
        for kind, body in BODIES.items():
            fresh = {**body, "fresh": True}
            assert ended(service[0], kind, fresh) == ended(local, kind, fresh), kind


def test_failures_are_those_of_a_local_worker(service: tuple[EmbeddedService, DaskCluster]) -> None:
    embedded, _ = service
    expected = {
        "bad-scene": ("scene", 1), "bad-setting": ("setting", 1), "falls-short": ("goal-not-reached", 1),
        "broken": ("internal", 1), "not-json": ("internal", 1), "unsendable": ("internal", 1),
        "out-of-memory": ("memory-limit", 1),
    }  # fmt: skip
    jobs = {kind: embedded.submit(kind, {}) for kind in expected}
    ends = {kind: embedded.wait(job, timeout=PATIENCE) for kind, job in jobs.items()}
    assert {k: (e.error and e.error["type"], e.attempt) for k, e in ends.items()} == expected
    threads = embedded.submit("threads", {})
    assert embedded.wait(threads).status is JobState.SUCCESSFUL
    assert set(embedded.results(threads).result.values()) == {"1"}


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux alone")
def test_a_worker_has_the_limit_of_memory_of_the_service(
    service: tuple[EmbeddedService, DaskCluster], tmp_path: Path
) -> None:
    """A job that meets it fails with that word; its worker lives on, and other services have their own."""
    embedded, dask = service
    workers = embedded._service.queue._executor._cluster._client.run(os.getpid)
    with EmbeddedService(settings_on(tmp_path, dask, worker_memory_bytes=300_000_000), BOTH) as limited:
        until(lambda: check(limited._service).workers_ready == 2)
        large = limited.wait(limited.submit("allocate", {"seed": 500}), timeout=PATIENCE)
        assert large.error is not None, large
        assert (large.error["type"], large.attempt) == ("memory-limit", 1)
        assert "300 MB" in large.error["detail"]
        small = limited.wait(limited.submit("allocate", {"seed": 100}), timeout=PATIENCE)
        assert small.status is JobState.SUCCESSFUL, small
    other = embedded.wait(embedded.submit("allocate", {"seed": 500}), timeout=PATIENCE)
    assert other.status is JobState.SUCCESSFUL, other
    assert embedded._service.queue._executor._cluster._client.run(os.getpid) == workers


def test_progress_and_cancel(service: tuple[EmbeddedService, DaskCluster]) -> None:
    embedded, _ = service
    seen: list[float] = []
    job, begun = embedded.submit("iteration", {"seconds": 0.6}), time.monotonic()
    done = embedded.wait(job, on_progress=lambda share, _points: seen.append(share))
    elapsed = time.monotonic() - begun
    assert done.status is JobState.SUCCESSFUL
    assert seen == sorted(seen)
    assert 2 <= len(seen) <= 10 * elapsed + 2, "at most ten times a second"
    processes = embedded._service.queue._executor._cluster._client.run
    before = processes(os.getpid)
    job = embedded.submit("iteration", {"seconds": 600.0})
    until(lambda: embedded.job(job).progress > 0.0)
    assert embedded.dismiss(job).status is JobState.DISMISSED
    until(lambda: threads_idle(embedded))
    assert processes(os.getpid) == before, "its worker heeded, it is not restarted"


@pytest.mark.long
def test_a_divided_job_leaves_room_for_others(service: tuple[EmbeddedService, DaskCluster]) -> None:
    """Its parts are on both workers, a small job gets between them, and a cancel ends them all."""
    embedded, _ = service
    study = embedded.submit("mistuning", {**BODIES["mistuning"], "samples": 2000})
    client = embedded._service.queue._executor._cluster._client
    until(lambda: len(computing := client.processing()) == 2 and all(computing.values()))
    until(lambda: embedded.job(study).points > 0)
    small = embedded.wait(embedded.submit("iteration", {"seed": 4}), timeout=PATIENCE)
    assert small.status is JobState.SUCCESSFUL
    assert embedded.job(study).status is JobState.RUNNING
    assert embedded.dismiss(study).status is JobState.DISMISSED
    until(lambda: threads_idle(embedded))
    assert embedded.job(study).points < 1000, "half of it"


def test_parts_are_computed_where_there_is_room(service: tuple[EmbeddedService, DaskCluster]) -> None:
    embedded, dask = service
    body = {"size": 20, "seconds": 0.1}
    (result, _), known = ended(embedded, "naps", body), {each.pid for each in processes_of(dask)}
    assert result["square"] == [number**2 for number in range(20)]
    assert len(set(result["pid"])) == 2
    assert set(result["pid"]) <= known


def processes_of(dask: DaskCluster) -> list[Any]:
    return [each for process in dask.workers for each in dask.family(process)]


def test_a_worker_with_another_version_computes_nothing(
    service: tuple[EmbeddedService, DaskCluster], monkeypatch: pytest.MonkeyPatch
) -> None:
    embedded, _ = service
    monkeypatch.setattr(embedded._service.queue._executor, "_version", "0.0.0")
    done = embedded.wait(embedded.submit("iteration", {"seed": 99}), timeout=PATIENCE)
    assert done.status is JobState.FAILED
    assert done.error is not None
    assert "the service 0.0.0, in attempt 3 of 3" in done.error["detail"]


@pytest.mark.long
def test_closing_gives_jobs_back_and_frees_the_workers(
    service: tuple[EmbeddedService, DaskCluster], tmp_path: Path
) -> None:
    """A divided job goes on behind the parts that it had."""
    _, dask = service
    settings = settings_on(tmp_path, dask)
    with EmbeddedService(settings, BOTH) as other:
        study = other.submit("mistuning", {**BODIES["mistuning"], "samples": 2000})
        job = other.submit("iteration", {"seconds": 1.0})
        until(lambda: other.job(job).progress > 0.0 and other.job(study).points > 20)
    with EmbeddedService(settings, BOTH) as other:
        until(lambda: other.job(study).status is JobState.RUNNING)
        assert other.job(study).points > 15
        assert other.wait(job, timeout=PATIENCE).attempt == 1, "a shutdown costs no attempt"
        assert other.dismiss(study).status is JobState.DISMISSED


def test_a_worker_killed_costs_an_attempt(
    service: tuple[EmbeddedService, DaskCluster], tmp_path: Path
) -> None:
    """The scheduler would try it elsewhere by itself: that counts as an attempt all the same."""
    embedded, _ = service
    file = tmp_path / "pids"
    job = embedded.submit("iteration", {"seconds": 1.5, "pid_file": str(file)})
    until(lambda: embedded.job(job).progress > 0.0)
    first = pids(file)[0]
    os.kill(first, signal.SIGKILL)
    done = embedded.wait(job, timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.SUCCESSFUL, 2)
    assert first not in pids(file)[1:]
    until(lambda: threads_idle(embedded))


@pytest.mark.long
def test_a_sweep_goes_on_behind_its_last_checkpoint(
    service: tuple[EmbeddedService, DaskCluster], tmp_path: Path
) -> None:
    """Its worker is killed in the middle: the branch is the one that is computed without that, to the bit.

    Points come as they are found, each once in every attempt, whichever worker has the next stretch.
    """
    annulus = solver.annulus(solver.load_scene("bladed-disk")).to_dict()
    body = {"scene": annulus, "from": 690, "to": 720, "harmonics": 13}
    pace = {"checkpoint_seconds": 0.25, "progress_seconds": 0.01}
    with EmbeddedService(settings_on(tmp_path, service[1], **pace), BOTH) as embedded:
        queue, seen = embedded._service.queue, dict[int, list[tuple[float, float]]]()
        at_work: list[str] = []

        def kept() -> list[tuple[int, int]]:
            if live := queue.live(job):
                seen[live.attempt] = list(live.found)
            query = select(Checkpoint.part, Checkpoint.attempt).where(Checkpoint.job_id == job)
            with embedded._service.database.reading() as connection:
                return [
                    (row.part, row.attempt) for row in connection.execute(query.order_by(Checkpoint.part))
                ]

        def busy() -> list[str]:
            return [flight.worker for flight in queue._executor._flights.values() if flight.begun]

        job = embedded.submit("slow-sweep", body)
        until(kept)
        workers = queue._executor._cluster._client.run(os.getpid)
        until(lambda: len(kept()) >= 2)
        until(lambda: at_work.extend(busy()[:1]) or at_work)
        os.kill(workers[at_work[0]], signal.SIGKILL)
        until(lambda: {attempt for _, attempt in kept()} == {1, 2})
        assert [part for part, _ in kept()] == list(range(len(kept()))), "nothing was kept twice"
        until(lambda: not kept() and embedded.job(job).status.finished)
        done = embedded.job(job)
        assert (done.status, done.attempt) == (JobState.SUCCESSFUL, 2)
        (sweep,) = embedded.results(job).sweeps
        arrays = embedded._service.stored.arrays(sweep.id)
        result, (whole,) = computed(embedded, "sweep", body)
        assert timeless(embedded.results(job).result) == result
        assert {name: array.sha256 for name, array in arrays.items()} == whole
        curve = list(zip(result["parameter"], result["amplitude"], strict=True))
        for found in seen.values():
            assert 0 < len(found) <= len(curve)
            # The finished branch has the points that were told, in their order, and those put between.
            rest = iter(curve)
            assert all(point in rest for point in found)
        until(lambda: threads_idle(embedded))


@pytest.mark.long
def test_a_part_that_is_lost_is_computed_again_alone(
    service: tuple[EmbeddedService, DaskCluster],
) -> None:
    embedded, dask = service
    body = {**BODIES["mistuning"], "samples": 16, "seed": 70}
    job = embedded.submit("mistuning", body)
    until(lambda: embedded.job(job).points > 0)
    victim = next(p for p in dask.family(dask.workers[0]) if "spawn_main" in " ".join(p.cmdline()))
    victim.kill()
    done = embedded.wait(job, timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.SUCCESSFUL, 1)
    assert timeless(embedded.results(job).result) == computed(embedded, "mistuning", body)[0]


@pytest.mark.long
def test_the_scheduler_dies_and_comes_back(service: tuple[EmbeddedService, DaskCluster]) -> None:
    """Health says so; what ran is tried again when scheduler and workers are back."""
    embedded, dask = service
    until(lambda: threads_idle(embedded))
    job = embedded.submit("iteration", {"seconds": 1.0})
    until(lambda: embedded.job(job).progress > 0.0)
    before = [process for worker in dask.workers for process in dask.family(worker)]
    dask.kill_scheduler()
    until(lambda: not check(embedded._service).ready)
    assert any("Dask scheduler" in line for line in check(embedded._service).trouble)
    until(lambda: embedded.job(job).status is JobState.ACCEPTED)
    for worker in dask.workers:
        assert worker.wait(PATIENCE) is not None, "Dask's workers end with their scheduler"
    until(lambda: not [process for process in before if lives(process)])
    dask.workers.clear()
    dask.start_scheduler()
    until(lambda: any("no workers" in line for line in check(embedded._service).trouble))
    dask.add_worker()
    dask.add_worker()
    done = embedded.wait(job, timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.SUCCESSFUL, 2)
    until(lambda: threads_idle(embedded))
    assert check(embedded._service).trouble == []


@pytest.mark.long
def test_a_worker_that_does_not_heed_is_ended(service: tuple[EmbeddedService, DaskCluster]) -> None:
    embedded, _ = service
    job = embedded.submit("deaf", {"seconds": 300.0})
    until(lambda: embedded.job(job).progress > 0.0)
    assert embedded.dismiss(job).status is JobState.DISMISSED
    assert embedded._service.queue.status().busy == 1, "its thread is not given to others"
    until(lambda: threads_idle(embedded))


def test_a_service_without_the_extra_says_what_is_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    for module in ("dask_executor", "cluster"):  # loaded by the tests before
        monkeypatch.delitem(sys.modules, f"stickslip.lab.dask.{module}", raising=False)
    settings = load_settings(
        database=f"sqlite:///{tmp_path}/jobs.db", executor="dask", dask_scheduler="tcp://127.0.0.1:1"
    )
    with pytest.raises(ConfigurationError, match=r"pip install 'stickslip\[dask\]'"):
        executor_of(settings, Registry([]))


def test_a_scheduler_that_is_not_there(tmp_path: Path) -> None:
    settings = load_settings(
        database=f"sqlite:///{tmp_path}/jobs.db", executor="dask", dask_scheduler="tcp://127.0.0.1:9"
    )
    with EmbeddedService(settings, PRIVATE) as embedded:
        assert not check(embedded._service).ready
        job = embedded.submit("iteration", {})
        until(lambda: "does not answer" in " ".join(check(embedded._service).trouble))
        assert embedded.job(job).status is JobState.ACCEPTED


def certificates(folder: Path) -> dict[str, Path]:
    """A certificate authority of one day, and a certificate it signed."""
    files = {name: folder / f"{name}.pem" for name in ("ca", "ca_key", "cert", "key", "request")}
    new = ("-newkey", "rsa:2048", "-nodes", "-subj")
    signed = ("-CA", str(files["ca"]), "-CAkey", str(files["ca_key"]), "-CAcreateserial", "-days", "1")
    for command in (
        (
            "req",
            "-x509",
            *new,
            "/CN=authority",
            "-days",
            "1",
            "-keyout",
            str(files["ca_key"]),
            "-out",
            str(files["ca"]),
        ),
        ("req", *new, "/CN=stickslip", "-keyout", str(files["key"]), "-out", str(files["request"])),
        ("x509", "-req", "-in", str(files["request"]), *signed, "-out", str(files["cert"])),
    ):
        subprocess.run(["openssl", *command], check=True, capture_output=True)
    return files


@pytest.mark.long
@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")
def test_certificates_on_all_sides(tmp_path: Path) -> None:
    files = certificates(tmp_path)
    flags = [
        f"--tls-{name}={files[key]}" for name, key in (("ca-file", "ca"), ("cert", "cert"), ("key", "key"))
    ]
    with DaskCluster(tmp_path, workers=1, extra=("--protocol", "tls", *flags), scheme="tls") as cluster:
        names = {f"dask_{name}_file": files[name] for name in ("ca", "cert", "key")}
        with EmbeddedService(settings_on(tmp_path, cluster, **names), BOTH) as embedded:
            done = embedded.wait(embedded.submit("iteration", {}), timeout=PATIENCE)
            assert done.status is JobState.SUCCESSFUL
        (tmp_path / "others").mkdir()
        others = certificates(tmp_path / "others")
        names = {f"dask_{name}_file": others[name] for name in ("ca", "cert", "key")}
        with EmbeddedService(settings_on(tmp_path, cluster, **names), BOTH) as stranger:
            until(lambda: "does not answer" in " ".join(check(stranger._service).trouble))


@pytest.mark.long
def test_a_thousand_disks_on_two_workers(service: tuple[EmbeddedService, DaskCluster]) -> None:
    embedded, _ = service
    body = {**BODIES["mistuning"], "samples": 1000}
    job = embedded.submit("mistuning", body)
    assert embedded.wait(job, timeout=900.0).status is JobState.SUCCESSFUL
    result = embedded.results(job).result
    assert timeless(result) == computed(embedded, "mistuning", body)[0]


def test_the_examples_of_the_page_are_well_formed() -> None:
    page = (Path(__file__).parents[4] / "docs" / "cluster.md").read_text(encoding="utf-8")
    blocks = [
        textwrap.dedent(block) for block in re.findall(r"(?:^(?: {4}.*)?\n)+", page, flags=re.MULTILINE)
    ]
    (manifest,) = [yaml.safe_load(block) for block in blocks if "apiVersion" in block]
    scheduler, worker = manifest["spec"]["scheduler"], manifest["spec"]["worker"]
    assert scheduler["service"]["selector"]["dask.org/cluster-name"] == manifest["metadata"]["name"]
    assert worker["spec"]["containers"][0]["env"] == [{"name": "NUMBA_NUM_THREADS", "value": "1"}]
    (script,) = [block for block in blocks if "SLURMCluster" in block]
    compile(script, "cluster.md", "exec")
    named = set(re.findall(r"STICKSLIP_(\w+)", page))
    assert named <= {name.upper() for name in Settings.model_fields}
