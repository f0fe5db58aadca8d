"""Friction under a circular limit: its motion by collocation, force, first and second derivatives."""
