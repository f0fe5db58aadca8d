"""What several kinds of job share: their scenes, problems, sizes and records."""
