"""Readers of files that Nastran writes."""
