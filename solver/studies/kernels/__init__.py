"""Compiled rows of a response map."""
