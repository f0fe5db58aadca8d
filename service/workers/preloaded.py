"""Loaded, and made ready, by the process that others are forked off; see `service.workers.processes`.

Who is told to end a group of processes ends the workers by their service: were this process to end at once,
the service would take its workers for dead. It ends when the service closes its pipe.
"""

from __future__ import annotations

import contextlib
import gc
import signal

from solver.first_use import on_demand

signal.signal(signal.SIGTERM, signal.SIG_IGN)
# What is loaded stays, all but a hundredth: nothing looks through it, here or in the workers, nor copies it.
gc.disable()
for place in ("kinds", "answering", "kinds.previews"):
    # What goes wrong here goes wrong again in each worker, which says so.
    with contextlib.suppress(Exception):
        on_demand(f"service.jobs.{place}:warm_up")()
gc.freeze()
gc.enable()
