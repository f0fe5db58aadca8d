"""Text of scene files: where every value stands, and changes that leave the rest as it was written."""
