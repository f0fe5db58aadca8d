"""The REST API, a module for each resource, or for small ones of a kind."""
