"""Robust designs: the worst case, the mean or a quantile over what is not known."""
