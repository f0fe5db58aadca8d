"""Tools by which a language model uses a running service."""
