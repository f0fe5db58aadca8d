"""Exact first and second derivatives of amplitudes and peaks by parameters."""
