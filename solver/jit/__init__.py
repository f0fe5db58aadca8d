"""Compilation of the numerical kernels: decorators, cache on disk, parallel compilation; shared numerics."""
