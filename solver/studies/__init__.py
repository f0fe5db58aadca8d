"""Studies of a scene: plan, response map, tracked peaks, mistuning."""
