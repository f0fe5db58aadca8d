"""The studies that come with the service, one a module of its name."""
