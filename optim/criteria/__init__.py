"""What a design is judged by: criteria, those of one measure in one module, in one registry (`criterion`)."""
