"""What a design is judged by: one criterion a file, put into one registry (`criterion_registry`)."""
