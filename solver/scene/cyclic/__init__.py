"""Cyclic scenes: the whole annulus, and what is wrong with mistuning and wave patterns."""
