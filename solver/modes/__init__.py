"""Nonlinear modes: frequency and damping ratio over amplitude, and what follows from them."""
