"""Limit cycles: where friction takes out what the flow, or a negative damping, puts in."""
