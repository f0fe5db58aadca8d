"""Who may do what: callers, keys, limits, and the gate that every request passes."""
