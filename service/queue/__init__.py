"""The service itself: the queue of jobs, its callers, its stored results."""
