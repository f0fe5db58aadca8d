"""Measured data: kinds with their columns and models, and the formats of files."""
