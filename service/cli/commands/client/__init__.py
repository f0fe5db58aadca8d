"""Commands that talk to a running service: jobs, runs and projects."""
