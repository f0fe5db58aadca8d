"""Nonlinear springs: force, first and second derivatives."""
