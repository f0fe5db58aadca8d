"""Scenes of common cases, of few answers or of a shipped scene, as files to begin with."""
