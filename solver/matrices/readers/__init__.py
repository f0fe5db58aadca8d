"""Readers of matrix files: one format a file, put into one registry (`reader_registry`)."""
