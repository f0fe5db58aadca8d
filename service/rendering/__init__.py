"""Stored results as pictures, reports and files."""
