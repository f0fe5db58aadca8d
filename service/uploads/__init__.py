"""Uploaded files of matrices, read in a process with limits."""
