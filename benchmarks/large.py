"""Two hundred contacts: one response in a process of its own, with what it takes in memory."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time

from benchmarks.harness import check, expect, table

CONTACTS, HARMONICS = 200, 7
FREQUENCIES = (0.5, 1.1, 1.5)  # Hz
WANTED_SECONDS, WANTED_GIB = 2.0, 2.0
THREADS = "2"
MIB = 1024.0  # ru_maxrss is in KiB


def two_hundred_contacts() -> None:
    """Chain of 200 masses and 200 sliders, some stuck and some not: a response, and the memory it takes."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": THREADS, "OMP_NUM_THREADS": THREADS}
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.large"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    expect(f"the process ended with {done.returncode}: {done.stderr[-500:]}", done.returncode == 0)
    answer = json.loads(done.stdout)
    rows = []
    for row in answer["rows"]:
        expect(f"at {row['frequency_hz']} Hz: {row['status']}", row["converged"])
        expect(f"residual {row['residual']:.1e}", row["residual"] <= 1e-9)
        expect("the time march settled", row["marched"] is not None)
        expect(f"power lost {row['imbalance']:.1e}", row["imbalance"] <= 1e-9)
        rows.append(
            (f"{row['frequency_hz']:g} Hz", str(row["slipping"]), str(row["iterations"]),
             f"{row['cpu_seconds']:.2f}", f"{row['seconds']:.2f}", f"{WANTED_SECONDS:g}",
             check("half peak-to-peak", row["half_range"], row["marched"], 1e-3))
        )  # fmt: skip
    header = ("at", "slipping", "iterations", "s (process)", "s (wall)", "wanted s", "half peak-to-peak")
    table(f"{CONTACTS} masses, {CONTACTS} sliders, H = {HARMONICS}, {THREADS} threads", header, rows)
    print(f"largest memory {answer['mib'] / MIB:.2f} GiB of {WANTED_GIB:g} wanted, in a process of its own")


def _child() -> None:
    """Solve, and print what it took."""
    import solver
    from benchmarks.problems import chain, graded_chain

    scene = graded_chain(CONTACTS)
    solver.solve(chain(3, sliders=True), frequency_hz=1.0, harmonics=HARMONICS)  # compiled kernels are loaded
    rows = []
    for frequency in FREQUENCIES:
        begun, cpu = time.perf_counter(), time.process_time()
        solution = solver.solve(scene, frequency_hz=frequency, harmonics=HARMONICS)
        seconds, cpu = time.perf_counter() - begun, time.process_time() - cpu
        rows.append(
            {
                "frequency_hz": frequency, "seconds": seconds, "cpu_seconds": cpu,
                "converged": solution.converged, "status": solution.status.value,
                "residual": solution.residual, "iterations": solution.newton_iterations,
                "half_range": solution.half_peak_to_peak,
                "imbalance": solver.power_balance(solution).imbalance if solution.converged else None,
                "slipping": sum(one.state.value == "stick and slip" for one in solution.contacts),
            }
        )  # fmt: skip
    mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MIB
    for row in rows:
        marched = solver.march(scene, frequency_hz=row["frequency_hz"])
        row["marched"] = marched.half_peak_to_peak if marched.converged else None
    print(json.dumps({"rows": rows, "mib": mib}))


if __name__ == "__main__":
    _child()
