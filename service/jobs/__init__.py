"""Jobs: what a kind is, its checkpoints, its parts."""
