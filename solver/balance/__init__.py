"""The multi-harmonic balance of a scene for one parameter."""
