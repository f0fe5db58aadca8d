"""Stability of periodic responses, where branches fold and meet, and the search for all of them."""
