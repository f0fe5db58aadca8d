"""Who may do what: callers, keys, limits, and who a key belongs to."""
