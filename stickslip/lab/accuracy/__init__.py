"""What accuracy costs in time: a response with more and more harmonics."""
