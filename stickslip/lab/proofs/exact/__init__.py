"""Exact periodic orbits of piecewise linear scenes: rigid friction, elastic friction, springs on one side."""
