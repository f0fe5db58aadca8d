"""Pictures of designs, in the style of `solver.views.plots`."""
