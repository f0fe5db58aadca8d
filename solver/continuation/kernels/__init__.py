"""Compiled pseudo-arc-length continuation."""
