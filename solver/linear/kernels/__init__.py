"""Compiled receptances of the condensed structure."""
