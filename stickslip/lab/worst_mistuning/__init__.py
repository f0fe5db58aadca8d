"""Patterns of blades round a disk: the worst mistuning within bounds, and intentional ones."""
