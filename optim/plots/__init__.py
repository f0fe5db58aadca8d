"""Pictures of designs, in the style of `solver.plots`."""
