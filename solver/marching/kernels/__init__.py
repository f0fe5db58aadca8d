"""Compiled Taylor steps with located events."""
