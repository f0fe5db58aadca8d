"""Peaks tracked over a parameter: `track_peak` and `least_peak`."""
