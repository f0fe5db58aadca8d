"""What follows from the registry of the kinds: their bodies, their table, and those of other packages."""
