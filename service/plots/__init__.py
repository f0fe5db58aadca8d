"""Pictures of what is stored, drawn as `solver.plots` and `optim.plots` draw what was just computed."""
