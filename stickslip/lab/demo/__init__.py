"""The main job end to end, with pictures."""
