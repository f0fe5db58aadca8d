"""The design layer."""
