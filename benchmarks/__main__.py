"""Run every benchmark and print the tables."""

from __future__ import annotations

from benchmarks.responses import cold_start, designs, responses, solves

if __name__ == "__main__":
    responses()
    solves()
    designs()
    cold_start()
