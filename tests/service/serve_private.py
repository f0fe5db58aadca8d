"""A service with the private kinds as a process of its own: ``serve_private.py URL WHAT [WORKERS]``.

WHAT is a port, `work` or `dispatch`. With `CLOCK` in its environment, the clock is ahead by the hours
that stand in that file; steady clocks go on.
"""

import os
import sys

CLOCK = "STICKSLIP_TEST_CLOCK"

if __name__ == "__main__":
    # Every worker imports this file anew, and needs nothing of what serves.
    from private_kinds import PRIVATE

    from service.http.server import serve, work
    from service.settings.settings import load_settings

    if CLOCK in os.environ:
        from set_clock import follow

        follow(os.environ[CLOCK])
    url, what, *workers = sys.argv[1:]
    if what in ("work", "dispatch"):
        work(load_settings(database=url, workers=1), PRIVATE, until_empty=what == "work")
    else:
        serve(load_settings(database=url, workers=int(*workers or [2]), port=int(what)), PRIVATE)
