"""Readers of matrix files: one format a file, put into one registry (`solver.matrices.readers.registry`)."""
