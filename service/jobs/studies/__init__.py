"""The studies that come with the service, one a module; a class `STUDY` in each."""
