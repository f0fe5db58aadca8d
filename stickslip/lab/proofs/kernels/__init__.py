"""The steps of Moreau, compiled."""
