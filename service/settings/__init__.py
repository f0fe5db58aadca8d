"""Settings of the service, their table, its log."""
