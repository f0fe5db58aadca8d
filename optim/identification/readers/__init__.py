"""Formats of files with measured data, one a module."""
