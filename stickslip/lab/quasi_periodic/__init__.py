"""Responses to excitations of two frequencies without a common period."""
