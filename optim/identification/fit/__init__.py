"""The fit: predictions of all runs, least squares, and where to start."""
