"""Compiled loops of the equations of nonlinear modes."""
