"""What people read of results of the solver, from the JSON objects that programs read."""
