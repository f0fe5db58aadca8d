"""Run benchmarks and print their tables: all of them, or those named on the command line."""

from __future__ import annotations

import argparse
import sys

from benchmarks.harness import WrongResultError
from solver.first_use import on_demand

GROUPS = {
    "chains": ("chain-8", "chain-32", "one-slider"),
    "service": (
        "load", "latency", "requests", "doors", "lists", "runs", "searches", "figures", "workers", "scale",
    ),
}  # fmt: skip
CASES = {
    "responses": "responses:responses",
    "solves": "responses:solves",
    "designs": "responses:designs",
    "start": "start:start",
    "classes": "classes:classes",
    "case-a": "against_peers:case_a_response",
    "chain-8": "against_peers:chain_of_8",
    "chain-32": "against_peers:chain_of_32",
    "one-slider": "against_peers:one_slider",
    "optimum": "against_peers:optimum",
    "one-variable": "designing:one_variable",
    "five-variables": "designing:five_variables",
    "robust": "designing:robust",
    "identify": "identify:identify",
    "disk": "disk:disk_response",
    "map": "disk:disk_map",
    "exponents": "exponents:exponents",
    "beam": "beam:beams",
    "modes": "modes:modes",
    "modes-peers": "modes_peers:modes_peers",
    "space-peers": "space_peers:space_peers",
    "savings": "savings:savings",
    "space": "space:space",
    "space-kernel": "space_kernel:space_kernel",
    "stages": "sweep_costs:stages",
    "figures": "stored_sweeps:figures",
    "two-hundred": "large:two_hundred_contacts",
    "reduction": "reduction:reduction",
    "mesh-day": "mesh_day:mesh_day",
    "sector": "sector:sector",
    "robustness": "robustness:robustness",
    "truth": "truth:truth",
    "load": "service_load:load",
    "latency": "service_load:latency",
    "lists": "service_load:lists",
    "runs": "stored_runs:stored_runs",
    "searches": "stored_runs:searches",
    "requests": "service_requests:requests",
    "doors": "service_requests:doors",
    "pruning": "service_pruning:pruning",
    "workers": "service_workers:workers",
    "scale": "users:scale",
    "page": "page:page",
    "charts": "charts:charts",
    "new-user": "new_user:new_user",
    "cluster": "cluster:mistuning_study",
    "spreading": "spreading:spreading",
    "mistuned": "mistuned:mistuned_disks",
    "rig-coverage": "rigs:rig_coverage",
    "worst-mistuning": "mistuned:worst_patterns",
    "certificates": "certificates:certificates",
    "compiling": "compiling:compiling",
}
"""The function of each case, in a module of this package."""


def main() -> int:
    """Run what is asked for; 1 if a result was wrong."""
    cases = {name: on_demand(f"benchmarks.{place}") for name, place in CASES.items()}
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    listed = "; ".join(f"{name}: {(case.__doc__ or '').splitlines()[0]}" for name, case in cases.items())
    parser.add_argument("case", nargs="*", metavar="CASE", help=listed.replace("%", "%%"))
    parser.add_argument("--scenes", type=int, help="random scenes that certificates looks at")
    given = parser.parse_args()
    asked = given.case or list(cases)
    names = [case for name in asked for case in GROUPS.get(name, (name,))]
    unknown = [name for name in names if name not in cases]
    if unknown:
        parser.error(f"no such case: {', '.join(unknown)}; there are {', '.join(cases)}")
    wrong = 0
    for name in names:
        try:
            cases[name](**({"scenes": given.scenes} if name == "certificates" and given.scenes else {}))
        except WrongResultError as error:
            wrong += 1
            print(f"\n{name}: WRONG, no figure: {error}")
        sys.stdout.flush()
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
