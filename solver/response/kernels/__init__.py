"""Compiled loops of responses."""
