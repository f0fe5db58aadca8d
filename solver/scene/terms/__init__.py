"""Linear terms beside masses, springs and dashpots, and what depends on the speed of rotation."""
