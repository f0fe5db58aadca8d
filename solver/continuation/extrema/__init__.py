"""Peaks and bands of a branch, also between its points, with certificate and error estimate."""
