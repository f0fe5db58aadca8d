"""The force by samples in time, compiled."""
