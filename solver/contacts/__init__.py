"""Contact laws: the table of contacts, their forces over a period, derivatives, durations of states."""
