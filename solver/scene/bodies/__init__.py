"""Rigid bodies, dampers by their shape, and the relative motions of contacts in space."""
