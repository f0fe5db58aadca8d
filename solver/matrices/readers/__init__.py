"""Readers of matrix files, one format a module."""
