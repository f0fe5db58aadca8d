"""Speed, measured on this machine by `make bench`: opt-in, never part of the tests."""
