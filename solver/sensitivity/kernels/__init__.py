"""Compiled adjoint."""
