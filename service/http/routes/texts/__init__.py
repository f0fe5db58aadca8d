"""Routes that read the texts of files: scenes, measured data."""
