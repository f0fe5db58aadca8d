"""The HTTP application: middleware, errors, events, metrics."""
