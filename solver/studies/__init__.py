"""Studies of a scene: plan, response map, tracked peaks, mistuning, what accuracy costs."""
