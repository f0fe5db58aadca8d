"""Stability of periodic responses, where branches fold and meet, and the search for all of them."""

MOST_STARTS = 10_000  # of a search for all solutions
