"""Branches of periodic responses over one parameter: walked, with their extrema, by `sweep`."""
