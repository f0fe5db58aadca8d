"""Studies of a scene: plan, response map, mistuning, what accuracy costs."""
