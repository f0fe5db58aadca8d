"""Loaded, and made ready, by the process that others are forked off; see `service.workers.processes`.

Who is told to end a group of processes ends the workers by their service: were this process to end at once,
the service would take its workers for dead. It ends when the service closes its pipe.
"""

from __future__ import annotations

import contextlib
import gc
import signal

from service.jobs import answering, kinds
from service.jobs.kinds import previews

signal.signal(signal.SIGTERM, signal.SIG_IGN)
# What goes wrong here goes wrong again in each worker, which says so.
for warm_up in (kinds.warm_up, answering.warm_up, previews.warm_up):
    with contextlib.suppress(Exception):
        warm_up()
# What is there stays: collections in the workers do not look through it, nor copy its memory.
gc.collect()
gc.freeze()
