"""A study of 1000 mistuned disks on the workers of a Dask cluster."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import solver
from benchmarks.harness import check, expect, table

STUDY = {
    "scene": "bladed-disk", "of": ["tip_middle", "tip"], "spread": 0.02, "samples": 1000, "seed": 1,
    "from": 700, "to": 850, "harmonics": 1,
}  # fmt: skip
WORKERS = 2


def mistuning_study() -> None:
    """1000 disks of 8 blades, through the service, on two workers of a Dask cluster."""
    # Loaded here: an extra, which the other benchmarks do without.
    from distributed import LocalCluster

    from service.client.embedded import EmbeddedService
    from service.settings.settings import load_settings

    with (
        tempfile.TemporaryDirectory() as folder,
        LocalCluster(
            n_workers=WORKERS, threads_per_worker=1, dashboard_address=None, host="127.0.0.1",
            local_directory=folder,
        ) as cluster,
    ):  # fmt: skip
        settings = load_settings(
            database=f"sqlite:///{Path(folder)}/jobs.db",
            executor="dask",
            dask_scheduler=cluster.scheduler_address,
        )
        with EmbeddedService(settings) as service:
            for seed in range(2 * WORKERS):
                service.wait(service.submit("mistuning", {**STUDY, "samples": 1, "seed": seed}))
            begun = time.perf_counter()
            job = service.submit("mistuning", STUDY)
            done = service.wait(job)
            wall = time.perf_counter() - begun
            expect(f"study: {done.status.value}", done.status.value == "successful")
            found = service.results(job).result
    expect("1000 disks", len(found["samples"]) == STUDY["samples"])
    disk = solver.mistuned(solver.load_scene("bladed-disk"), of=STUDY["of"], spread=0.02, seed=700)
    alone = solver.blade_peaks(disk, 700.0, 850.0, harmonics=1)
    peak = check("a disk on its own", found["samples"][699]["largest"], alone.largest, 1e-15)
    share = found["seconds"] / (WORKERS * wall)
    header = (
        "study",
        "workers",
        "s (wall)",
        "s, all parts",
        "share of the workers' time",
        "a disk on its own",
    )
    row = (
        "1000 disks",
        str(WORKERS),
        f"{wall:.1f}",
        f"{found['seconds']:.1f}",
        f"{100.0 * share:.0f} %",
        peak,
    )
    table("Mistuned disks on a cluster", header, [row])
    print(f"magnification: mean {found['mean']:.4f}, largest {found['worst']['magnification']:.4f}")
