"""Coulomb friction along a line or under limits of their own: force, first and second derivatives."""
