"""Compiled residual, Jacobian and Newton's method of the balance."""
