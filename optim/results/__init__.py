"""What a design search returns."""
