"""Compiled search and Newton's method for peaks."""
