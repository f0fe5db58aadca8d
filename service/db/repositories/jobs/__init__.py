"""The jobs, which are the queue: taken in turns, kept by leases, recovered; each a guarded change."""
