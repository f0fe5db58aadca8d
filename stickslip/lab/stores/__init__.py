"""Arrays of sweeps outside of the database."""
